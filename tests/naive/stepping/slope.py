"""The paper's march over planes that bound tilted pixels, one ray at a time."""

from __future__ import annotations

import numpy as np

from naive.stepping.compiled import inlined
from naive.stepping.screen import (
    EXHAUSTED,
    F0,
    HIDDEN,
    HIT,
    OFFSCREEN,
    axis,
    clamp,
    edge_s,
    next_cell,
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


def slope_ray(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level):
    """March one ray through planes (C, 3), as `driver.march_ray`."""
    data, offsets, pitches = pyramid
    height, width = buffers.prim_id.shape
    x, y, z0 = np.float32(ray.x), np.float32(ray.y), np.float32(ray.depth)
    dx, dy, dz = np.float32(ray.dx), np.float32(ray.dy), np.float32(ray.dz)
    s_end = np.float32(ray.s_end)
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
        for _ in range(numbers.samples):
            lx, ly = cx >> level, cy >> level
            edge_x, edge_y = (lx + far_x) << level, (ly + far_y) << level
            sx = edge_s(edge_x, x, inv_x, bias_x)
            sy = edge_s(edge_y, y, inv_y, bias_y)
            s_exit = max(s, min(min(sx, sy), s_end))
            if skip:
                skip = False
            else:
                if steps == numbers.max_steps:
                    return EXHAUSTED, False, -1, -1, F0, s, steps
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
                        return HIDDEN, False, -1, -1, F0, s, steps
                    entry = max(entry, F0)
                    span = s_exit - s
                    hit = s + span * (entry / (entry - leave)) if entry > leave else s
                    return HIT, True, cx, cy, hit, hit, steps
            s = s_exit
            if s >= s_end:
                return ray.status, False, -1, -1, F0, s_end, steps
            cx, cy = next_cell(
                cx, cy, lx, ly, level, edge_x, edge_y, sx, sy, s, x, y, dx, dy, step_x, step_y
            )
            if cx < 0 or cy < 0 or cx >= width or cy >= height:
                return OFFSCREEN, False, -1, -1, F0, s, steps
        if blocked:
            level -= 1
        elif level < top:
            level += 1
