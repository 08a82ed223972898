"""Bound tilted pixels by planes, level by level."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import kernel, parallel_kernel


@kernel
def least_offset(data, children, count, side, slope_x, slope_y):
    """Return the least value at the parent's centre of a plane of a slope that bounds its children.

    The first `count` rows of children (4, 3) float64 are a row of data and the offset of the
    child's centre from the parent's; `side` is the length of the child's square, in pixels. Over
    |u|, |v| <= side / 2 around the child's centre,
    ``A + sx (ox + u) + sy (oy + v) >= a + bx u + by v`` asks for
    ``A >= a - sx ox - sy oy + (|bx - sx| + |by - sy|) side / 2``.
    """
    least = -math.inf
    for k in range(count):
        row = int(children[k, 0])
        a, bx, by = np.float64(data[row, 0]), np.float64(data[row, 1]), np.float64(data[row, 2])
        reach = (abs(bx - slope_x) + abs(by - slope_y)) * 0.5 * side
        least = max(least, a - slope_x * children[k, 1] - slope_y * children[k, 2] + reach)
    return least


@kernel
def bound_cell(data, target, children, count, side):
    """Write row `target` of data: a plane in front of `count` children, as in `least_offset`."""
    if count == 0:
        data[target, 0] = -np.inf
        data[target, 1] = 0.0
        data[target, 2] = 0.0
        return
    mean_x, mean_y = 0.0, 0.0
    for k in range(count):
        row = int(children[k, 0])
        mean_x += np.float64(data[row, 1]) / count
        mean_y += np.float64(data[row, 2]) / count
    # The offset must bound with the slope as it is stored.
    slope_x, slope_y = np.float32(mean_x), np.float32(mean_y)
    tilted = least_offset(data, children, count, side, np.float64(slope_x), np.float64(slope_y))
    flat = least_offset(data, children, count, side, 0.0, 0.0)
    if tilted < flat:
        data[target, 0] = np.nextafter(np.float32(tilted), np.float32(np.inf))
        data[target, 1] = slope_x
        data[target, 2] = slope_y
    else:
        data[target, 0] = np.nextafter(np.float32(flat), np.float32(np.inf))
        data[target, 1] = 0.0
        data[target, 2] = 0.0


@kernel
def bound_row(data, y, source, width, height, target, wide, side):
    """Make row y of the level at `target` from the level (height, width) at `source`."""
    children = np.empty((4, 3))
    for x in range(wide):
        count = 0
        for j in range(2 * y, min(2 * y + 2, height)):
            for i in range(2 * x, min(2 * x + 2, width)):
                row = source + j * width + i
                if data[row, 0] > -np.inf:
                    children[count, 0] = row
                    children[count, 1] = (i - 2 * x - 0.5) * side
                    children[count, 2] = (j - 2 * y - 0.5) * side
                    count += 1
        bound_cell(data, target + y * wide + x, children, count, side)


@parallel_kernel
def build(depth, ddx, ddy, offsets, widths, heights, data):
    """Fill data (cells, 3) float32 with all levels of depth, ddx, ddy (H, W) float32.

    offsets, widths, heights (L,) int64.
    """
    height, width = depth.shape
    for y in prange(height):
        for x in range(width):
            row = y * width + x
            seen = depth[y, x] > 0.0
            data[row, 0] = depth[y, x] if seen else -np.inf
            data[row, 1] = ddx[y, x] if seen else 0.0
            data[row, 2] = ddy[y, x] if seen else 0.0
    for level in range(1, len(offsets)):
        for y in prange(heights[level]):
            bound_row(
                data, y, offsets[level - 1], widths[level - 1], heights[level - 1],
                offsets[level], widths[level], float(1 << (level - 1)),
            )  # fmt: skip
