"""The linear march in the world, one ray at a time.

In units of z_view where the ray starts, the ray's length is u; with the cosine g between its
direction and the camera's, ``z_view(u) = z (1 + u g)``, so the screen parameter of
`kernels.screen`, for a direction of unit length, is ``s = u / (1 + u g)``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import fetch_add
from hybrid_rt.kernels.techniques.screen import (
    CHUNK,
    EXHAUSTED,
    F0,
    F1,
    HALF,
    HIDDEN,
    HIT,
    clamp,
    screen_ray,
    slab_bottom,
    write_row,
)

IN_FRONT, INSIDE, BEHIND = range(3)


@inlined
def look(s, x, y, z0, dx, dy, dz, own_x, own_y, depth, thickness):
    """Return where the ray's point at s is in respect of its pixel's slab, and the pixel."""
    height, width = depth.shape
    i = clamp(int(x + dx * s), 0, width - 1)
    j = clamp(int(y + dy * s), 0, height - 1)
    surface = depth[j, i]
    ray = z0 + dz * s
    # The pixel that a ray starts from is not compared with itself.
    if surface <= F0 or ray > surface or (i == own_x and j == own_y):
        return IN_FRONT, i, j
    if ray >= slab_bottom(surface, thickness):
        return INSIDE, i, j
    return BEHIND, i, j


@inlined
def march_ray(
    status, x, y, z0, dx, dy, dz, cosine, s_end, own_x, own_y, depth,
    thickness, stride, refinements, max_steps,
):  # fmt: skip
    """March one ray; return (status, pixel x, pixel y, s of the hit, s found free, samples).

    `thickness` in units of the near plane's distance; the deltas are those of a unit direction.
    """
    s_free = F0
    passed = False  # behind a surface
    step = 0
    while True:
        step += 1
        u = np.float32(step) * stride
        stretch = F1 + u * cosine
        s = u / stretch
        if stretch <= F0 or not s < s_end:
            if passed:
                return HIDDEN, -1, -1, F0, s_free, step - 1
            return status, -1, -1, F0, s_end, step - 1
        if step > max_steps:
            return EXHAUSTED, -1, -1, F0, s_free, max_steps
        where, i, j = look(s, x, y, z0, dx, dy, dz, own_x, own_y, depth, thickness)
        if where == INSIDE:
            break
        if where == BEHIND:
            passed = True
        elif not passed:
            s_free = s
    low, high = u - stride, u
    for _ in range(refinements):
        middle = HALF * (low + high)
        at = middle / (F1 + middle * cosine)
        where, mid_i, mid_j = look(at, x, y, z0, dx, dy, dz, own_x, own_y, depth, thickness)
        if where == INSIDE:
            high, s, i, j = middle, at, mid_i, mid_j
        else:
            low = middle
    return HIT, i, j, s, s_free, step + refinements


@kernel
def march_chunk(
    first, last, origin, direction, ray_pixel, t_near, t_far, depth, prim_id, m, eye, near,
    thickness, stride, refinements, max_steps,
    status, resolved, pixel, prim, t, t_free, steps,
):  # fmt: skip
    """Set up rays in float64, march them in float32 and write their rows of the outputs."""
    height, width = depth.shape
    for i in range(first, last):
        ox, oy, oz = np.float64(origin[i, 0]), np.float64(origin[i, 1]), np.float64(origin[i, 2])
        vx, vy, vz = (
            np.float64(direction[i, 0]), np.float64(direction[i, 1]), np.float64(direction[i, 2]),
        )  # fmt: skip
        end, x, y, z0, dx, dy, dz, s_end, z, gz = screen_ray(
            ox, oy, oz, vx, vy, vz, np.float64(t_near[i]), np.float64(t_far[i]),
            m, eye, near, width, height,
        )  # fmt: skip
        how, hit_x, hit_y, s_hit, s_free, count = end, -1, -1, F0, F0, 0
        length = math.sqrt(vx * vx + vy * vy + vz * vz)
        if s_end >= 0.0:
            how, hit_x, hit_y, s_hit, s_free, count = march_ray(
                end, np.float32(x), np.float32(y), np.float32(z0),
                np.float32(dx / length), np.float32(dy / length), np.float32(dz / length),
                np.float32(gz / length), np.float32(s_end * length),
                ray_pixel[i, 0], ray_pixel[i, 1], depth,
                np.float32(thickness / near), np.float32(stride), refinements, max_steps,
            )  # fmt: skip
        write_row(
            i, how, how == HIT, hit_x, hit_y, s_hit / length, s_free / length, count,
            s_end >= 0.0, z, gz, t_near, t_far, prim_id,
            status, resolved, pixel, prim, t, t_free, steps,
        )  # fmt: skip


@parallel_kernel
def march(
    workers, origin, direction, ray_pixel, t_near, t_far, depth, prim_id, m, eye, near,
    thickness, stride, refinements, max_steps,
    status, resolved, pixel, prim, t, t_free, steps,
):  # fmt: skip
    """March rays (N, 3) through a depth buffer (H, W); outputs (N,). Sousa et al., 2011."""
    n = origin.shape[0]
    taken = np.zeros(1, np.int64)
    for _ in prange(workers):
        first = fetch_add(taken.ctypes.data, CHUNK)
        while first < n:
            march_chunk(
                first, min(n, first + CHUNK), origin, direction, ray_pixel, t_near, t_far,
                depth, prim_id, m, eye, near, thickness, stride, refinements, max_steps,
                status, resolved, pixel, prim, t, t_free, steps,
            )  # fmt: skip
            first = fetch_add(taken.ctypes.data, CHUNK)
