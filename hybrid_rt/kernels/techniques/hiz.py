"""The hierarchical-Z march with a confidence, as AMD documents it, one ray at a time."""

from __future__ import annotations

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
    MISS,
    OFFSCREEN,
    axis,
    clamp,
    edge_s,
    next_cell,
    screen_ray,
    write_row,
)


@inlined
def within_cell(place, coarse, level, now, step):
    """Return the pixel of a coordinate in a cell, not behind the pixel that the ray came from."""
    low = now if step > 0 else coarse << level
    high = now if step < 0 else ((coarse + 1) << level) - 1
    return clamp(int(place), low, high)


@inlined
def march_ray(
    status, x, y, z0, dx, dy, dz, s_end, own_x, own_y, width, height,
    cells, offsets, pitches, max_steps, steps_by_level,
):  # fmt: skip
    """March one ray; return (status, pixel x, pixel y, s, samples) of where it stops.

    HIT means that it stopped at, or behind, the depth of that pixel.
    """
    top = offsets.shape[0] - 1
    inv_x, bias_x, step_x, far_x = axis(dx)
    inv_y, bias_y, step_y, far_y = axis(dy)
    cx = clamp(int(x), 0, width - 1)
    cy = clamp(int(y), 0, height - 1)
    s = F0
    level = 0
    steps = 0
    # A ray on the visible surface of its own pixel leaves that pixel unread.
    skip = cx == own_x and cy == own_y
    while True:
        lx, ly = cx >> level, cy >> level
        edge_x, edge_y = (lx + far_x) << level, (ly + far_y) << level
        sx = edge_s(edge_x, x, inv_x, bias_x)
        sy = edge_s(edge_y, y, inv_y, bias_y)
        s_exit = min(min(sx, sy), s_end)
        if skip:
            skip = False
        else:
            if steps == max_steps:
                return EXHAUSTED, cx, cy, s, steps
            steps += 1
            steps_by_level[level] += 1
            nearest = cells[offsets[level] + ly * pitches[level] + lx]
            if nearest > F0 and not z0 + dz * (s_exit if dz < F0 else s) > nearest:
                if z0 + dz * s > nearest:
                    # In front at its entry: it meets the cell's depth on its way away from the eye.
                    s = clamp((nearest - z0) / dz, s, max(s, s_exit))
                    cx = within_cell(x + dx * s, lx, level, cx, step_x)
                    cy = within_cell(y + dy * s, ly, level, cy, step_y)
                if level == 0:
                    return HIT, cx, cy, s, steps
                level -= 1
                continue
        if s_exit > s:
            s = s_exit
        if s_exit >= s_end:
            cx = within_cell(x + dx * s_end, lx, level, cx, step_x)
            cy = within_cell(y + dy * s_end, ly, level, cy, step_y)
            return status, clamp(cx, 0, width - 1), clamp(cy, 0, height - 1), s_end, steps
        cx, cy = next_cell(
            cx, cy, lx, ly, level, edge_x, edge_y, sx, sy, s, x, y, dx, dy, step_x, step_y
        )
        if cx < 0 or cy < 0 or cx >= width or cy >= height:
            return OFFSCREEN, -1, -1, s, steps
        if level < top:
            level += 1


@inlined
def smoothstep(x):
    """Return the cubic that rises from 0 at 0 to 1 at 1 and is level there."""
    x = clamp(x, F0, F1)
    return x * x * (np.float32(3.0) - (x + x))


@inlined
def fade(place, size, margin):
    """Return the vignette of one axis, 0 at either side of the image to 1 from `margin` on."""
    if margin <= F0:
        return F1
    return smoothstep(min(place, np.float32(size) - place) / margin)


@inlined
def faces_ray(i, j, depth, ddx, ddy, x0, y0, z0, dx, dy, dz):
    """Return whether the plane of pixel (i, j) is seen from the side that the ray comes from.

    In homogeneous screen space the plane is ``near - (a q_x + b q_y + c q_z) = 0``, positive at the
    eye; along the ray it falls if ``a dx + b dy - dz (c + a x0 + b y0) / z0 > 0``.
    """
    a, b = ddx[j, i], ddy[j, i]
    plane = depth[j, i] + a * (x0 - np.float32(i) - HALF) + b * (y0 - np.float32(j) - HALF)
    return z0 * (a * dx + b * dy) > dz * plane


