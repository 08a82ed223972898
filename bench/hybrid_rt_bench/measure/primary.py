"""Primary rays of a camera, for the comparison of the raster with Embree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt

TILE = 32


def primary_rays(camera: hrt.Camera) -> hrt.Rays:
    """Return one ray through the centre of every pixel, in tiles of 32 by 32 and Morton order.

    Neighbours in the array are neighbours on the screen, as they are for mirror rays: a fair order
    for packets. Directions have a component of 1 along the view, so that t is z_view and `t_near`
    is the camera's near plane.

    Returns
    -------
    Rays
        ``width * height`` rays; `pixel` says through which pixel each goes.
    """
    pixel = _tile_order(camera.width, camera.height)
    x = (pixel[:, 0] + 0.5 - 0.5 * camera.width) / camera.focal_px
    y = (0.5 * camera.height - pixel[:, 1] - 0.5) / camera.focal_px
    direction = np.asarray(
        np.array(camera.forward)
        + x[:, None] * np.array(camera.right)
        + y[:, None] * np.array(camera.up),
        np.float32,
    )
    origin = np.empty_like(direction)
    origin[:] = camera.eye
    t_near = np.full(len(pixel), camera.near, np.float32)
    return hrt.Rays.from_arrays(origin, direction, None, t_near)


def _tile_order(width: int, height: int) -> NDArray[np.int32]:
    code = np.arange(TILE * TILE)
    bits = range(TILE.bit_length() - 1)
    dx = sum(((code >> (2 * b)) & 1) << b for b in bits)
    dy = sum(((code >> (2 * b + 1)) & 1) << b for b in bits)
    tiles = np.arange(-(-width // TILE) * -(-height // TILE))
    x = (tiles % -(-width // TILE) * TILE)[:, None] + dx
    y = (tiles // -(-width // TILE) * TILE)[:, None] + dy
    inside = (x < width) & (y < height)
    return np.stack([x[inside], y[inside]], axis=1).astype(np.int32)
