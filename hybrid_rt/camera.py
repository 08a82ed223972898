"""Project world points to the screen and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.types import F64, Camera


def project(camera: Camera, points_w: Any) -> F64:
    """Return where world points fall on the screen.

    Parameters
    ----------
    camera : Camera
    points_w : (N, 3) array_like of float, world

    Returns
    -------
    (N, 3) float64, screen
        x and y in pixels, and ``depth = near / z_view``. A point behind the eye has a negative
        depth, a point in the eye's plane is not finite.
    """
    _check.instance("camera", camera, Camera)
    p = _check.array("points_w", points_w, ("N", 3), np.float64)
    q = (p - np.array(camera.eye)) @ camera.pixel_from_world.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            np.stack([q[:, 0] / q[:, 2], q[:, 1] / q[:, 2], camera.near / q[:, 2]], axis=1)
        )


def unproject(camera: Camera, points_px: Any) -> F64:
    """Return the world points of screen points; the inverse of `project`.

    Parameters
    ----------
    camera : Camera
    points_px : (N, 3) array_like of float, screen
        x and y in pixels, and depth. A depth of 0 is infinitely far and not finite.

    Returns
    -------
    (N, 3) float64, world
    """
    _check.instance("camera", camera, Camera)
    s = _check.array("points_px", points_px, ("N", 3), np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = camera.near / s[:, 2]
        x_v = (s[:, 0] - 0.5 * camera.width) / camera.focal_px
        y_v = (0.5 * camera.height - s[:, 1]) / camera.focal_px
        ray = (
            np.array(camera.forward)
            + x_v[:, None] * np.array(camera.right)
            + y_v[:, None] * np.array(camera.up)
        )
        return np.asarray(np.array(camera.eye) + z[:, None] * ray)
