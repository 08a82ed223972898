"""Rays in linear arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt import _check
from hybrid_rt._record import Record
from hybrid_rt.camera.camera import Camera
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F32, I32, RayArrays
from hybrid_rt.scene.mesh import Scene


@dataclass(frozen=True, eq=False)
class Rays(Record):
    """Rays in linear arrays, and where they were made.

    Attributes
    ----------
    origin, direction : (N, 3) float32, world
        `direction` need not have unit length; every t is in units of its length. A ray with a NaN,
        an infinity or a zero direction is kept: it is `MarchStatus.INVALID` in a march and hits
        nothing.
    pixel : (N, 2) int32
        The pixel (x, y) on whose visible surface the ray starts; (-1, -1), the default, for a ray
        that starts anywhere else.
    t_near, t_far : (N,) float32
        Only hits with ``t_near <= t <= t_far`` count; default 0 and infinity.
    scene : Scene, optional
        What the rays leave, if they were made for one: no tracer and no screen of another scene
        takes them then.
    camera : Camera, optional
        Whose pixels `pixel` are, if it is known: no screen of another view takes the rays then.

    Raises
    ------
    ArgumentError
        Wrong shape, dtype or length; a NaN or negative `t_near`, a NaN `t_far`.

    Notes
    -----
    The arrays are copied, and read-only from then on.
    """

    origin: F32
    direction: F32
    pixel: I32 = None  # type: ignore[assignment]
    t_near: F32 = None  # type: ignore[assignment]
    t_far: F32 = None  # type: ignore[assignment]
    scene: Scene | None = None
    camera: Camera | None = None

    def __post_init__(self) -> None:
        o = _check.owned("origin", self.origin, ("N", 3), np.float32)
        n = len(o)
        d = _check.owned("direction", self.direction, ("N", 3), np.float32)
        _check.same_length("direction", d, "origin", n)
        px = _given("pixel", self.pixel, -1, (n, 2), np.int32)
        t_near = _given("t_near", self.t_near, 0.0, (n,), np.float32)
        if not (t_near >= 0).all():
            raise ArgumentError("t_near", "values >= 0", "negative values or NaN")
        t_far = _given("t_far", self.t_far, np.inf, (n,), np.float32)
        if np.isnan(t_far).any():
            raise ArgumentError("t_far", "values that are not NaN", "NaN")
        for name, cls in (("scene", Scene), ("camera", Camera)):
            if getattr(self, name) is not None:
                _check.instance(name, getattr(self, name), cls)
        self._own(RayArrays(o, d, px, t_near, t_far))

    @classmethod
    def from_arrays(
        cls,
        origin: Any,
        direction: Any,
        pixel: Any = None,
        t_near: Any = None,
        t_far: Any = None,
        *,
        scene: Scene | None = None,
        camera: Camera | None = None,
    ) -> Rays:
        """Return rays from arrays; arguments and errors are those of the class."""
        return cls(origin, direction, pixel, t_near, t_far, scene, camera)

    def __len__(self) -> int:
        return len(self.origin)

    def __repr__(self) -> str:
        scene = "" if self.scene is None else f" of {self.scene.name!r}"
        view = "" if self.camera is None else f", {self.camera.width} x {self.camera.height} pixels"
        return f"<Rays: {len(self)}{scene}{view}>"

    @property
    def arrays(self) -> RayArrays:
        """All arrays, in the order of the attributes, as kernels take them."""
        arrays: RayArrays = self._arrays
        return arrays

    def take(self, index: Any) -> Rays:
        """Return the rays selected by a slice, or an index or boolean array.

        Raises
        ------
        ArgumentError
            Something else, an index that no ray has, or a boolean array of another length.
        """
        rows = _rows(index, len(self))
        chosen: list[Any] = [np.array(array[rows], order="C") for array in self.arrays]
        return Rays._made(RayArrays(*chosen), scene=self.scene, camera=self.camera)

    def starting(self, t_near: Any) -> Rays:
        """Return the same rays with another `t_near`, (N,) array_like of float, >= 0."""
        near = _check.owned("t_near", t_near, ("N",), np.float32)
        _check.same_length("t_near", near, "rays", len(self))
        if not (near >= 0).all():
            raise ArgumentError("t_near", "values >= 0", "negative values or NaN")
        return self._starting(near)

    def _starting(self, t_near: F32) -> Rays:
        arrays = self.arrays._replace(t_near=t_near)
        return Rays._made(arrays, scene=self.scene, camera=self.camera)

    def detached(self) -> Rays:
        """Return the same rays of no scene and no view, for screens and tracers of others.

        They start from no pixel then: what `pixel` would name is the surface of another view.
        """
        nowhere = np.full_like(self.pixel, -1)
        return Rays._made(self.arrays._replace(pixel=nowhere), scene=None, camera=None)


def _rows(index: Any, n: int) -> slice | NDArray[Any]:
    """Return what selects rows of N rays."""
    expected = "a slice, or an array of shape (M,) of integers or bool"
    try:
        if isinstance(index, slice):
            index.indices(n)
            return index
        rows = np.asarray(index)
    except Exception as error:  # slices of anything, ragged lists, somebody's own __array__
        raise ArgumentError("index", expected, _check.describe(index)) from error
    if rows.shape == (0,):
        return rows.astype(np.int64)
    if rows.ndim != 1 or rows.dtype.kind not in "biu":
        raise ArgumentError("index", expected, _check.describe(index))
    if rows.dtype.kind == "b":
        _check.same_length("index", rows, "rays", n)
    else:
        _check.in_range("index", rows, -n, n - 1, f"there are {n} rays")
    return rows


def _given(
    argument: str, value: Any, default: float, shape: tuple[int, ...], dtype: type[np.generic]
) -> NDArray[Any]:
    """Return an array of its own with a row for each ray; filled with the default for None."""
    if value is None:
        return np.full(shape, default, dtype)
    rows = _check.owned(argument, value, ("N", *shape[1:]), dtype)
    _check.same_length(argument, rows, "origin", shape[0])
    return rows
