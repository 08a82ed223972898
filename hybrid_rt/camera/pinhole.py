"""A pinhole camera; world points to the screen and back."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F64, ViewArrays

Vector = tuple[float, float, float]
NARROWEST = 1e-30
"""Degrees; any narrower, and a pixel's place is beyond float64."""
AXES = ("right", "up", "forward")
LARGEST_SIDE = 32768
"""Pixels along a side: what the raster's fixed-point coordinates hold."""
ORTHONORMAL = 1e-9
"""By how much products of the axes, which have length 1, may be off."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with square pixels. Make one with `Camera.look_at`.

    Attributes
    ----------
    eye : three float, world
    right, up, forward : three float, world
        Orthonormal; the camera looks along `forward`, which is -Z of its own right-handed frame.
    vfov_deg : float
        Vertical field of view in degrees.
    width, height : int
        Pixels.
    near : float
        Distance of the near plane along `forward`, world units.
    """

    eye: Vector
    right: Vector
    up: Vector
    forward: Vector
    vfov_deg: float
    width: int
    height: int
    near: float

    def __post_init__(self) -> None:
        checked = {
            "eye": _check.point3("eye", self.eye),
            **{name: _check.vector3(name, getattr(self, name)) for name in AXES},
            "vfov_deg": _check.real("vfov_deg", self.vfov_deg, above=NARROWEST, below=180.0),
            "width": _check.integer("width", self.width, least=1, most=LARGEST_SIDE),
            "height": _check.integer("height", self.height, least=1, most=LARGEST_SIDE),
            "near": _check.float32_length("near", self.near),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        axes = np.array([self.right, self.up, self.forward])
        for k, name in enumerate(AXES):
            long = np.abs(axes[k]).max() > 2.0
            if long or np.abs(axes @ axes[k] - np.eye(3)[k]).max() > ORTHONORMAL:
                expected = "an axis of length 1 at right angles to the other two"
                raise ArgumentError(name, expected, _check.describe(getattr(self, name)))

    @classmethod
    def look_at(
        cls,
        eye: Any,
        target: Any,
        up: Any = (0.0, 1.0, 0.0),
        *,
        vfov_deg: float = 60.0,
        width: int = 1920,
        height: int = 1080,
        near: float = 0.05,
    ) -> Camera:
        """Return a camera at `eye` that looks at `target`.

        Parameters
        ----------
        eye, target, up : three float, world
            `up` need not be orthogonal to the view, only not parallel to it.
        vfov_deg : float
            Vertical field of view, 0 < vfov_deg < 180.
        width, height : int
            Pixels, 1 to 32768 each.
        near : float
            Distance of the near plane, > 0, world units.

        Raises
        ------
        ArgumentError
            Anything out of range, `eye` equal to `target`, `up` zero or parallel to the view.
        """
        eye3 = np.array(_check.vector3("eye", eye))
        target3 = np.array(_check.vector3("target", target))
        up3 = np.array(_check.vector3("up", up))
        with np.errstate(over="ignore"):
            forward = target3 - eye3
        distance = math.hypot(*forward)
        if distance == 0.0 or not math.isfinite(distance):
            raise ArgumentError("target", "a point other than eye", _check.describe(target))
        forward = forward / distance
        length = math.hypot(*up3)
        if length == 0.0 or not math.isfinite(length):
            raise ArgumentError("up", "a direction of finite length > 0", _check.describe(up))
        right = np.cross(forward, up3 / length)
        sine = float(np.linalg.norm(right))
        if sine < 1e-9:  # relative: both vectors have unit length here
            raise ArgumentError("up", "a direction not parallel to the view", _check.describe(up))
        right = right / sine
        return cls(
            eye=_vec(eye3),
            right=_vec(right),
            up=_vec(np.cross(right, forward)),
            forward=_vec(forward),
            vfov_deg=vfov_deg,
            width=width,
            height=height,
            near=near,
        )

    def __repr__(self) -> str:
        eye, forward = (" ".join(f"{x:.4g}" for x in v) for v in (self.eye, self.forward))
        size = f"{self.width} x {self.height} pixels, {self.vfov_deg:.4g} degrees high"
        return f"<Camera at ({eye}) along ({forward}): {size}, near {self.near:.4g}>"

    def resized(self, width: int, height: int) -> Camera:
        """Return the same view with another number of pixels; the vertical field of view stays."""
        return replace(self, width=width, height=height)

    def widened(self, factor: float) -> Camera:
        """Return a view `factor` times as wide and as high around the same axis.

        Pixels stay as they are, so their number grows with the square of `factor`: with a factor
        above 1 the view gets a border, a *guard band*.

        Parameters
        ----------
        factor : float
            > 0; the numbers of pixels are rounded.

        Raises
        ------
        ArgumentError
            `factor` out of range, or more pixels than a camera may have.
        """
        factor = _check.real("factor", factor, above=0.0)
        height = max(1, round(self.height * factor))
        wider = self.resized(max(1, round(self.width * factor)), height)
        return replace(wider, vfov_deg=math.degrees(2.0 * math.atan(0.5 * height / self.focal_px)))

    @property
    def arrays(self) -> ViewArrays:
        """The projection, as kernels take it."""
        return ViewArrays(self.pixel_from_world, np.array(self.eye), self.near)

    @property
    def focal_px(self) -> float:
        """Distance of the image plane in pixels."""
        return 0.5 * self.height / math.tan(math.radians(self.vfov_deg) / 2)

    @property
    def pixel_from_world(self) -> F64:
        """(3, 3) float64 matrix M of the projection.

        ``q = M @ (p_w - eye)`` gives ``x_px = q0 / q2``, ``y_px = q1 / q2`` and ``z_view = q2``.
        The eye is subtracted first, in float64, so that a scene far from the origin loses nothing.
        """
        f = self.focal_px
        forward = np.array(self.forward)
        return np.stack(
            [
                f * np.array(self.right) + 0.5 * self.width * forward,
                -f * np.array(self.up) + 0.5 * self.height * forward,
                forward,
            ]
        )

    @property
    def world_from_pixel(self) -> F64:
        """(3, 3) float64; rows right / f, -up / f and forward, with f = `focal_px`.

        The ray ``forward + (x - W / 2) row0 + (y - H / 2) row1`` runs from the eye through the
        place (x, y) of the screen and has z_view = 1 at its end.
        """
        f = self.focal_px
        return np.stack([np.array(self.right) / f, -np.array(self.up) / f, np.array(self.forward)])


def _vec(v: F64) -> Vector:
    return float(v[0]), float(v[1]), float(v[2])


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
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        q = (p - np.array(camera.eye)) @ camera.pixel_from_world.T
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
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        z = camera.near / s[:, 2]
        x_v = (s[:, 0] - 0.5 * camera.width) / camera.focal_px
        y_v = (0.5 * camera.height - s[:, 1]) / camera.focal_px
        ray = (
            np.array(camera.forward)
            + x_v[:, None] * np.array(camera.right)
            + y_v[:, None] * np.array(camera.up)
        )
        return np.asarray(np.array(camera.eye) + z[:, None] * ray)
