"""Kernels that read a table in the lanes of vectors and do nothing else."""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import kernel, parallel_kernel
from hybrid_rt.kernels.simd import WIDTH

# As 32-bit linear congruential generators: of full period modulo every power of two.
FACTOR, TERM = 1664525, 1013904223
I32, F32 = np.int32, np.float32


@kernel
def gather_some(table, bits, vectors, seed):
    """Gather `vectors` vectors at random from table (2**bits,) float32, 4 at a time; return a sum.

    The generators' high bits are the places; their low bits repeat soon.
    """
    last = I32((1 << bits) - 1)
    live = simd.mask(True)
    a = simd.iota() * I32(FACTOR) + I32(seed)
    b, c, d = a + I32(0x1234567), a + I32(0x2345678), a + I32(0x3456789)
    s, t = simd.f32(0.0), simd.f32(0.0)
    u, v = simd.f32(0.0), simd.f32(0.0)
    for _ in range(vectors // 4):
        a, b = a * I32(FACTOR) + I32(TERM), b * I32(FACTOR) + I32(TERM)
        c, d = c * I32(FACTOR) + I32(TERM), d * I32(FACTOR) + I32(TERM)
        s = s + simd.gather(table, (a >> I32(4)) & last, live, F32(0.0))
        t = t + simd.gather(table, (b >> I32(4)) & last, live, F32(0.0))
        u = u + simd.gather(table, (c >> I32(4)) & last, live, F32(0.0))
        v = v + simd.gather(table, (d >> I32(4)) & last, live, F32(0.0))
    return simd.reduce_add((s + t) + (u + v))


@kernel
def chain_some(table, bits, vectors, seed):
    """Gather `vectors` vectors, each from where the last one says; return a sum.

    table (2**bits,) float32 holds int32: a cycle through all places.
    """
    last = I32((1 << bits) - 1)
    live = simd.mask(True)
    at = (simd.iota() * I32(FACTOR) + I32(seed)) & last
    for _ in range(vectors):
        at = simd.bits_i32(simd.gather(table, at, live, F32(0.0)))
    return np.float32(simd.reduce_add(at))


@kernel
def load_some(table, bits, vectors, seed):
    """Load `vectors` vectors of neighbours of table (2**bits,) float32; return a sum."""
    whole = 1 << bits
    s, t = simd.f32(0.0), simd.f32(0.0)
    u, v = simd.f32(0.0), simd.f32(0.0)
    start = (seed * 4096) & (whole - 1)
    for k in range(0, vectors * WIDTH, 4 * WIDTH):
        at = (start + k) & (whole - 1)
        s = s + simd.load(table, at)
        t = t + simd.load(table, at + WIDTH)
        u = u + simd.load(table, at + 2 * WIDTH)
        v = v + simd.load(table, at + 3 * WIDTH)
    return simd.reduce_add((s + t) + (u + v))


@parallel_kernel
def gather_all(share, table, bits, vectors, sums):
    """Have every worker gather; sums (workers,) float32."""
    sums[share.worker] = gather_some(table, bits, vectors, share.worker + 1)


@parallel_kernel
def chain_all(share, table, bits, vectors, sums):
    """Have every worker follow its chain; sums (workers,) float32."""
    sums[share.worker] = chain_some(table, bits, vectors, share.worker + 1)


@parallel_kernel
def load_all(share, table, bits, vectors, sums):
    """Have every worker load; sums (workers,) float32."""
    sums[share.worker] = load_some(table, bits, vectors, share.worker + 1)
