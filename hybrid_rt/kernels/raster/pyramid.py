"""Reduce a depth image to its pyramid of nearest depths."""

from __future__ import annotations

from hybrid_rt.kernels._jit import called, kernel, parallel_kernel
from hybrid_rt.kernels._queue import part

BAND_LEVELS = 4
"""Levels that one band of rows makes on its own: 16 rows of 1920 pixels fit the L2 cache."""


@called
def reduce_rows(data, source, pitch, width, height, target, wide_pitch, first, last):
    """Make rows first..last-1 of a level at `target` from the level (height, width) at `source`.

    Both are offsets into data (cells,) float32, with rows `pitch` and `wide_pitch` apart. A child
    beyond the last row or column stands for the last one.
    """
    half = width >> 1
    wide = (width + 1) >> 1
    for y in range(first, last):
        above, below = source + 2 * y * pitch, source + min(2 * y + 1, height - 1) * pitch
        upper, lower = data[above : above + width], data[below : below + width]
        cells = data[target + y * wide_pitch : target + y * wide_pitch + wide]
        for x in range(half):
            left = max(upper[2 * x], lower[2 * x])
            right = max(upper[2 * x + 1], lower[2 * x + 1])
            cells[x] = max(left, right)
        if wide > half:
            cells[half] = max(upper[width - 1], lower[width - 1])


@parallel_kernel
def build(share, depth, offsets, pitches, widths, heights, data):
    """Fill data (cells,) float32 with the lower levels of depth (H, W) float32; level 0 is a copy.

    offsets, pitches, widths, heights (L,) int64. Each band of rows goes up as far as it stays whole
    while it is in the cache; `finish` makes what is left above.
    """
    levels = len(offsets)
    low = min(BAND_LEVELS, levels - 1)
    rows = 1 << low
    height, width = depth.shape
    for band in part(share, heights[low]):
        begin = band * rows
        end = min(begin + rows, height)
        for y in range(begin, end):
            start = offsets[0] + y * pitches[0]
            for x in range(width):  # an assignment of slices would compile what it raises
                data[start + x] = depth[y, x]
        for level in range(1, low + 1):
            first = begin >> level
            last = min((band + 1) * (rows >> level), heights[level])
            reduce_rows(
                data,
                offsets[level - 1],
                pitches[level - 1],
                widths[level - 1],
                heights[level - 1],
                offsets[level],
                pitches[level],
                first,
                last,
            )


@kernel
def finish(offsets, pitches, widths, heights, data):
    """Fill data (cells,) float32 with the levels that `build` has left, which are small."""
    for level in range(BAND_LEVELS + 1, len(offsets)):
        reduce_rows(
            data,
            offsets[level - 1],
            pitches[level - 1],
            widths[level - 1],
            heights[level - 1],
            offsets[level],
            pitches[level],
            0,
            heights[level],
        )
