"""The paper's march over planes that bound tilted pixels, one ray at a time."""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import fetch_add
from hybrid_rt.kernels.techniques.screen import (
    CHUNK,
    EXHAUSTED,
    F0,
    HIDDEN,
    HIT,
    OFFSCREEN,
    axis,
    clamp,
    edge_s,
    next_cell,
    screen_ray,
    write_row,
)

# A ray that enters a pixel on its plane may come out behind it by rounding: of the depth and of the
# plane's value, some half-ulps each, and of the place on the screen, a half-ulp of the coordinate
# times the slope for the ray's product, its sum and the plane's centre.
ROUNDING = np.float32(2.0**-22)


@inlined
def height_above(data, cell, level, lx, ly, x, y, z):
    """Return how far a ray's point is in front of the plane of a cell, and the rounding of that."""
    half = np.float32(0.5) * np.float32(1 << level)
    slope_x, slope_y = data[cell, 1], data[cell, 2]
    out_x = slope_x * (x - (np.float32(lx << level) + half))
    out_y = slope_y * (y - (np.float32(ly << level) + half))
    slack = ROUNDING * (abs(z) + abs(slope_x) * x + abs(slope_y) * y)
    return z - (data[cell, 0] + out_x + out_y), slack


@inlined
def march_ray(
    status, x, y, z0, dx, dy, dz, s_end, own_x, own_y, width, height,
    data, offsets, pitches, samples, max_steps, steps_by_level,
):  # fmt: skip
    """March one ray; return (status, pixel x, pixel y, s of the hit, s found free, steps)."""
    top = offsets.shape[0] - 1
    inv_x, bias_x, step_x, far_x = axis(dx)
    inv_y, bias_y, step_y, far_y = axis(dy)
    cx = clamp(int(x), 0, width - 1)
    cy = clamp(int(y), 0, height - 1)
    s = F0
    level = 0
    steps = 0
    # A ray on the visible surface of its own pixel leaves that pixel unread: the surface would
    # only be compared with itself.
    skip = cx == own_x and cy == own_y
    while True:
        blocked = False
        for _ in range(samples):
            lx, ly = cx >> level, cy >> level
            edge_x, edge_y = (lx + far_x) << level, (ly + far_y) << level
            sx = edge_s(edge_x, x, inv_x, bias_x)
            sy = edge_s(edge_y, y, inv_y, bias_y)
            s_exit = max(s, min(min(sx, sy), s_end))
            if skip:
                skip = False
            else:
                if steps == max_steps:
                    return EXHAUSTED, -1, -1, F0, s, steps
                steps += 1
                steps_by_level[level] += 1
                cell = offsets[level] + ly * pitches[level] + lx
                entry, slack = height_above(
                    data, cell, level, lx, ly, x + dx * s, y + dy * s, z0 + dz * s
                )
                leave, _ = height_above(
                    data, cell, level, lx, ly, x + dx * s_exit, y + dy * s_exit, z0 + dz * s_exit
                )
                if entry < -slack or leave <= F0:
                    if level > 0:
                        blocked = True
                        break
                    if entry < -slack:
                        return HIDDEN, -1, -1, F0, s, steps
                    entry = max(entry, F0)
                    span = s_exit - s
                    hit = s + span * (entry / (entry - leave)) if entry > leave else s
                    return HIT, cx, cy, hit, hit, steps
            s = s_exit
            if s >= s_end:
                return status, -1, -1, F0, s_end, steps
            cx, cy = next_cell(
                cx, cy, lx, ly, level, edge_x, edge_y, sx, sy, s, x, y, dx, dy, step_x, step_y
            )
            if cx < 0 or cy < 0 or cx >= width or cy >= height:
                return OFFSCREEN, -1, -1, F0, s, steps
        if blocked:
            level -= 1
        elif level < top:
            level += 1


@kernel
def march_chunk(
    first, last, origin, direction, ray_pixel, t_near, t_far, prim_id,
    data, offsets, pitches, m, eye, near, samples, max_steps,
    status, resolved, pixel, prim, t, t_free, steps, steps_by_level,
):  # fmt: skip
    """Set up rays in float64, march them in float32 and write their rows of the outputs."""
    height, width = prim_id.shape
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
                ray_pixel[i, 0], ray_pixel[i, 1], width, height,
                data, offsets, pitches, samples, max_steps, steps_by_level,
            )  # fmt: skip
        write_row(
            i, how, how == HIT, hit_x, hit_y, s_hit, s_free, count, s_end >= 0.0, z, gz,
            t_near, t_far, prim_id, status, resolved, pixel, prim, t, t_free, steps,
        )  # fmt: skip


@parallel_kernel
def march(
    workers, origin, direction, ray_pixel, t_near, t_far, prim_id,
    data, offsets, pitches, m, eye, near, samples, max_steps,
    status, resolved, pixel, prim, t, t_free, steps, steps_by_level,
):  # fmt: skip
    """March rays (N, 3) through planes (cells, 3); outputs (N,), steps_by_level (workers, L)."""
    n = origin.shape[0]
    taken = np.zeros(1, np.int64)
    for worker in prange(workers):
        first = fetch_add(taken.ctypes.data, CHUNK)
        while first < n:
            march_chunk(
                first, min(n, first + CHUNK), origin, direction, ray_pixel, t_near, t_far,
                prim_id, data, offsets, pitches, m, eye, near, samples, max_steps,
                status, resolved, pixel, prim, t, t_free, steps, steps_by_level[worker],
            )  # fmt: skip
            first = fetch_add(taken.ctypes.data, CHUNK)
