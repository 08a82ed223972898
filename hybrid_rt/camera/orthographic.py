"""The orthographic camera: lines of sight are parallel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from hybrid_rt import _check
from hybrid_rt.camera.camera import LARGEST_SIDE, Camera
from hybrid_rt.camera.parts import checked_lens
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F64, ViewArrays

THINNEST = 2.0**-24
"""Distance of the planes, relative to how far they are: any less, and float32 has one plane."""


@dataclass(frozen=True, repr=False)
class Orthographic(Camera):
    """A camera whose lines of sight are parallel; ``depth = (far - z_view) / (far - near)``.

    Made by `Camera.orthographic` and `Camera.from_matrices`. What all cameras have is said there.
    Depth is 1 on the near plane and 0 on the far plane, and what lies beyond either is not seen. A
    ray that comes to the far plane has left what is seen, as one that leaves the screen.

    Attributes
    ----------
    near : float
        May be negative: the near plane behind the eye.
    view_height : float
        What the screen's height shows, world units.
    far : float
        Distance of the far plane from the eye along `forward`, world units.
    aspect : float
        Pixels of a unit of length across over those down; 1 for square pixels.
    shift_px : two float
        Where on the screen the eye is, minus the middle of the screen, pixels; x right, y down.
    """

    view_height: float
    far: float
    aspect: float = 1.0
    shift_px: tuple[float, float] = (0.0, 0.0)

    def _checked(self) -> dict[str, Any]:
        near, far = _check.real("near", self.near), _check.real("far", self.far)
        for name, value in (("near", near), ("far", far)):
            if abs(value) > float(np.finfo(np.float32).max):
                raise ArgumentError(name, "a distance within float32", _check.describe(value))
        least = max(THINNEST * max(abs(near), abs(far)), float(np.finfo(np.float32).tiny))
        if not far - near >= least:
            expected = f"more than near, {near:g}, by what float32 can tell"
            raise ArgumentError("far", expected, _check.describe(self.far))
        return {
            "near": near,
            "far": far,
            "view_height": _check.float32_length("view_height", self.view_height),
            **checked_lens(self.aspect, self.shift_px),
        }

    def __repr__(self) -> str:
        odd = "" if self.aspect == 1.0 else f", pixels {1 / self.aspect:.4g} times as wide as high"
        x, y = self.shift_px
        odd += "" if x == y == 0.0 else f", eye shifted by ({x:.4g}, {y:.4g}) pixels"
        words = self._words(f"{self.view_height:.4g} high{odd}")
        return f"<Orthographic camera {words}, far {self.far:.4g}>"

    @property
    def extent(self) -> float:
        """Distance from the near plane to the far plane, world units."""
        return self.far - self.near

    @property
    def scale_px(self) -> tuple[float, float]:
        """Pixels of a world unit, across and down."""
        fy = self.height / self.view_height
        return self.aspect * fy, fy

    @property
    def _shift(self) -> tuple[float, float]:
        return self.shift_px

    @property
    def arrays(self) -> ViewArrays:
        """The projection and its inverse, as kernels take them."""
        (fx, fy), (cx, cy), (x, y) = self.scale_px, self.centre_px, self.shift_px
        right, up, forward = (np.array(v) for v in (self.right, self.up, self.forward))
        m, frame = np.zeros((4, 4)), np.zeros((4, 4))
        m[0, :3], m[0, 3] = fx * right, cx
        m[1, :3], m[1, 3] = -fy * up, cy
        m[2, 3] = 1.0
        m[3, :3], m[3, 3] = forward / -self.extent, self.far / self.extent
        frame[0, :3], frame[1, :3] = right / fx, -up / fy
        frame[2, :3] = self.far * forward - x * frame[0, :3] - y * frame[1, :3]
        frame[2, 3] = 1.0
        frame[3, :3] = -self.extent * forward
        return ViewArrays(m, np.array(self.eye), frame, 1.0, self.hand)

    @property
    def parallel(self) -> bool:
        """They are."""
        return True

    def z_view(self, depth: Any) -> F64:
        """Return distances from the eye along `forward`, float64, of depths, array_like."""
        with np.errstate(all="ignore"):
            return np.asarray(self.far - _check.reals("depth", depth) * self.extent)

    def depth_at(self, z_view: Any) -> F64:
        """Return depths, float64, of distances from the eye along `forward`, array_like."""
        with np.errstate(all="ignore"):
            return np.asarray((self.far - _check.reals("z_view", z_view)) / self.extent)

    def views(self, x: Any, y: Any) -> tuple[F64, F64]:
        """Return the lines of sight through places of the screen; see `Camera.views`."""
        x_v, y_v = self._across(x, y)
        with np.errstate(all="ignore"):
            origin = np.asarray(
                np.array(self.eye) + x_v * np.array(self.right) + y_v * np.array(self.up)
            )
        return origin, np.broadcast_to(np.array(self.forward), origin.shape)

    def primary(self, x: Any, y: Any) -> tuple[F64, F64, float, float]:
        """Return rays through places of the screen, from the near plane to the far plane."""
        origin, direction = self.views(x, y)
        return origin + self.near * direction, direction, 0.0, self.extent

    def towards(self, points_w: Any) -> F64:
        """Return the directions, (N, 3) float64, in which points (N, 3) are seen."""
        p = _check.array("points_w", points_w, ("N", 3), np.float64)
        return np.broadcast_to(np.array(self.forward), p.shape)

    def receding(self, length: float) -> tuple[float, float]:
        """Return what `Camera.receding` says: depth falls by as much everywhere."""
        return 0.0, _check.real("length", length, above=0.0) / self.extent

    @property
    def stride_unit(self) -> float:
        """A stride is a share of what the screen's height shows."""
        return self.view_height

    def resized(self, width: int, height: int) -> Self:
        """Return the same view with another number of pixels; what the height shows stays."""
        x, y = self.shift_px
        finer = _check.integer("height", height, least=1, most=LARGEST_SIDE) / self.height
        shift = (x * finer, y * finer)
        return replace(self, width=width, height=height, shift_px=shift)

    def _taller(self, width: int, height: int) -> Self:
        shown = self.view_height * height / self.height
        return replace(self, width=width, height=height, view_height=shown)
