"""The one loop of all marches that go ray by ray: set up, march, write.

A technique is known by the type of its numbers: `marches` says which function marches one ray for
them, and Numba puts that function into a copy of the loop.
"""

from __future__ import annotations

import numpy as np
from numba.extending import overload

from hybrid_rt.kernels._borrow import borrowed, borrowed_record
from hybrid_rt.kernels._jit import OPTIONS, called, parallel_kernel
from hybrid_rt.kernels._queue import take
from hybrid_rt.kernels.techniques.screen import CHUNK, screen_ray, write_row


def march_ray(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level):
    """March one ray that starts on the screen.

    Return (status, does it answer, pixel x, pixel y, s of the hit, s found free, steps); pixel x is
    -1 where no pixel answers with a hit.
    """
    raise NotImplementedError("for compiled code only")


def marches(numbers_class):
    """Decorate the function that marches one ray for numbers of a class, as `march_ray` says."""

    def decorate(function):
        @overload(march_ray, jit_options=OPTIONS | {"forceinline": True})
        def choose(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level):
            of_class = getattr(numbers, "instance_class", None) is numbers_class
            return function if of_class else None

        return function

    return decorate


@called
def march_chunk(first, last, rays, view, buffers, pyramid, numbers, out, steps_by_level):
    """Set up rays in float64, march them in float32 and write their rows of the outputs."""
    # The arguments are alive, and counting references to their arrays costs time in every chunk.
    rays, view, buffers = borrowed_record(rays), borrowed_record(view), borrowed_record(buffers)
    pyramid, out = borrowed_record(pyramid), borrowed_record(out)
    steps_by_level = borrowed(steps_by_level)
    height, width = buffers.depth.shape
    for i in range(first, last):
        ray, scale = screen_ray(i, rays, view, width, height)
        row = ray.status, False, -1, -1, np.float32(0.0), np.float32(0.0), 0
        if ray.s_end >= 0.0:
            own_x, own_y = rays.pixel[i, 0], rays.pixel[i, 1]
            row = march_ray(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level)
        write_row(i, row, ray, scale, rays, buffers.prim_id, out)


@parallel_kernel
def march(share, rays, view, buffers, pyramid, numbers, out, steps_by_level):
    """March rays; out (N,), steps_by_level (workers, L) int64 is added to.

    rays, view, buffers, pyramid, out: as in `hybrid_rt.kernels.arrays`; pyramid may be () for a
    technique that reads none.
    """
    n = len(rays.t_near)
    first = take(share, CHUNK)
    while first < n:
        march_chunk(
            first, min(n, first + CHUNK), rays, view, buffers, pyramid, numbers, out,
            steps_by_level[share.worker],
        )  # fmt: skip
        first = take(share, CHUNK)
