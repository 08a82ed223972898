"""The pinhole camera: lines of sight meet in the eye."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from hybrid_rt import _check
from hybrid_rt.camera.camera import LARGEST_SIDE, Camera
from hybrid_rt.camera.parts import checked_lens
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F64, ViewArrays

NARROWEST = 1e-30
"""Degrees; any narrower, and a pixel's place is beyond float64."""


@dataclass(frozen=True, repr=False)
class Pinhole(Camera):
    """A camera whose lines of sight meet in the eye; ``depth = near / z_view``.

    Made by `Camera.look_at`, `Camera.from_matrices` and `Camera.from_intrinsics`. What all cameras
    have is said there.

    Attributes
    ----------
    vfov_deg : float
        Vertical field of view in degrees, of a screen around the axis: `shift_px` plays no part.
    aspect : float
        Focal length across over focal length down, fx / fy; 1 for square pixels.
    shift_px : two float
        The principal point minus the middle of the screen, pixels; x right, y down.
    far : float
        Distance of the far plane, world units, as depth buffers of others are scaled by it;
        infinite by default. What lies beyond it is seen all the same.
    """

    vfov_deg: float
    aspect: float = 1.0
    shift_px: tuple[float, float] = (0.0, 0.0)
    far: float = math.inf

    def _checked(self) -> dict[str, Any]:
        near = _check.float32_length("near", self.near)
        far = self.far
        if not (isinstance(far, float) and far == math.inf):
            far = _check.real("far", far)
            if not far > near:
                raise ArgumentError("far", f"more than near, {near:g}", _check.describe(self.far))
        return {
            "near": near,
            "vfov_deg": _check.real("vfov_deg", self.vfov_deg, above=NARROWEST, below=180.0),
            **checked_lens(self.aspect, self.shift_px),
            "far": far,
        }

    def __repr__(self) -> str:
        odd = "" if self.aspect == 1.0 else f", fx {self.aspect:.4g} fy"
        x, y = self.shift_px
        odd += "" if x == y == 0.0 else f", centre shifted by ({x:.4g}, {y:.4g}) pixels"
        return f"<Camera {self._words(f'{self.vfov_deg:.4g} degrees high{odd}')}>"

    @property
    def focal_px(self) -> float:
        """Distance of the image plane in pixels as high as these, fy."""
        return 0.5 * self.height / math.tan(math.radians(self.vfov_deg) / 2)

    @property
    def scale_px(self) -> tuple[float, float]:
        """Focal lengths fx and fy: pixels of a length of 1 at the distance 1."""
        return self.aspect * self.focal_px, self.focal_px

    @property
    def _shift(self) -> tuple[float, float]:
        return self.shift_px

    @property
    def arrays(self) -> ViewArrays:
        """The projection and its inverse, as kernels take them."""
        m, frame = np.zeros((4, 4)), np.zeros((4, 4))
        m[:3, :3] = self.pixel_from_world
        m[3, 3] = self.near
        frame[:3, :3] = self.world_from_pixel
        frame[3, 3] = 1.0
        return ViewArrays(m, np.array(self.eye), frame, self.near, self.hand)

    @property
    def pixel_from_world(self) -> F64:
        """(3, 3) float64 matrix M of the projection.

        ``q = M @ (p_w - eye)`` gives ``x_px = q0 / q2``, ``y_px = q1 / q2`` and ``z_view = q2``.
        The eye is subtracted first, in float64, so that a scene far from the origin loses nothing.
        """
        (fx, fy), (cx, cy) = self.scale_px, self.centre_px
        forward = np.array(self.forward)
        return np.stack(
            [
                fx * np.array(self.right) + cx * forward,
                -fy * np.array(self.up) + cy * forward,
                forward,
            ]
        )

    @property
    def world_from_pixel(self) -> F64:
        """(3, 3) float64; rows right / fx, -up / fy and the view through the screen's middle.

        The ray ``row2 + (x - W / 2) row0 + (y - H / 2) row1`` runs from the eye through the place
        (x, y) of the screen and has z_view = 1 at its end.
        """
        (fx, fy), (x, y) = self.scale_px, self.shift_px
        across, down = np.array(self.right) / fx, -np.array(self.up) / fy
        return np.stack([across, down, np.array(self.forward) - x * across - y * down])

    @property
    def parallel(self) -> bool:
        """They are not."""
        return False

    def z_view(self, depth: Any) -> F64:
        """Return distances from the eye along `forward`, float64, of depths, array_like."""
        with np.errstate(all="ignore"):
            return np.asarray(self.near / _check.reals("depth", depth))

    def depth_at(self, z_view: Any) -> F64:
        """Return depths, float64, of distances from the eye along `forward`, array_like."""
        with np.errstate(all="ignore"):
            return np.asarray(self.near / _check.reals("z_view", z_view))

    def views(self, x: Any, y: Any) -> tuple[F64, F64]:
        """Return the lines of sight through places of the screen; see `Camera.views`."""
        x_v, y_v = self._across(x, y)
        with np.errstate(all="ignore"):
            direction = np.asarray(
                np.array(self.forward) + x_v * np.array(self.right) + y_v * np.array(self.up)
            )
        return np.broadcast_to(np.array(self.eye), direction.shape), direction

    def primary(self, x: Any, y: Any) -> tuple[F64, F64, float, float]:
        """Return rays through places of the screen, from the eye: t is z_view."""
        return *self.views(x, y), self.near, math.inf

    def towards(self, points_w: Any) -> F64:
        """Return the directions, (N, 3) float64, in which points (N, 3) are seen."""
        p = _check.array("points_w", points_w, ("N", 3), np.float64)
        with np.errstate(all="ignore"):
            return np.asarray(p - np.array(self.eye))

    def receding(self, length: float) -> tuple[float, float]:
        """Return what `Camera.receding` says: near / (z_view + length) of depths near / z_view."""
        return _check.real("length", length, above=0.0) / self.near, 0.0

    @property
    def stride_unit(self) -> float:
        """A stride is a share of z_view where the ray starts."""
        return 1.0

    def resized(self, width: int, height: int) -> Self:
        """Return the same view with another number of pixels; the vertical field of view stays."""
        x, y = self.shift_px
        finer = _check.integer("height", height, least=1, most=LARGEST_SIDE) / self.height
        shift = (x * finer, y * finer)
        return replace(self, width=width, height=height, shift_px=shift)

    def _taller(self, width: int, height: int) -> Self:
        vfov = math.degrees(2.0 * math.atan(0.5 * height / self.focal_px))
        return replace(self, width=width, height=height, vfov_deg=vfov)
