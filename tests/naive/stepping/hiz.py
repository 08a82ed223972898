"""The hierarchical-Z march with a confidence, as AMD documents it, one ray at a time."""

from __future__ import annotations

import numpy as np

from naive.stepping.compiled import inlined
from naive.stepping.screen import (
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
)


@inlined
def within_cell(place, coarse, level, now, step):
    """Return the pixel of a coordinate in a cell, not behind the pixel that the ray came from."""
    low = now if step > 0 else coarse << level
    high = now if step < 0 else ((coarse + 1) << level) - 1
    return clamp(int(place), low, high)


@inlined
def stop_of(
    status, x, y, z0, dx, dy, dz, s_end, own_x, own_y, width, height,
    cells, offsets, pitches, max_steps, steps_by_level,
):  # fmt: skip
    """Return (status, pixel x, pixel y, s, samples) of where a ray stops.

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
def faces_ray(i, j, depth, ddx, ddy, x0, y0, z0, dx, dy, dz, parallel):
    """Return whether the plane of pixel (i, j) is seen from the side that the ray comes from.

    In homogeneous screen space the plane is ``q_d - (a q_x + b q_y + c q_w) = 0``, positive towards
    the viewer. Along the ray of a pinhole, where q_d = near, it falls if
    ``a dx + b dy - dz (c + a x0 + b y0) / z0 > 0``; of parallel lines of sight, where q_w = 1, if
    ``a dx + b dy - dz > 0``.
    """
    a, b = ddx[j, i], ddy[j, i]
    if parallel:
        return a * dx + b * dy > dz
    plane = depth[j, i] + a * (x0 - np.float32(i) - HALF) + b * (y0 - np.float32(j) - HALF)
    return z0 * (a * dx + b * dy) > dz * plane


@inlined
def confidence(
    i, j, s, depth, ddx, ddy, x0, y0, z0, dx, dy, dz, unit, parallel, thickness, margin
):  # fmt: skip
    """Return how far a stop at s in pixel (i, j) is to be trusted, 0 to 1; `margin` in pixels."""
    height, width = depth.shape
    ray, surface = z0 + dz * s, depth[j, i]
    if ray <= F0 or surface <= F0:
        return F0
    if not faces_ray(i, j, depth, ddx, ddy, x0, y0, z0, dx, dy, dz, parallel):
        return F0
    apart = abs(ray - surface) * unit if parallel else abs(unit / ray - unit / surface)
    vignette = fade(x0 + dx * s, width, margin) * fade(y0 + dy * s, height, margin)
    return (F1 - smoothstep(apart / thickness)) * vignette


def hiz_ray(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level):
    """March one ray, as `driver.march_ray`."""
    depth, ddx, ddy, _ = buffers
    height, width = depth.shape
    x0, y0, z0 = np.float32(ray.x), np.float32(ray.y), np.float32(ray.depth)
    dx, dy, dz = np.float32(ray.dx), np.float32(ray.dy), np.float32(ray.dz)
    how, at_x, at_y, s, count = stop_of(
        ray.status, x0, y0, z0, dx, dy, dz, np.float32(ray.s_end), own_x, own_y, width, height,
        pyramid.cells, pyramid.offsets, pyramid.pitches, numbers.max_steps, steps_by_level,
    )  # fmt: skip
    judged = how == HIT or (how == EXHAUSTED and numbers.exhausted_hits)
    if (judged or how == MISS) and depth[at_y, at_x] <= F0:
        return how, not numbers.trace_background, -1, -1, s, s, count
    if not judged:
        return how, False, -1, -1, s, s, count
    trust = confidence(
        at_x, at_y, s, depth, ddx, ddy, x0, y0, z0, dx, dy, dz, np.float32(numbers.unit),
        numbers.parallel, np.float32(numbers.thickness), np.float32(numbers.border * height),
    )  # fmt: skip
    if numbers.threshold <= trust:
        return how, True, at_x, at_y, s, s, count
    return (HIDDEN if how == HIT else how), False, -1, -1, s, s, count