@inlined
def confidence(i, j, s, depth, ddx, ddy, x0, y0, z0, dx, dy, dz, near, thickness, margin):
    """Return how far a stop at s in pixel (i, j) is to be trusted, 0 to 1; `margin` in pixels."""
    height, width = depth.shape
    ray, surface = z0 + dz * s, depth[j, i]
    if ray <= F0 or surface <= F0 or not faces_ray(i, j, depth, ddx, ddy, x0, y0, z0, dx, dy, dz):
        return F0
    apart = abs(near / ray - near / surface)
    vignette = fade(x0 + dx * s, width, margin) * fade(y0 + dy * s, height, margin)
    return (F1 - smoothstep(apart / thickness)) * vignette


@kernel
def march_chunk(
    first, last, origin, direction, ray_pixel, t_near, t_far, depth, ddx, ddy, prim_id,
    cells, offsets, pitches, m, eye, near,
    thickness, threshold, border, exhausted_hits, trace_background, max_steps,
    status, resolved, pixel, prim, t, t_free, steps, steps_by_level,
):  # fmt: skip
    """Set up rays in float64, march them in float32 and write their rows of the outputs."""
    height, width = depth.shape
    margin = np.float32(border * height)
    for i in range(first, last):
        end, x, y, depth0, dx, dy, dz, s_end, z, gz = screen_ray(
            np.float64(origin[i, 0]), np.float64(origin[i, 1]), np.float64(origin[i, 2]),
            np.float64(direction[i, 0]), np.float64(direction[i, 1]), np.float64(direction[i, 2]),
            np.float64(t_near[i]), np.float64(t_far[i]), m, eye, near, width, height,
        )  # fmt: skip
        how, at_x, at_y, s, count = end, -1, -1, F0, 0
        hit_x, hit_y = -1, -1
        answers = False
        if s_end >= 0.0:
            x0, y0, z0 = np.float32(x), np.float32(y), np.float32(depth0)
            ex, ey, ez = np.float32(dx), np.float32(dy), np.float32(dz)
            how, at_x, at_y, s, count = march_ray(
                end, x0, y0, z0, ex, ey, ez, np.float32(s_end),
                ray_pixel[i, 0], ray_pixel[i, 1], width, height,
                cells, offsets, pitches, max_steps, steps_by_level,
            )  # fmt: skip
            judged = how == HIT or (how == EXHAUSTED and exhausted_hits)
            if (judged or how == MISS) and depth[at_y, at_x] <= F0:
                answers = not trace_background
            elif judged:
                answers = threshold <= confidence(
                    at_x, at_y, s, depth, ddx, ddy, x0, y0, z0, ex, ey, ez,
                    np.float32(near), np.float32(thickness), margin,
                )  # fmt: skip
                if answers:
                    hit_x, hit_y = at_x, at_y
                elif how == HIT:
                    how = HIDDEN
        write_row(
            i, how, answers, hit_x, hit_y, s, s, count, s_end >= 0.0, z, gz,
            t_near, t_far, prim_id, status, resolved, pixel, prim, t, t_free, steps,
        )  # fmt: skip


@parallel_kernel
def march(
    workers, origin, direction, ray_pixel, t_near, t_far, depth, ddx, ddy, prim_id,
    cells, offsets, pitches, m, eye, near,
    thickness, threshold, border, exhausted_hits, trace_background, max_steps,
    status, resolved, pixel, prim, t, t_free, steps, steps_by_level,
):  # fmt: skip
    """March rays (N, 3) through a pyramid; outputs (N,), steps_by_level (workers, L) int64."""
    n = origin.shape[0]
    taken = np.zeros(1, np.int64)
    for worker in prange(workers):
        first = fetch_add(taken.ctypes.data, CHUNK)
        while first < n:
            march_chunk(
                first, min(n, first + CHUNK), origin, direction, ray_pixel, t_near, t_far,
                depth, ddx, ddy, prim_id, cells, offsets, pitches, m, eye, near,
                thickness, threshold, border, exhausted_hits, trace_background, max_steps,
                status, resolved, pixel, prim, t, t_free, steps, steps_by_level[worker],
            )  # fmt: skip
            first = fetch_add(taken.ctypes.data, CHUNK)
