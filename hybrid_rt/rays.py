"""Secondary rays from a G-buffer."""

from __future__ import annotations

import numpy as np

from hybrid_rt import _check
from hybrid_rt.kernels import rays as kernels
from hybrid_rt.types import GBuffer, Rays


def mirror_rays(gbuffer: GBuffer) -> Rays:
    """Return the mirror ray of every covered pixel.

    Parameters
    ----------
    gbuffer : GBuffer

    Returns
    -------
    Rays
        N rays, N being the number of covered pixels, ordered by tiles of 32 by 32 pixels (row by
        row) and in Morton order inside a tile, so that neighbours in the array are neighbours on
        the screen. `pixel` is the pixel a ray starts from, `direction` has unit length, `t_far` is
        infinite.

    Notes
    -----
    A ray starts on the float64 point where the view through the pixel's centre meets the plane of
    the visible triangle, moved along the normal by the error bound of rounding that point to
    float32 and rounded outwards. `t_near` bounds the distance at which a float32 intersector can
    still report the triangle that the ray starts on. Neither is an absolute epsilon: both scale
    with the coordinates. The triangle's geometric normal is used, turned to the viewer.

    References
    ----------
    .. [1] M. Pharr, W. Jakob and G. Humphreys, "Physically Based Rendering", 4th ed., section
       6.8.6, `OffsetRayOrigin`.
    """
    _check.instance("gbuffer", gbuffer, GBuffer)
    camera = gbuffer.camera
    tiles_x = -(-camera.width // kernels.TILE)
    tiles_y = -(-camera.height // kernels.TILE)
    counts = np.empty(tiles_x * tiles_y, np.int64)
    kernels.count_covered(gbuffer.prim_id, tiles_x, counts)
    starts = np.cumsum(counts) - counts
    n = int(counts.sum())
    origin = np.empty((n, 3), np.float32)
    direction = np.empty((n, 3), np.float32)
    pixel = np.empty((n, 2), np.int32)
    t_near = np.empty(n, np.float32)
    kernels.mirror_rays(
        gbuffer.prim_id,
        gbuffer.depth,
        gbuffer.scene.vertices,
        gbuffer.scene.faces,
        np.array(camera.eye),
        np.array(camera.right),
        np.array(camera.up),
        np.array(camera.forward),
        1.0 / camera.focal_px,
        camera.near,
        tiles_x,
        starts,
        origin,
        direction,
        pixel,
        t_near,
    )
    return Rays(origin, direction, pixel, t_near, np.full(n, np.inf, np.float32))
