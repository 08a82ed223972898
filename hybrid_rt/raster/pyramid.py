"""Depth pyramids: the nearest depth of 1, 4, 16 ... pixels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt._record import Record
from hybrid_rt.camera.camera import LARGEST_SIDE
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F32, I64, PyramidArrays
from hybrid_rt.kernels.raster import pyramid as kernels
from hybrid_rt.raster.gbuffer import GBuffer

Levels = tuple[I64, I64, I64, I64]
"""Offsets, pitches, widths and heights of all levels, (L,) int64 each."""


class Pyramid(Record):
    """What pyramids are alike in: levels of cells over an image of `width` by `height` pixels.

    Level l has ``ceil(W / 2**l)`` by ``ceil(H / 2**l)`` cells and ends at 1 by 1, so the cell of a
    pixel is always ``(x >> l, y >> l)``.
    """

    data: F32
    width: int
    height: int
    _values: tuple[int, ...] = ()  # numbers of a cell, as a shape

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            value = _check.integer(name, getattr(self, name), least=1, most=LARGEST_SIDE)
            object.__setattr__(self, name, value)
        cells, _ = layout(self.width, self.height)
        data = _check.owned("data", self.data, ("C", *self._values), np.float32)
        if len(data) != cells:
            expected = f"{cells} cells, as many as {self.width} by {self.height} pixels have"
            raise ArgumentError("data", expected, f"{len(data)}")
        self._own(Cells(data))

    @cached_property
    def _levels(self) -> Levels:
        return layout(self.width, self.height)[1]

    @property
    def arrays(self) -> PyramidArrays:
        """Cells, offsets and pitches, as kernels take them."""
        return PyramidArrays(self._arrays.data, self._levels[0], self._levels[1])

    def __len__(self) -> int:
        return len(self._levels[0])

    @property
    def nbytes(self) -> int:
        """Bytes of all cells."""
        return int(self.data.nbytes)

    def level(self, index: int) -> F32:
        """Return level `index` as a (height, width, ...) view of `data`, without its padding."""
        n = _check.integer("index", index, least=0, most=len(self) - 1)
        start, pitch, width, height = (int(values[n]) for values in self._levels)
        rows = self.data[start : start + height * pitch]
        return np.asarray(rows.reshape(height, pitch, *self._values)[:, :width])


@dataclass(frozen=True, eq=False)
class DepthPyramid(Pyramid):
    """Nearest depth of 1, 4, 16 ... pixels; level 0 is the depth buffer itself.

    Attributes
    ----------
    data : (C,) float32
        The cells of all levels, row by row, each level padded to powers of two; see `layout`.
    width, height : int
        Pixels of the image.

    Raises
    ------
    ArgumentError
        Another number of cells than the image has.
    """

    data: F32
    width: int
    height: int


def build_depth_pyramid(gbuffer: GBuffer, *, threads: int | None = None) -> DepthPyramid:
    """Return the nearest depth of every 1, 4, 16 ... pixels, up to one cell for the whole image.

    Parameters
    ----------
    gbuffer : GBuffer
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
        `gbuffer` is not a GBuffer; `threads` is out of range.

    Notes
    -----
    Nearest is the largest depth. The result has the same bits for any number of threads.

    References
    ----------
    Pikulsky, "Ray Tracing Algorithm Based on Screen Space Ray Marching" (2025), inputs. The paper
    stops at floor(log2(min(W, H))) levels above the first; here all of them are built.
    """
    _check.instance("gbuffer", gbuffer, GBuffer)
    return pyramid_of(gbuffer.arrays.depth, threads)


def pyramid_of(depth: F32, threads: int | None) -> DepthPyramid:
    """Return the pyramid of depths (H, W) float32, C-contiguous."""
    height, width = depth.shape
    cells, levels = layout(width, height)
    data = np.empty(cells, np.float32)
    with _threads.limited(threads):
        kernels.build(depth, *levels, data)
        kernels.finish(*levels, data)
    return DepthPyramid._made(Cells(data), width=width, height=height)


class Cells(NamedTuple):
    """The one array of a pyramid that is its own."""

    data: F32


def bits(width: int, height: int) -> tuple[int, int]:
    """Return the least (a, b) with width <= 2**a and height <= 2**b."""
    return (width - 1).bit_length(), (height - 1).bit_length()


def layout(width: int, height: int) -> tuple[int, Levels]:
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
