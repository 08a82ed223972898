"""Build the pyramid of planes that mode "slope" marches through."""

from __future__ import annotations

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.kernels import slope_pyramid as kernels
from hybrid_rt.pyramid import layout
from hybrid_rt.types import GBuffer, SlopePyramid


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
        kernels.build(gbuffer.depth, gbuffer.ddx, gbuffer.ddy, *levels, data)
    return SlopePyramid(data, *levels)
