"""Primary rays: one through the centre of every pixel of a camera."""

from __future__ import annotations

from typing import Literal

import numpy as np

from hybrid_rt import _check
from hybrid_rt.camera.camera import Camera
from hybrid_rt.kernels.arrays import I32
from hybrid_rt.rays.rays import Rays

TILE = 32
"""Pixels along a side."""


def primary_rays(camera: Camera, *, order: Literal["rows", "tiles"] = "rows") -> Rays:
    """Return one ray through the centre of every pixel.

    Parameters
    ----------
    camera : Camera
        H by W pixels.
    order : {"rows", "tiles"}
        "rows": row by row from the top, so that what a tracer says is an image after
        ``.reshape(H, W)``. "tiles": in tiles of 32 by 32 pixels and Morton order inside a tile, as
        secondary rays are, so that neighbours in the array are neighbours on the screen, which
        packets gain from.

    Returns
    -------
    Rays
        ``H * W`` rays; directions have a component of 1 along the view. Those of a pinhole camera
        start in the eye, so that t is z_view; `t_near` is the camera's near plane, `t_far`
        infinite. Those of an orthographic camera start on its near plane and end on its far plane,
        so that t is z_view - near. They start on no visible surface: `pixel` is (-1, -1).

    Raises
    ------
    ArgumentError
        Not a camera, or an unknown order.
    """
    _check.instance("camera", camera, Camera)
    _check.choice("order", order, ("rows", "tiles"))
    in_order = _tile_order if order == "tiles" else _row_order
    pixel = in_order(camera.width, camera.height)
    with np.errstate(over="ignore"):  # a view of nearly 180 degrees: infinite, hence invalid rays
        origin, direction, start, end = camera.primary(pixel[:, 0] + 0.5, pixel[:, 1] + 0.5)
        origin, direction = origin.astype(np.float32), direction.astype(np.float32)
    t_near, t_far = (np.full(len(pixel), t, np.float32) for t in (start, end))
    return Rays.from_arrays(origin, direction, None, t_near, t_far)


def _row_order(width: int, height: int) -> I32:
    y, x = np.divmod(np.arange(width * height, dtype=np.int32), np.int32(width))
    return np.stack([x, y], axis=1)


def _tile_order(width: int, height: int) -> I32:
    code = np.arange(TILE * TILE)
    bits = range(TILE.bit_length() - 1)
    dx = sum(((code >> (2 * b)) & 1) << b for b in bits)
    dy = sum(((code >> (2 * b + 1)) & 1) << b for b in bits)
    tiles = np.arange(-(-width // TILE) * -(-height // TILE))
    x = (tiles % -(-width // TILE) * TILE)[:, None] + dx
    y = (tiles // -(-width // TILE) * TILE)[:, None] + dy
    inside = (x < width) & (y < height)
    return np.stack([x[inside], y[inside]], axis=1).astype(np.int32)
