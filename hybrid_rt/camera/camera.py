"""What all cameras share; world points to the screen and back."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np

from hybrid_rt import _check
from hybrid_rt.camera.parts import Vector, frame_of
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F64, SightArrays, ViewArrays

if TYPE_CHECKING:
    from hybrid_rt.camera.orthographic import Orthographic
    from hybrid_rt.camera.pinhole import Pinhole

AXES = ("right", "up", "forward")
LARGEST_SIDE = 32768
"""Pixels along a side: what the raster's fixed-point coordinates hold."""
ORTHONORMAL = 1e-9
"""By how much products of the axes, which have length 1, may be off."""


@dataclass(frozen=True)
class Camera(ABC):
    """A view of W by H pixels; make one with a method named below.

    `look_at` and `from_intrinsics` return a `Pinhole`, `orthographic` an `Orthographic`, and
    `from_matrices` the one of both that the matrices are.

    Attributes
    ----------
    eye : three float, world
    right, up, forward : three float, world
        Orthonormal; the camera looks along `forward`. It is -Z of the camera's own right-handed
        frame (right, up, -forward), or +Z of a left-handed one, whose picture is the mirror image.
    width, height : int
        Pixels.
    near : float
        Distance of the near plane from the eye along `forward`, world units.
    far : float
        Distance of the far plane, world units; may be infinite.

    Notes
    -----
    All kinds are one homogeneous map of ``p - eye`` to (x w, y w, w, d) with ``depth = d / w``,
    which is 1 on the near plane, falls away from the viewer and is linear on the screen over a
    plane: see `ViewArrays`.
    """

    eye: Vector
    right: Vector
    up: Vector
    forward: Vector
    width: int
    height: int
    near: float

    def __post_init__(self) -> None:
        checked = {
            "eye": _check.point3("eye", self.eye),
            **{name: _check.vector3(name, getattr(self, name)) for name in AXES},
            "width": _check.integer("width", self.width, least=1, most=LARGEST_SIDE),
            "height": _check.integer("height", self.height, least=1, most=LARGEST_SIDE),
            **self._checked(),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        axes = np.array([self.right, self.up, self.forward])
        for k, name in enumerate(AXES):
            long = np.abs(axes[k]).max() > 2.0
            if long or np.abs(axes @ axes[k] - np.eye(3)[k]).max() > ORTHONORMAL:
                expected = "an axis of length 1 at right angles to the other two"
                raise ArgumentError(name, expected, _check.describe(getattr(self, name)))

    @abstractmethod
    def _checked(self) -> dict[str, Any]:
        """Return what a kind has of its own, checked."""

    @staticmethod
    def look_at(
        eye: Any,
        target: Any,
        up: Any = (0.0, 1.0, 0.0),
        *,
        vfov_deg: float = 60.0,
        width: int = 1920,
        height: int = 1080,
        near: float = 0.05,
    ) -> Pinhole:
        """Return a pinhole camera at `eye` that looks at `target`.

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
        from hybrid_rt.camera.pinhole import Pinhole

        return Pinhole(
            *frame_of(eye, target, up), width=width, height=height, near=near, vfov_deg=vfov_deg
        )

    @staticmethod
    def orthographic(
        eye: Any,
        target: Any,
        up: Any = (0.0, 1.0, 0.0),
        *,
        view_height: float,
        width: int = 1920,
        height: int = 1080,
        near: float = 0.0,
        far: float,
    ) -> Orthographic:
        """Return a camera whose lines of sight are parallel, from `eye` towards `target`.

        Parameters
        ----------
        eye, target, up : three float, world
            The middle of the screen shows the line from `eye` to `target`; `up` as in `look_at`.
        view_height : float
            What the screen's height shows, > 0, world units.
        width, height : int
            Pixels, 1 to 32768 each.
        near, far : float
            Distances of the near and the far plane from the eye along the view, near < far, world
            units; the near plane may lie behind the eye. What lies beyond either is not seen.

        Raises
        ------
        ArgumentError
            Anything out of range, `eye` equal to `target`, `up` zero or parallel to the view.
        """
        from hybrid_rt.camera.orthographic import Orthographic

        axes = frame_of(eye, target, up)
        return Orthographic(
            *axes, width=width, height=height, near=near, view_height=view_height, far=far
        )

    @staticmethod
    def from_matrices(
        view: Any,
        projection: Any,
        *,
        width: int,
        height: int,
        convention: Literal["opengl", "d3d", "vulkan"] = "opengl",
    ) -> Pinhole | Orthographic:
        """Return the camera of a view matrix and a projection matrix.

        Parameters
        ----------
        view : (4, 4) array_like of float
            World to view; for column vectors, so that its last column is the translation.
        projection : (4, 4) array_like of float
            View to clip space, for column vectors.
        width, height : int
            Pixels, 1 to 32768 each.
        convention : {"opengl", "d3d", "vulkan"}
            Clip space. "opengl": z from -w to w, y up. "d3d": z from 0 to w, y up. "vulkan": z
            from 0 to w, y down. The same numbers mean other near planes in each, so this cannot be
            found out; what contradicts the numbers is refused.

        Returns
        -------
        Pinhole or Orthographic
            The first of perspective matrices (last row (0, 0, -1, 0) or (0, 0, 1, 0)), the other
            of orthographic ones (last row (0, 0, 0, 1)). `near` and `far` are the planes of the
            projection, whichever of them has the larger z: standard and reversed Z are told apart
            by the numbers, a far plane at infinity too.

        Raises
        ------
        ArgumentError
            Matrices for row vectors, that is, transposed; a view that scales, shears or is none; a
            projection with shear, an oblique near plane, or of no kind known here; an orthographic
            projection from behind the eye to ahead of it, where "d3d" and "vulkan" leave open which
            way it looks ("opengl" looks along -z).

        Notes
        -----
        A negative ``projection[1, 1]`` is read as clip space with y down, as it is written for
        Vulkan: the picture stays upright. Left-handed views, and mirrored ones, show what they show
        there: of a world in right-handed coordinates the mirror image.

        The rotation of `view` may be off by what float32 rounds, 1e-5, and is made orthonormal.
        """
        from hybrid_rt.camera.matrices import camera_of

        return camera_of(view, projection, width, height, convention)

    @staticmethod
    def from_intrinsics(
        K: Any,
        R: Any,
        t: Any,
        *,
        width: int,
        height: int,
        near: float = 0.05,
    ) -> Pinhole:
        """Return the pinhole camera of a calibration as OpenCV has it.

        In the camera's own frame x points right, y down and z along the view, and a world point is
        at ``R @ p + t``. Centres of pixels have whole coordinates, so the principal point here is
        half a pixel farther right and down than in `K`.

        Parameters
        ----------
        K : (3, 3) array_like of float
            ``[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]``, pixels.
        R : (3, 3) array_like of float
            A rotation, not a Rodrigues vector; may be off by what float32 rounds, 1e-5, and is
            made orthonormal.
        t : (3,) or (3, 1) array_like of float
            World units.
        width, height : int
            Pixels, 1 to 32768 each.
        near : float
            Distance of the near plane, > 0, world units.

        Raises
        ------
        ArgumentError
            A skew, a focal length <= 0, a last row of `K` other than (0, 0, 1), an `R` that is no
            rotation, anything out of range.

        Notes
        -----
        There is no distortion here: images must be undistorted first (``cv2.undistort``, or
        ``cv2.getOptimalNewCameraMatrix`` for another `K`).
        """
        from hybrid_rt.camera.matrices import calibrated

        return calibrated(K, R, t, width, height, near)

    if TYPE_CHECKING:  # a field of each kind: a property would stand in its way

        @property
        def far(self) -> float:
            """Distance of the far plane from the eye along `forward`; may be infinite."""

    @property
    @abstractmethod
    def arrays(self) -> ViewArrays:
        """The projection and its inverse, as kernels take them."""

    @property
    @abstractmethod
    def scale_px(self) -> tuple[float, float]:
        """Pixels, across and down, of a length of 1 where the view's units are: see each kind."""

    @property
    def centre_px(self) -> tuple[float, float]:
        """Where on the screen the view along `forward` through the eye is, pixels."""
        shift_x, shift_y = self._shift
        return 0.5 * self.width + shift_x, 0.5 * self.height + shift_y

    @property
    @abstractmethod
    def _shift(self) -> tuple[float, float]:
        """`centre_px` minus the middle of the screen, pixels."""

    @property
    def sight(self) -> SightArrays:
        """The lines of sight, as kernels take them."""
        (fx, fy), (cx, cy) = self.scale_px, self.centre_px
        eye, right, up, forward = map(np.array, (self.eye, self.right, self.up, self.forward))
        return SightArrays(
            eye, right, up, forward, cx, cy, 1.0 / fx, 1.0 / fy, self.parallel, self.near, self.far
        )

    @property
    @abstractmethod
    def parallel(self) -> bool:
        """Whether the lines of sight are parallel; if not, they meet in the eye."""

    @property
    def hand(self) -> float:
        """1.0, or -1.0 where (right, up, -forward) is left-handed."""
        return 1.0 if np.dot(np.cross(self.up, self.right), self.forward) > 0.0 else -1.0

    def _across(self, x: Any, y: Any) -> tuple[F64, F64]:
        """Return places of the screen in units of right and up, (N, 1) each."""
        across = _check.array("x", x, ("N",), np.float64)
        down = _check.array("y", y, ("N",), np.float64)
        _check.same_length("y", down, "x", len(across))
        (fx, fy), (cx, cy) = self.scale_px, self.centre_px
        with np.errstate(all="ignore"):
            x_v, y_v = (across - cx) / fx, (cy - down) / fy
        return np.asarray(x_v[:, None]), np.asarray(y_v[:, None])

    @abstractmethod
    def z_view(self, depth: Any) -> F64:
        """Return distances from the eye along `forward`, float64, of depths, array_like."""

    @abstractmethod
    def depth_at(self, z_view: Any) -> F64:
        """Return depths, float64, of distances from the eye along `forward`, array_like."""

    @abstractmethod
    def views(self, x: Any, y: Any) -> tuple[F64, F64]:
        """Return the lines of sight through places of the screen.

        Parameters
        ----------
        x, y : (N,) array_like of float, screen
            Pixels.

        Returns
        -------
        origin, direction : (N, 3) float64, world
            ``origin + z * direction`` is the point at the distance z from the eye along `forward`.
        """

    @abstractmethod
    def primary(self, x: Any, y: Any) -> tuple[F64, F64, float, float]:
        """Return rays through places of the screen: origins, directions, t_near, t_far.

        As `views`, but that every t is >= 0.
        """

    @abstractmethod
    def towards(self, points_w: Any) -> F64:
        """Return the directions, (N, 3) float64, in which points (N, 3) are seen."""

    @abstractmethod
    def receding(self, length: float) -> tuple[float, float]:
        """Return (a, b): a point `length` farther along `forward` has (depth - b) / (1 + a depth).

        A length > 0 in world units.
        """

    @property
    @abstractmethod
    def stride_unit(self) -> float:
        """What steps of `hybrid_rt.Linear` are shares of, in units of w where the ray starts."""

    @abstractmethod
    def resized(self, width: int, height: int) -> Self:
        """Return the same view with another number of pixels; what the height shows stays."""

    @abstractmethod
    def _taller(self, width: int, height: int) -> Self:
        """Return a view of another number of the same pixels around the middle of the screen."""

    def widened(self, factor: float) -> Self:
        """Return a view `factor` times as wide and as high around the middle of the screen.

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
        sides = (max(1, round(side * factor)) for side in (self.width, self.height))
        return self._taller(*sides)

    def _words(self, lens: str) -> str:
        eye, forward = (" ".join(f"{x:.4g}" for x in v) for v in (self.eye, self.forward))
        size = f"{self.width} x {self.height} pixels"
        mirrored = "" if self.hand > 0.0 else ", mirrored"
        return f"at ({eye}) along ({forward}): {size}, {lens}, near {self.near:.4g}{mirrored}"


def homogeneous(camera: Camera, points_w: F64) -> F64:
    """Return (x w, y w, w, d) of points (N, 3): (N, 4) float64."""
    m = camera.arrays.m
    return np.asarray((points_w - np.array(camera.eye)) @ m[:, :3].T + m[:, 3])


def project(camera: Camera, points_w: Any) -> F64:
    """Return where world points fall on the screen.

    Parameters
    ----------
    camera : Camera
    points_w : (N, 3) array_like of float, world

    Returns
    -------
    (N, 3) float64, screen
        x and y in pixels, and depth: 1 on the near plane, and smaller beyond it. Of a pinhole
        camera it is ``near / z_view``: a point behind the eye has a negative depth, a point in the
        eye's plane is not finite. Of an orthographic camera it is ``(far - z_view) / (far -
        near)``: a point beyond the far plane has a negative depth.
    """
    _check.instance("camera", camera, Camera)
    p = _check.array("points_w", points_w, ("N", 3), np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        q = homogeneous(camera, p)
        return np.asarray(np.stack([q[:, 0] / q[:, 2], q[:, 1] / q[:, 2], q[:, 3] / q[:, 2]], 1))


def unproject(camera: Camera, points_px: Any) -> F64:
    """Return the world points of screen points; the inverse of `project`.

    Parameters
    ----------
    camera : Camera
    points_px : (N, 3) array_like of float, screen
        x and y in pixels, and depth. Of a pinhole camera, a depth of 0 is infinitely far and not
        finite.

    Returns
    -------
    (N, 3) float64, world
    """
    _check.instance("camera", camera, Camera)
    s = _check.array("points_px", points_px, ("N", 3), np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        origin, direction = camera.views(s[:, 0], s[:, 1])
        return np.asarray(origin + camera.z_view(s[:, 2])[:, None] * direction)
