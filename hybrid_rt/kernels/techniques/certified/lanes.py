"""The certified march in vectors: the answers of `certified.scalar`.

A *batch* of rays is set up into rows of plain arrays, *slots*. Its rays then go from queue to
queue: `step` walks what is ready, a ray in each lane, until something may be in the ray's way;
`look` goes through the list of the pixel that it has come to; `test` intersects it with a
primitive. Queues hold slots, so that each stage finds its lanes full, whatever other rays do. A
lane of `step` whose ray has left is given the next one, once a few are free. At last the results of
a batch are written to the rows of the outputs.

Every lane computes what `certified.scalar` computes, operation by operation, so both
have the same answers, ray for ray and step for step; there are the reasons and the error bounds.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import called, parallel_kernel
from hybrid_rt.kernels._queue import take
from hybrid_rt.kernels.techniques.certified.look import look, test
from hybrid_rt.kernels.techniques.certified.setup import set_up
from hybrid_rt.kernels.techniques.certified.slots import (
    BATCH,
    F32,
    F32_ROWS,
    F64_ROWS,
    I32_ROWS,
    STRIDE,
    W,
)
from hybrid_rt.kernels.techniques.certified.step import step
from hybrid_rt.kernels.techniques.certified.write import unmarched, write
from hybrid_rt.kernels.techniques.screen import (
    SKIPPED,
)

CHUNK = 1024
GROUP = 16


@called
def walk(
    many, slots_f, slots_i, slots_d, ready, looks, tests, prim_id, nearest, rest, planes,
    shape, cells, bits, corners, max_steps, max_tests, any_hit, work,
):  # fmt: skip
    """March the rays of slots 0..many-1 to their ends; what it took is added to work (COUNTERS,).

    prim_id, nearest (H * W * K,), rest (H * W,); cells and bits: a pyramid and the two logarithms
    of its size; ready, looks, tests: scratch (STRIDE,) int32.
    """
    for k in range(many):
        ready[k] = k
    n_ready, n_looks = many, 0
    while n_ready > 0 or n_looks > 0:
        n_ready, n_looks = step(
            ready, n_ready, looks, n_looks, n_looks > 0, slots_f, slots_i, shape, cells, bits,
            max_steps, work,
        )  # fmt: skip
        n_ready, n_tests = look(
            looks, n_looks, ready, n_ready, tests, slots_f, slots_i, prim_id, nearest, rest,
            planes, shape, max_tests, work,
        )  # fmt: skip
        n_looks = test(tests, n_tests, looks, slots_f, slots_i, slots_d, corners, any_hit, work)


@called
def march_some(
    order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits, corners,
    max_steps, max_tests, any_hit, slots_f, slots_i, slots_d, ready, looks, tried, out, work,
):  # fmt: skip
    """March the rays order[:many]. `order` has W more rows than are used."""
    how = np.empty(W, np.int32)
    free = np.empty(W, np.float32)
    filled = 0
    for k in range(0, many, W):
        placed = set_up(
            simd.load(order, k), simd.first(many - k), filled, rays, size, box,
            slots_f, slots_i, slots_d, how, free,
        )  # fmt: skip
        filled += placed
        if placed < min(W, many - k):
            for lane in range(min(W, many - k)):
                if how[lane] >= 0:
                    unmarched(order[k + lane], how[lane], free[lane], out)
        if filled > BATCH - W or k + W >= many:
            walk(
                filled, slots_f, slots_i, slots_d, ready, looks, tried,
                prim_id, nearest, rest, planes, shape, cells, bits, corners,
                max_steps, max_tests, any_hit, work,
            )  # fmt: skip
            write(filled, slots_f, slots_i, slots_d, out)
            filled = 0


@parallel_kernel
def march(
    share, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits, corners,
    max_steps, max_tests, any_hit, probes, out, work,
):  # fmt: skip
    """March rays (N, 3); outputs (N,), work (workers, COUNTERS).

    Of each GROUP of rays `probes` are marched first, and the others only if one of these was
    resolved.
    """
    count = len(rays[2])
    slots_f = np.zeros(F32_ROWS * STRIDE, np.float32)
    slots_i = np.zeros(I32_ROWS * STRIDE, np.int32)
    slots_d = np.zeros(F64_ROWS * STRIDE, np.float64)
    ready = np.zeros(STRIDE, np.int32)
    looks = np.zeros(STRIDE, np.int32)
    tried = np.zeros(STRIDE, np.int32)
    order = np.zeros(CHUNK + W, np.int32)
    resolved = out[1]
    apart = GROUP // probes
    first = take(share, CHUNK)
    while first < count:
        last = min(count, first + CHUNK)
        many = 0
        for i in range(first + apart // 2, last, apart):
            order[many] = i
            many += 1
        march_some(
            order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits,
            corners, max_steps, max_tests, any_hit,
            slots_f, slots_i, slots_d, ready, looks, tried, out, work[share.worker],
        )  # fmt: skip
        many = 0
        for group in range(first, last, GROUP):
            end = min(group + GROUP, last)
            hopeful = group + apart // 2 >= end
            for i in range(group + apart // 2, end, apart):
                hopeful |= resolved[i]
            for i in range(group, end):
                if (i - group) % apart == apart // 2:
                    continue
                if hopeful:
                    order[many] = i
                    many += 1
                else:
                    unmarched(i, SKIPPED, F32(0.0), out)
        march_some(
            order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits,
            corners, max_steps, max_tests, any_hit,
            slots_f, slots_i, slots_d, ready, looks, tried, out, work[share.worker],
        )  # fmt: skip
        first = take(share, CHUNK)
