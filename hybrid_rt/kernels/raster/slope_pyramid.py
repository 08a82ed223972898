"""Bound tilted pixels by planes, level by level."""

from __future__ import annotations

import math

import numpy as np

from hybrid_rt.kernels._jit import called, inlined, parallel_kernel
from hybrid_rt.kernels._queue import part


@inlined
def least_offset(a, bx, by, out_x, out_y, half, slope_x, slope_y):
    """Return the least value at a parent's centre of a plane of a slope that bounds one child.

    The child's plane is a, bx, by at its centre, (out_x, out_y) from the parent's, and `half` is
    half the side of its square. Over |u|, |v| <= half around the child's centre,
    ``A + sx (out_x + u) + sy (out_y + v) >= a + bx u + by v`` asks for
    ``A >= a - sx out_x - sy out_y + (|bx - sx| + |by - sy|) half``.
    """
    return a - slope_x * out_x - slope_y * out_y + (abs(bx - slope_x) + abs(by - slope_y)) * half


@called
def bound_row(data, y, source, pitch, width, height, target, wide_pitch, wide, side):
    """Make row y of the level at `target` from the level (height, width) at `source`.

    Rows lie `pitch` and `wide_pitch` cells apart. `side` is the length of a child's square in
    pixels. An empty child is a plane at minus infinity and asks for nothing.
    """
    half = 0.5 * side
    end_y = min(2 * y + 2, height)
    for x in range(wide):
        end_x = min(2 * x + 2, width)
        count, mean_x, mean_y = 0, 0.0, 0.0
        for j in range(2 * y, end_y):
            for i in range(2 * x, end_x):
                row = source + j * pitch + i
                count += data[row, 0] > -np.inf
                mean_x += np.float64(data[row, 1])
                mean_y += np.float64(data[row, 2])
        # The offset must bound with the slope as it is stored.
        slope_x, slope_y = np.float32(0.0), np.float32(0.0)
        if count > 0:
            slope_x, slope_y = np.float32(mean_x / count), np.float32(mean_y / count)
        tilted, flat = -math.inf, -math.inf
        for j in range(2 * y, end_y):
            for i in range(2 * x, end_x):
                row = source + j * pitch + i
                a = np.float64(data[row, 0])
                bx, by = np.float64(data[row, 1]), np.float64(data[row, 2])
                out_x, out_y = (i - 2 * x - 0.5) * side, (j - 2 * y - 0.5) * side
                sx, sy = np.float64(slope_x), np.float64(slope_y)
                tilted = max(tilted, least_offset(a, bx, by, out_x, out_y, half, sx, sy))
                flat = max(flat, least_offset(a, bx, by, out_x, out_y, half, 0.0, 0.0))
        cell = target + y * wide_pitch + x
        if tilted < flat:
            data[cell, 0] = rounded_up(tilted)
            data[cell, 1] = slope_x
            data[cell, 2] = slope_y
        else:
            data[cell, 0] = rounded_up(flat)
            data[cell, 1] = 0.0
            data[cell, 2] = 0.0


@inlined
def rounded_up(value):
    """Return a float32 that is not less than a float64, minus infinity for itself."""
    nearest = np.float32(value)
    if nearest >= value:
        return nearest
    return np.nextafter(nearest, np.float32(np.inf))


@parallel_kernel
def copy(share, depth, ddx, ddy, offsets, pitches, data):
    """Fill the first level of data (cells, 3) float32 with depth, ddx, ddy (H, W) float32.

    offsets, pitches (L,) int64.
    """
    height, width = depth.shape
    for y in part(share, height):
        for x in range(width):
            row = offsets[0] + y * pitches[0] + x
            seen = depth[y, x] > 0.0
            data[row, 0] = depth[y, x] if seen else -np.inf
            data[row, 1] = ddx[y, x] if seen else 0.0
            data[row, 2] = ddy[y, x] if seen else 0.0


@parallel_kernel
def bound(share, level, offsets, pitches, widths, heights, data):
    """Make a level of data (cells, 3) float32 from the one below it; the others are (L,) int64."""
    for y in part(share, heights[level]):
        bound_row(
            data, y, offsets[level - 1], pitches[level - 1], widths[level - 1],
            heights[level - 1], offsets[level], pitches[level], widths[level],
            float(1 << (level - 1)),
        )  # fmt: skip
