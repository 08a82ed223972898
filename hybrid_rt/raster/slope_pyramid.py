"""Pyramids of planes in front of tilted pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.kernels.arrays import F32
from hybrid_rt.kernels.raster import slope_pyramid as kernels
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.pyramid import Cells, Pyramid, layout


@dataclass(frozen=True, eq=False)
class SlopePyramid(Pyramid):
    """For 1, 4, 16 ... pixels, a plane in front of all their tilted planes; as a DepthPyramid lies.

    The plane of cell (i, j) of level l is ``a + b_x (x - x_c) + b_y (y - y_c)`` with the cell's
    centre ``x_c = (i + 1/2) 2**l``, ``y_c = (j + 1/2) 2**l``. Over the square of each pixel in the
    cell it is nowhere farther than that pixel's own plane; level 0 is those planes. Where nothing
    is visible in the whole cell, a is minus infinity and the slopes are 0.

    Attributes
    ----------
    data : (C, 3) float32
        a, b_x, b_y, in depth and depth a pixel; the levels lie as in a DepthPyramid.
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
    _values = (3,)


def build_slope_pyramid(gbuffer: GBuffer, *, threads: int | None = None) -> SlopePyramid:
    """Return, for every 1, 4, 16 ... pixels, a plane in front of all their tilted planes.

    Parameters
    ----------
    gbuffer : GBuffer
    threads : int, optional
        Default: as many as Numba is set to.

    Returns
    -------
    SlopePyramid
        Of the same levels as `build_depth_pyramid`.

    Raises
    ------
    ArgumentError
        `gbuffer` is not a GBuffer, `threads` is out of range.

    Notes
    -----
    A cell takes the mean slope of its children or, where that lies no lower at the cell's centre,
    no slope; then the least offset that keeps all children behind over their whole squares. That
    offset is computed in float64 and rounded to float32 towards the viewer, so the bound holds to
    float64's precision for the planes as they are stored.

    The input is never written. The result has the same bits for any number of threads.
    """
    _check.instance("gbuffer", gbuffer, GBuffer)
    height, width = gbuffer.depth.shape
    cells, levels = layout(width, height)
    data = np.empty((cells, 3), np.float32)
    with _threads.limited(threads):
        kernels.copy(*gbuffer.arrays[:3], *levels[:2], data)
        for level in range(1, len(levels[0])):
            kernels.bound(level, *levels, data)
    return SlopePyramid._made(Cells(data), width=width, height=height)
