"""Cameras from what others have: matrices of graphics libraries, calibrations of OpenCV."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from hybrid_rt import _check
from hybrid_rt.camera.camera import LARGEST_SIDE
from hybrid_rt.camera.orthographic import Orthographic
from hybrid_rt.camera.parts import vector_of
from hybrid_rt.camera.pinhole import Pinhole
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F64

ROUNDED = 1e-5
"""By how much a rotation's products, and an entry that should be 0 or 1, may be off: some roundings
of float32."""
NOTHING = 1e-9
"""An entry of a projection that should be 0 is no larger, relative to its row."""
ENDS = {"opengl": (-1.0, 1.0), "d3d": (0.0, 1.0), "vulkan": (0.0, 1.0)}
"""z / w in clip space of the two planes."""


class Lens(NamedTuple):
    """A projection: which way it looks along z of the view, and what the screen shows.

    A point (X, Y, z), with z along the view, is at ``ndc = scale * (X, Y) / w + shift``, with w = z
    or 1, and y down.
    """

    ahead: float
    parallel: bool
    scale: tuple[float, float]
    shift: tuple[float, float]
    near: float
    far: float


def camera_of(
    view: Any, projection: Any, width: int, height: int, convention: str
) -> Pinhole | Orthographic:
    """Return the camera of `Camera.from_matrices`."""
    _check.choice("convention", convention, tuple(ENDS))
    rotation, shift = _rigid(_finite("view", view))
    lens = _lens(_finite("projection", projection), convention)
    columns = _check.integer("width", width, least=1, most=LARGEST_SIDE)
    rows = _check.integer("height", height, least=1, most=LARGEST_SIDE)
    # A negative scale turns the axis, not the number.
    across, down = lens.scale
    eye, forward = vector_of(-shift @ rotation), vector_of(lens.ahead * rotation[2])
    right = vector_of(math.copysign(1.0, across) * rotation[0])
    up = vector_of(math.copysign(1.0, -down) * rotation[1])
    fx, fy = 0.5 * columns * abs(across), 0.5 * rows * abs(down)
    shift_px = 0.5 * columns * lens.shift[0], 0.5 * rows * lens.shift[1]
    if lens.parallel:
        return Orthographic(
            eye,
            right,
            up,
            forward,
            width,
            height,
            lens.near,
            rows / fy,
            lens.far,
            fx / fy,
            shift_px,
        )
    return Pinhole(
        eye, right, up, forward, width, height, lens.near, _degrees(rows, fy), fx / fy, shift_px,
        lens.far,
    )  # fmt: skip


def calibrated(
    intrinsics: Any, rotation: Any, translation: Any, width: int, height: int, near: float
) -> Pinhole:
    """Return the camera of `Camera.from_intrinsics`."""
    k = _finite("K", intrinsics, (3, 3))
    turned = _rotation("R", _finite("R", rotation, (3, 3)), "R")
    if np.linalg.det(turned) < 0:
        raise ArgumentError("R", "a rotation", "a rotation with a reflection (its det is -1)")
    t = _column("t", translation)
    if k[0, 1] != 0.0:
        raise ArgumentError("K", "no skew, K[0, 1] = 0", f"a skew of {k[0, 1]:g}")
    if k[1, 0] != 0.0 or (k[2] != (0.0, 0.0, 1.0)).any():
        raise ArgumentError("K", "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]", _rows_of(k))
    fx, fy = float(k[0, 0]), float(k[1, 1])
    if not (fx > 0.0 and fy > 0.0):
        raise ArgumentError("K", "focal lengths K[0, 0] and K[1, 1] > 0", f"{fx:g} and {fy:g}")
    columns = _check.integer("width", width, least=1, most=LARGEST_SIDE)
    rows = _check.integer("height", height, least=1, most=LARGEST_SIDE)
    # Centres of pixels are whole numbers there, and halves here.
    shift_px = k[0, 2] + 0.5 - 0.5 * columns, k[1, 2] + 0.5 - 0.5 * rows
    return Pinhole(
        vector_of(-t @ turned),
        vector_of(turned[0]),
        vector_of(-turned[1]),
        vector_of(turned[2]),
        width=width,
        height=height,
        near=near,
        vfov_deg=_degrees(rows, fy),
        aspect=fx / fy,
        shift_px=(float(shift_px[0]), float(shift_px[1])),
    )


def _degrees(rows: int, fy: float) -> float:
    return math.degrees(2.0 * math.atan(0.5 * rows / fy))


def _rows_of(matrix: F64) -> str:
    rows = ("[" + ", ".join(f"{x:g}" for x in row) + "]" for row in matrix)
    return "[" + ", ".join(rows) + "]"


def _finite(argument: str, value: Any, shape: tuple[int, ...] = (4, 4)) -> F64:
    matrix = np.asarray(_check.array(argument, value, shape, np.float64))
    if not np.isfinite(matrix).all():
        raise ArgumentError(argument, "finite numbers", "an infinity or NaN")
    return matrix


def _column(argument: str, value: Any) -> F64:
    """Return three numbers, which may stand below each other."""
    shape = (3, 1) if isinstance(value, np.ndarray) and value.shape == (3, 1) else (3,)
    return _finite(argument, value, shape).reshape(3)


def _rotation(argument: str, matrix: F64, what: str) -> F64:
    """Return the orthonormal matrix nearest to one that is, but for rounding."""
    expected = f"orthonormal rows, within {ROUNDED:g}"
    with np.errstate(over="ignore", invalid="ignore"):
        products = matrix @ matrix.T
    off = np.abs(products - np.eye(3)).max()
    if not off <= ROUNDED:
        lengths = np.sqrt(np.diag(products))
        square = np.abs(products - np.diag(np.diag(products))).max() <= ROUNDED * lengths.max() ** 2
        how = "scales" if square else "shears, or is no rotation"
        sizes = ", ".join(f"{x:g}" for x in lengths)
        raise ArgumentError(argument, expected, f"{what} that {how}: rows of lengths {sizes}")
    u, _, v = np.linalg.svd(matrix)
    return np.asarray(u @ v)


def _rigid(view: F64) -> tuple[F64, F64]:
    """Return the rotation and the translation of a view matrix."""
    last = np.array([0.0, 0.0, 0.0, 1.0])
    expected = "a last row of (0, 0, 0, 1), for column vectors"
    if (np.abs(view[3] - last) > ROUNDED).any():
        if (np.abs(view[:, 3] - last) <= ROUNDED).all():
            raise ArgumentError("view", expected, "a matrix for row vectors: transpose it")
        raise ArgumentError("view", expected, _rows_of(view[3:]))
    return _rotation("view", view[:3, :3], "a matrix"), view[:3, 3]


def _zero(projection: F64, places: list[tuple[int, int]], what: str) -> None:
    """Raise, naming what it would be, unless entries are 0 beside the others of their row."""
    for i, j in places:
        if abs(projection[i, j]) > NOTHING * np.abs(projection[i]).max():
            expected = f"no {what}: 0 at [{i}, {j}]"
            raise ArgumentError("projection", expected, f"{projection[i, j]:g}")


def _is_unit(row: F64, k: int) -> bool:
    """Is a row 0 but for its entry k, and that 1; or -1, which only perspective has."""
    rest = np.abs(np.delete(row, k)).max()
    one = row[k] if k == 3 else abs(row[k])
    return bool(rest <= NOTHING and abs(one - 1.0) <= NOTHING)


def _lens(projection: F64, convention: str) -> Lens:
    """Return what a projection matrix is, or raise."""
    last = projection[3]
    parallel = _is_unit(last, 3)
    if not (parallel or _is_unit(last, 2)):
        column = projection[:, 3]
        expected = "a last row of (0, 0, -1, 0), (0, 0, 1, 0) or (0, 0, 0, 1), for column vectors"
        if _is_unit(column, 2) or _is_unit(column, 3):
            raise ArgumentError("projection", expected, "a matrix for row vectors: transpose it")
        raise ArgumentError("projection", expected, _rows_of(projection[3:]))
    _zero(projection, [(0, 1), (1, 0)], "shear of the screen")
    _zero(projection, [(2, 0), (2, 1)], "oblique near plane")
    if projection[0, 0] == 0.0 or projection[1, 1] == 0.0:
        raise ArgumentError("projection", "no 0 at [0, 0] and [1, 1]", "a screen of no size")
    if parallel:
        _zero(projection, [(0, 2), (1, 2)], "oblique lines of sight")
        ahead = _ahead(projection, convention)
        shift = projection[:2, 3]
    else:
        _zero(projection, [(0, 3), (1, 3)], "translation of a perspective view")
        ahead = math.copysign(1.0, last[2])
        shift = ahead * projection[:2, 2]
    near, far = _planes(projection, parallel, ahead, convention)
    # Down on the screen is down in clip space, or up: then y changes its sign.
    upright = -1.0 if projection[1, 1] > 0.0 and convention != "vulkan" else 1.0
    return Lens(
        ahead,
        parallel,
        (float(projection[0, 0]), float(upright * projection[1, 1])),
        (float(shift[0]), float(upright * shift[1])),
        near,
        far,
    )


def _ends(projection: F64, convention: str) -> list[float]:
    """Return z of the view, any sign, at the two ends of an orthographic clip space."""
    a, b = float(projection[2, 2]), float(projection[2, 3])
    if a == 0.0:
        raise ArgumentError("projection", "planes apart from each other", "0 at [2, 2]")
    return [(end - b) / a for end in ENDS[convention]]


def _ahead(projection: F64, convention: str) -> float:
    """Return which way an orthographic projection looks along z of the view: 1 or -1."""
    first, second = _ends(projection, convention)
    if min(first, second) >= 0.0:
        return 1.0
    # In OpenGL views look along -z. Elsewhere both is usual, and only where the planes are tells.
    if max(first, second) <= 0.0 or convention == "opengl":
        return -1.0
    raise ArgumentError(
        "projection",
        "near and far planes on one side of the eye, which tells the way that it looks",
        f"planes at z = {first:g} and {second:g}",
    )


def _planes(projection: F64, parallel: bool, ahead: float, convention: str) -> tuple[float, float]:
    """Return the distances of the near and the far plane along the view."""
    if parallel:
        near, far = sorted(ahead * z for z in _ends(projection, convention))
        return near, far
    # z / w = (a z + b) / z for a distance z.
    a, b = float(ahead * projection[2, 2]), float(projection[2, 3])
    found = []
    for end in ENDS[convention]:
        z = b / (end - a) if end != a else math.inf
        # A far plane at infinity, by a number that rounding has moved beyond it.
        found.append(math.inf if z < 0.0 and abs(end - a) <= ROUNDED else z)
    near, far = sorted(found)
    if not (0.0 < near < far):
        low = "-w" if ENDS[convention][0] < 0.0 else "0"
        raise ArgumentError(
            "projection",
            f"near and far planes ahead of the eye, with z from {low} to w ({convention!r})",
            f"planes at {near:g} and {far:g}",
        )
    return near, far
