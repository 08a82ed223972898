"""Triangles in the planes of pixels, for surfaces whose own triangles are not known."""

from __future__ import annotations

from typing import Any

import numpy as np

from hybrid_rt.camera.camera import Camera, unproject
from hybrid_rt.kernels.arrays import F32, F64, I32, Bool, GBufferArrays

WIDEST = 8.0
"""Pixels from a triangle's corner to its pixel, along each axis: wide enough for float32."""
LEAST_DEPTH = 0.5
"""Share of the pixel's depth that a corner keeps: the plane may run to the horizon."""


def triangles(camera: Camera, images: GBufferArrays, y: Any, x: Any) -> F64:
    """Return one triangle in the plane of each pixel (x, y), around it: (N, 3, 3) float64, world.

    The winding is counter-clockwise as seen from the eye.
    """
    depth, ddx, ddy = (image[y, x].astype(np.float64) for image in images[:3])
    steep = np.abs(ddx) + np.abs(ddy)
    with np.errstate(divide="ignore"):
        reach = np.minimum(WIDEST, (1.0 - LEAST_DEPTH) * depth / steep)
    corners = []
    for right, down in ((-1, 1), (1, 1), (-1, -1)):
        place = x + 0.5 + right * reach, y + 0.5 + down * reach
        tilted = depth + reach * (right * ddx + down * ddy)
        corners.append(unproject(camera, np.stack([*place, tilted], axis=1)))
    return np.stack(corners, axis=1)


def soup(camera: Camera, images: GBufferArrays) -> tuple[I32, F32, I32]:
    """Return those triangles of all covered pixels as a mesh, and which of them each pixel has.

    Returns
    -------
    prim_id : (H, W) int32
        -1 where nothing is visible.
    vertices : (3 N, 3) float32, world
    faces : (N, 3) int32
    """
    covered: Bool = images.prim_id >= 0
    y, x = np.nonzero(covered)
    prim_id = np.full(covered.shape, -1, np.int32)
    prim_id[covered] = np.arange(len(x), dtype=np.int32)
    vertices = triangles(camera, images, y, x).reshape(-1, 3).astype(np.float32)
    return prim_id, vertices, np.arange(3 * len(x), dtype=np.int32).reshape(-1, 3)
