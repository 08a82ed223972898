"""The perspective-correct pixel DDA of "Efficient GPU Screen-Space Ray Tracing", ray by ray.

On the screen x, y and depth = near / z_view are linear in s, so equal steps of s are equal steps of
pixels and 1 / z_view is interpolated, as the paper has it.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import fetch_add
from hybrid_rt.kernels.techniques.screen import (
    CHUNK,
    EXHAUSTED,
    F0,
    HALF,
    HIDDEN,
    HIT,
    clamp,
    screen_ray,
    slab_bottom,
    write_row,
)

FAR = np.float32(1e37)  # an s beyond all others that can still be doubled


@inlined
def nearest_s(level, z0, dz, low, high):
    """Return the s in [low, high] at which the ray's depth is nearest to `level`."""
    if dz == F0:
        return low
    return clamp((level - z0) / dz, low, high)


@inlined
def march_ray(
    status, x, y, z0, dx, dy, dz, s_end, own_x, own_y, depth, thickness, stride, jitter, max_steps
):  # fmt: skip
    """March one ray; return (status, pixel x, pixel y, s of the hit, s found free, samples).

    `thickness` in units of the near plane's distance.
    """
    height, width = depth.shape
    s_end = min(s_end, FAR)
    # A ray straight towards or away from the eye stays in its pixel: one sample is all of it.
    step = min(stride / max(abs(dx), abs(dy)), FAR)
    first = F0
    s_free = F0
    passed = False  # behind a surface
    number = jitter
    steps = 0
    while first < s_end:
        at = min(number * step, s_end)
        last = min((number + HALF) * step, s_end)
        number += np.float32(1.0)
        i = clamp(int(x + dx * at), 0, width - 1)
        j = clamp(int(y + dy * at), 0, height - 1)
        # The pixel that a ray starts from is not compared with itself.
        if not (i == own_x and j == own_y):
            if steps == max_steps:
                return EXHAUSTED, -1, -1, F0, s_free, steps
            steps += 1
            surface = depth[j, i]
            a, b = z0 + dz * first, z0 + dz * last
            if surface > F0 and min(a, b) <= surface:
                if max(a, b) >= slab_bottom(surface, thickness):
                    return HIT, i, j, nearest_s(surface, z0, dz, first, last), s_free, steps
                passed = True
        if not passed:
            s_free = last
        first = last
    if passed:
        return HIDDEN, -1, -1, F0, s_free, steps
    return status, -1, -1, F0, s_end, steps


@kernel
def march_chunk(
    first, last, origin, direction, ray_pixel, t_near, t_far, depth, prim_id, m, eye, near,
    thickness, stride, jitter, max_steps,
    status, resolved, pixel, prim, t, t_free, steps,
):  # fmt: skip
    """Set up rays in float64, march them in float32 and write their rows of the outputs."""
    height, width = depth.shape
    for i in range(first, last):
        end, x, y, z0, dx, dy, dz, s_end, z, gz = screen_ray(
            np.float64(origin[i, 0]), np.float64(origin[i, 1]), np.float64(origin[i, 2]),
            np.float64(direction[i, 0]), np.float64(direction[i, 1]), np.float64(direction[i, 2]),
            np.float64(t_near[i]), np.float64(t_far[i]), m, eye, near, width, height,
        )  # fmt: skip
        how, hit_x, hit_y, s_hit, s_free, count = end, -1, -1, F0, F0, 0
        if s_end >= 0.0:
            how, hit_x, hit_y, s_hit, s_free, count = march_ray(
                end, np.float32(x), np.float32(y), np.float32(z0),
                np.float32(dx), np.float32(dy), np.float32(dz), np.float32(s_end),
                ray_pixel[i, 0], ray_pixel[i, 1], depth,
                np.float32(thickness / near), np.float32(stride), np.float32(jitter), max_steps,
            )  # fmt: skip
        write_row(
            i, how, how == HIT, hit_x, hit_y, s_hit, s_free, count, s_end >= 0.0, z, gz,
            t_near, t_far, prim_id, status, resolved, pixel, prim, t, t_free, steps,
        )  # fmt: skip


@parallel_kernel
def march(
    workers, origin, direction, ray_pixel, t_near, t_far, depth, prim_id, m, eye, near,
    thickness, stride, jitter, max_steps,
    status, resolved, pixel, prim, t, t_free, steps,
):  # fmt: skip
    """March rays (N, 3) through a depth buffer (H, W); outputs (N,). McGuire and Mara, 2014."""
    n = origin.shape[0]
    taken = np.zeros(1, np.int64)
    for _ in prange(workers):
        first = fetch_add(taken.ctypes.data, CHUNK)
        while first < n:
            march_chunk(
                first, min(n, first + CHUNK), origin, direction, ray_pixel, t_near, t_far,
                depth, prim_id, m, eye, near, thickness, stride, jitter, max_steps,
                status, resolved, pixel, prim, t, t_free, steps,
            )  # fmt: skip
            first = fetch_add(taken.ctypes.data, CHUNK)
