"""Build the depth pyramid of a view."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt._arrays import F32, I64
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.raster import pyramid as kernels
from hybrid_rt.raster.gbuffer import GBuffer


@dataclass(frozen=True, eq=False)
class DepthPyramid:
    """Nearest depth of 1, 4, 16 ... pixels; level 0 is the depth buffer itself.

    Level l has ``ceil(W / 2**l)`` by ``ceil(H / 2**l)`` cells and ends at 1 by 1, so the cell of a
    pixel is always ``(x >> l, y >> l)``.

    Attributes
    ----------
    data : (cells,) float32
        All levels, row by row, each padded to powers of two; see `hybrid_rt.raster.pyramid.layout`.
    offsets : (L,) int64
        Index of the first cell of each level in `data`.
    pitches : (L,) int64
        Cells from the start of a row of a level to the start of the next.
    widths, heights : (L,) int64
        Cells of a level without its padding.
    conservative : bool
        Whether the depths are those of pixel squares (the first bounds of `PrimitiveLists`) and
        not those of pixel centres.
    """

    data: F32
    offsets: I64
    pitches: I64
    widths: I64
    heights: I64
    conservative: bool = False

    def __len__(self) -> int:
        return len(self.offsets)

    def level(self, index: int) -> F32:
        """Return level `index` as a (height, width) view of `data`."""
        n = _check.integer("index", index, least=0, most=len(self) - 1)
        return level_of(self, n)


def build_depth_pyramid(
    gbuffer: GBuffer, *, conservative: bool = False, threads: int | None = None
) -> DepthPyramid:
    """Return the nearest depth of every 1, 4, 16 ... pixels, up to one cell for the whole image.

    Parameters
    ----------
    gbuffer : GBuffer
    conservative : bool
        Of the nearest depth anywhere in a pixel's square, from the G-buffer's lists, which mode
        "certified" needs, instead of the depth at its centre. It has the size of the lists.
    threads : int, optional
        Default: as many as Numba is set to.

    Returns
    -------
    DepthPyramid
        Each level halves both axes and rounds up, so that an odd last row or column is kept. A cell
        without any surface is 0.

    Raises
    ------
    ArgumentError
        `gbuffer` is not a GBuffer, or has no lists for a conservative pyramid; `threads` is out of
        range.

    Notes
    -----
    Nearest is the largest depth. The input is never written. The result has the same bits for any
    number of threads.

    References
    ----------
    Pikulsky, "Ray Tracing Algorithm Based on Screen Space Ray Marching" (2025), inputs. The paper
    stops at floor(log2(min(W, H))) levels above the first; here all of them are built.
    """
    _check.instance("gbuffer", gbuffer, GBuffer)
    depth = gbuffer.depth
    if conservative:
        if gbuffer.lists is None:
            raise ArgumentError(
                "gbuffer", "one with lists, from rasterize(..., lists=8)", "one without"
            )
        depth = np.ascontiguousarray(gbuffer.lists.nearest[:, :, 0])
    height, width = depth.shape
    cells, levels = layout(width, height)
    data = np.empty(cells, np.float32)
    with _threads.limited(threads):
        kernels.build(depth, *levels, data)
    return DepthPyramid(data, *levels, conservative)


def bits(width: int, height: int) -> tuple[int, int]:
    """Return the least (a, b) with width <= 2**a and height <= 2**b."""
    return (width - 1).bit_length(), (height - 1).bit_length()


def layout(width: int, height: int) -> tuple[int, tuple[I64, I64, I64, I64]]:
    """Return how many cells to make room for and where the levels of a pyramid lie.

    The levels are given by their offsets, pitches, widths and heights, (L,) int64 each. A level is
    padded to powers of two and begins at its own size, so that what is left below holds all coarser
    levels, and a kernel can compute a cell's place from the level alone:
    ``2**(a + b - 2 l) + (y << (a - l)) + x``, with a, b = `bits`, up to the level l = min(a, b) at
    which the shorter axis is one cell. The padding is never written: the cell of a pixel of the
    image is never in it, and no march looks up a cell before it knows that its pixel is one.
    """
    a, b = bits(width, height)
    level = np.arange(max(a, b) + 1)
    columns, rows = np.maximum(a - level, 0), np.maximum(b - level, 0)
    widths, heights = -(-width >> level), -(-height >> level)
    offsets, pitches = 1 << (columns + rows), 1 << columns
    return int(offsets[0] + pitches[0] * height), (offsets, pitches, widths, heights)


def level_of(pyramid: Any, n: int) -> F32:
    """Return level n, (height, width, ...), as a view without its padding."""
    start, pitch = int(pyramid.offsets[n]), int(pyramid.pitches[n])
    height, width = int(pyramid.heights[n]), int(pyramid.widths[n])
    rows = pyramid.data[start : start + height * pitch]
    return np.asarray(rows.reshape(height, pitch, *pyramid.data.shape[1:])[:, :width])
