"""Build the depth pyramid of a view."""

from __future__ import annotations

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels import pyramid as kernels
from hybrid_rt.types import DepthPyramid, GBuffer


def build_depth_pyramid(
    gbuffer: GBuffer, *, conservative: bool = False, threads: int | None = None
) -> DepthPyramid:
    """Return the nearest depth of every 1, 4, 16 ... pixels, up to one cell for the whole image.

    Parameters
    ----------
    gbuffer : GBuffer
    conservative : bool
        Of the nearest depth anywhere in a pixel's square, from the G-buffer's lists, which mode
        "certified" needs, instead of the depth at its centre.
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
    sizes = [(width, height)]
    while sizes[-1] != (1, 1):
        w, h = sizes[-1]
        sizes.append((-(-w // 2), -(-h // 2)))
    widths, heights = np.array(sizes, np.int64).T.copy()
    cells = widths * heights
    offsets = np.cumsum(cells) - cells
    data = np.empty(int(cells.sum()), np.float32)
    with _threads.limited(threads):
        kernels.build(depth, offsets, widths, heights, data)
    return DepthPyramid(data, offsets, widths, heights, conservative)
