"""Depth buffers as engines write them, brought to the screen's own depth and checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt import _check
from hybrid_rt.camera.camera import Camera
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F64, Bool

KINDS = ("standard", "reversed", "linear", "distance")
ORIGINS = ("top", "bottom")
WHOLE_BITS = {np.dtype(np.uint16): 16, np.dtype(np.uint32): 32}
FLOAT32 = 8 * 2.0**-24
"""What a few operations in float32 round away, relative to their terms."""
AT_NEAR = 0.9
"""A depth of the screen from which on a surface lies at the near plane."""
OTHER = {"standard": "reversed", "reversed": "standard"}


@dataclass(frozen=True, eq=False)
class ScreenDepth:
    """Depth as the screen has it; row 0 is the top.

    Attributes
    ----------
    depth : (H, W) float64
        0 where there is nothing.
    uncertainty : (H, W) float64
        By how much each may be off: half of the step between numbers of the buffer, in `depth`.
    arithmetic : float
        By how much an engine that computes in float32 may be off before it stores a number, besides
        what is relative to `depth`: standard buffers hold numbers near 1, and round as such.
    """

    depth: F64
    uncertainty: F64
    arithmetic: float


@dataclass(frozen=True)
class Form:
    """How a depth buffer is to be read: the arguments of `GBuffer.from_arrays`, checked.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    bits : int or None
        Of an integer buffer; None for floats.
    far : float
        Distance of the far plane, infinity where there is none.
    bottom : bool
        Whether row 0 of the buffer is the bottom of the picture.
    """

    kind: str
    bits: int | None
    far: float
    bottom: bool

    @property
    def nothing(self) -> float:
        """What the buffer holds where there is nothing."""
        return {"standard": 1.0, "reversed": 0.0}.get(self.kind, self.far)

    def values(self, depth: NDArray[Any]) -> tuple[F64, F64]:
        """Return the numbers of a buffer, integers from 0 to 1, and half the step at each."""
        if self.bits is None:
            values = depth.astype(np.float64)
            with np.errstate(invalid="ignore", over="ignore"):
                return values, 0.5 * np.spacing(np.abs(depth)).astype(np.float64)
        steps = 2**self.bits - 1
        return depth / np.float64(steps), np.full(depth.shape, 0.5 / steps)


def form(camera: Camera, depth: Any, kind: Any, bits: Any, far: Any, origin: Any) -> Form:
    """Return how to read a depth buffer, its shape and dtype being right."""
    kind = _check.choice("kind", kind, KINDS)
    bottom = _check.choice("origin", origin, ORIGINS) == "bottom"
    if camera.parallel and kind == "distance":
        expected = "another kind for an orthographic camera, whose lines of sight begin nowhere"
        raise ArgumentError("kind", expected, repr(kind))
    if camera.parallel and far not in (None, camera.far):
        expected = f"None, or that of the camera, {camera.far:g}"
        raise ArgumentError("far", expected, _check.describe(far))
    distance = camera.far if far is None else np.inf
    if far is not None and not (isinstance(far, float) and far == np.inf):
        distance = _check.real("far", far, above=camera.near)
    if not isinstance(depth, np.ndarray):
        raise ArgumentError("depth", "a NumPy array", _check.describe(depth))
    shape = camera.height, camera.width
    if depth.shape != shape:
        expected = f"an array of shape {shape}, as high and as wide as the camera's picture"
        raise ArgumentError("depth", expected, _check.describe(depth))
    if depth.dtype.kind == "f" and depth.dtype.itemsize <= 8:
        if bits is not None:
            expected = "None for floats, which say themselves"
            raise ArgumentError("bits", expected, _check.describe(bits))
        return Form(kind, None, distance, bottom)
    native = depth.dtype.newbyteorder("=")
    if native not in WHOLE_BITS:
        expected = "float16, float32, float64, uint16 or uint32"
        raise ArgumentError("depth", expected, _check.describe(depth))
    if kind not in OTHER:
        expected = f"floats for kind {kind!r}, in world units"
        raise ArgumentError("depth", expected, _check.describe(depth))
    if bits is None:
        if native == np.uint32:
            raise ArgumentError("bits", "24 or 32 for uint32: how many hold the depth", "None")
        bits = 16
    return Form(
        kind, _check.integer("bits", bits, least=1, most=WHOLE_BITS[native]), distance, bottom
    )


def read(camera: Camera, depth: NDArray[Any], how: Form, background: Any = None) -> ScreenDepth:
    """Return the depth of the screen that a buffer says.

    Raises
    ------
    ArgumentError
        A value that the buffer cannot have, with its pixel; nothing but background; everything at
        the near plane.
    """
    if how.bits is not None:
        _fits_bits(depth, how.bits)
    values, half = how.values(depth)
    empty = _background(background, depth) | (values == how.nothing)
    if empty.all():
        raise ArgumentError("depth", "a surface in at least one pixel", "background alone")
    _in_range(camera, depth, values, half, empty, how)
    inner = np.where(empty, how.nothing, values)
    screen, off = _on_screen(camera, inner, half, how)
    screen[empty], off[empty] = 0.0, 0.0
    if how.kind in OTHER and not camera.parallel:
        _not_the_other(screen[~empty], how)
    if how.bottom:
        screen, off = screen[::-1], off[::-1]
    arithmetic = FLOAT32 if how.kind == "standard" else 0.0
    return ScreenDepth(np.ascontiguousarray(screen), np.ascontiguousarray(off), arithmetic)


def _on_screen(camera: Camera, values: F64, half: F64, how: Form) -> tuple[F64, F64]:
    """Return depth and its uncertainty.

    With z the distance along the view, n and f the planes, the screen of a pinhole camera has n / z
    and standard buffers have ``f / (f - n) * (1 - n / z)``; of an orthographic camera, it has
    ``(f - z) / (f - n)`` and they ``(z - n) / (f - n)``. So one is linear in the other.
    """
    per_value = 1.0 if camera.parallel else 1.0 - camera.near / how.far
    if how.kind == "standard":
        return 1.0 - values * per_value, half * per_value
    if how.kind == "reversed":
        return 1.0 - (1.0 - values) * per_value, half * per_value
    if how.kind == "distance":
        along = _view_lengths(camera, how.bottom)
        values, half = values / along, half / along
    screen = np.minimum(camera.depth_at(values), 1.0)
    if camera.parallel:
        return np.maximum(screen, 0.0), half / (camera.far - camera.near)
    with np.errstate(divide="ignore", invalid="ignore"):
        return screen, screen * (half / values)


def _view_lengths(camera: Camera, bottom: bool) -> F64:
    """Return, for the rows of a buffer, how far it is to where z is 1: (H, W)."""
    (fx, fy), (cx, cy) = camera.scale_px, camera.centre_px
    x = (np.arange(camera.width) + 0.5 - cx) / fx
    y = (np.arange(camera.height) + 0.5 - cy) / fy
    lengths = np.sqrt(1.0 + x[None, :] ** 2 + y[:, None] ** 2)
    return lengths[::-1] if bottom else lengths


def _fits_bits(depth: NDArray[Any], bits: int) -> None:
    most = 2**bits - 1
    over = depth > most
    if over.any():
        expected = f"integers of {bits} bits, from 0 to {most} (a stencil has to be shifted out)"
        raise ArgumentError("depth", expected, _at(depth, over))


def _background(background: Any, depth: NDArray[Any]) -> Bool:
    """Return where the caller says that there is nothing."""
    if background is None:
        return np.zeros(depth.shape, np.bool_)
    if isinstance(background, np.ndarray):
        mask = _check.array("background", background, depth.shape, np.bool_)
        return np.asarray(mask, np.bool_)
    if isinstance(background, float | np.floating) and not np.isfinite(background):
        return np.asarray(np.isnan(depth) if np.isnan(background) else depth == background)
    try:
        value = _check.real("background", background)
    except ArgumentError as error:
        expected = "None, a number, or an array of bool like depth"
        raise ArgumentError("background", expected, error.got) from None
    with np.errstate(over="ignore"):  # one that the array's dtype cannot hold is nowhere in it
        return np.asarray(depth == value)


def _in_range(
    camera: Camera, depth: NDArray[Any], values: F64, half: F64, empty: Bool, how: Form
) -> None:
    """Raise, naming the first pixel and its value, unless all values can be depths."""
    if how.kind in OTHER:
        what = f"depths from 0 to 1, as kind {how.kind!r} has them"
        fits = (values >= 0.0) & (values <= 1.0)
    else:
        named = "z along the view" if how.kind == "linear" else "distances along the ray"
        what = f"{named}, from the near plane {camera.near:g} to the far plane {how.far:g}"
        along: Any = 1.0 if how.kind == "linear" else _view_lengths(camera, how.bottom)
        slack = 2.0 * half  # a surface on the plane itself, rounded by the engine
        with np.errstate(invalid="ignore"):
            fits = values >= camera.near * along - slack
            fits &= (values <= how.far * along + slack) & (values < np.inf)
    bad = ~fits & ~empty
    if bad.any():
        raise ArgumentError("depth", f"{what}, or background", _at(depth, bad))


def _at(depth: NDArray[Any], bad: Bool) -> str:
    """Say how many pixels are bad, and which is the first."""
    y, x = (int(k) for k in np.argwhere(bad)[0])
    count = int(np.count_nonzero(bad))
    return f"{depth[y, x]} at column {x}, row {y} of the array ({count} such pixels)"


def _not_the_other(screen: F64, how: Form) -> None:
    """Raise where nearly everything lies at the near plane, as if read as the wrong kind."""
    if np.quantile(screen, 0.05) > AT_NEAR:
        share = 100.0 * float((screen > AT_NEAR).mean())
        expected = "surfaces that do not all lie at the near plane"
        got = f"{share:.1f} % of them within a ninth of it; is it kind {OTHER[how.kind]!r}?"
        raise ArgumentError("depth", expected, got)
