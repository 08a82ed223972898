"""The march of "Ray Tracing Algorithm Based on Screen Space Ray Marching", one ray at a time."""

from __future__ import annotations

import numpy as np

from naive.stepping.compiled import inlined as called
from naive.stepping.screen import (
    EXHAUSTED,
    F0,
    HALF,
    HIDDEN,
    HIT,
    OFFSCREEN,
    axis,
    clamp,
    edge_s,
    next_cell,
)


@called
def tilted_plane_s(i, j, buffers, line, axes, s_start, s_end):
    """Return the s at which the ray meets the plane of pixel (i, j) inside that pixel, or -1.

    The pixel is the plane ``depth + ddx (x - i - 1/2) + ddy (y - j - 1/2)``; the ray must reach it
    from the observer's side. `line`: its start and deltas on the screen; `axes`: see `screen.axis`.
    Paper: "Correct".
    """
    depth, ddx, ddy, _ = buffers
    x0, y0, z0, dx, dy, dz = line
    inv_x, inv_y, step_x, step_y = axes
    centre = depth[j, i]
    if centre <= F0:
        return np.float32(-1.0)
    first, last = s_start, s_end
    if step_x != 0:
        first = max(first, (np.float32(i + (step_x < 0)) - x0) * inv_x)
        last = min(last, (np.float32(i + (step_x > 0)) - x0) * inv_x)
    if step_y != 0:
        first = max(first, (np.float32(j + (step_y < 0)) - y0) * inv_y)
        last = min(last, (np.float32(j + (step_y > 0)) - y0) * inv_y)
    a, b = ddx[j, i], ddy[j, i]
    # Height of the ray in front of the plane, linear in s: h(s) = h0 + s * hs.
    h0 = z0 - (centre + a * (x0 - np.float32(i) - HALF) + b * (y0 - np.float32(j) - HALF))
    hs = dz - (a * dx + b * dy)
    in_front = h0 + first * hs
    behind = h0 + last * hs
    if in_front < F0 or behind > F0 or last < first:
        return np.float32(-1.0)
    if in_front == behind:
        return first
    return first + (last - first) * (in_front / (in_front - behind))


def paper_ray(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level):
    """March one ray, as `driver.march_ray`."""
    cells, offsets, pitches = pyramid
    x, y, z0 = np.float32(ray.x), np.float32(ray.y), np.float32(ray.depth)
    dx, dy, dz = np.float32(ray.dx), np.float32(ray.dy), np.float32(ray.dz)
    s_end = np.float32(ray.s_end)
    height, width = buffers.depth.shape
    top = offsets.shape[0] - 1
    inv_x, bias_x, step_x, far_x = axis(dx)
    inv_y, bias_y, step_y, far_y = axis(dy)
    cx = clamp(int(x), 0, width - 1)
    cy = clamp(int(y), 0, height - 1)
    s = F0
    level = 0
    steps = 0
    from_x = False  # the ray entered the current pixel through a vertical edge
    # A ray on the visible surface of its own pixel leaves that pixel unread: the surface would
    # only be compared with itself.
    skip = cx == own_x and cy == own_y
    while True:
        blocked = False
        for _ in range(numbers.samples):
            lx, ly = cx >> level, cy >> level
            edge_x, edge_y = (lx + far_x) << level, (ly + far_y) << level
            sx = edge_s(edge_x, x, inv_x, bias_x)
            sy = edge_s(edge_y, y, inv_y, bias_y)
            s_exit = min(min(sx, sy), s_end)
            if skip:
                skip = False
            else:
                if steps == numbers.max_steps:
                    return EXHAUSTED, False, -1, -1, F0, s, steps
                steps += 1
                steps_by_level[level] += 1
                nearest = cells[offsets[level] + ly * pitches[level] + lx]
                farthest_ray = z0 + dz * (s_exit if dz < F0 else s)
                if nearest > F0 and not farthest_ray > nearest:
                    blocked = True
                    break
            if s_exit > s:
                s = s_exit
            if s_exit >= s_end:
                return ray.status, False, -1, -1, F0, s_end, steps
            from_x = sx < sy
            cx, cy = next_cell(
                cx, cy, lx, ly, level, edge_x, edge_y, sx, sy, s, x, y, dx, dy, step_x, step_y
            )
            if cx < 0 or cy < 0 or cx >= width or cy >= height:
                return OFFSCREEN, False, -1, -1, F0, s, steps
        if not blocked:
            if level < top:
                level += 1
        elif level > 0:
            level -= 1
        else:
            break
    hit_x, hit_y = cx, cy
    line = x, y, z0, dx, dy, dz
    axes = inv_x, inv_y, step_x, step_y
    hit = tilted_plane_s(hit_x, hit_y, buffers, line, axes, F0, s_end)
    if hit < F0 and s > F0:
        if from_x:
            hit_x -= step_x
        else:
            hit_y -= step_y
        if not (hit_x == own_x and hit_y == own_y):
            hit = tilted_plane_s(hit_x, hit_y, buffers, line, axes, F0, s_end)
    if hit < F0:
        return HIDDEN, False, -1, -1, F0, s, steps
    return HIT, True, hit_x, hit_y, hit, min(s, hit), steps
