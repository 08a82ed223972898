"""Triangles from polygons, of whatever shape.

A polygon with n corners becomes n - 2 triangles around its first corner, as most readers do it,
wherever these do not overlap; else around the next corner for which that holds; else by
`mapbox_earcut`, Mapbox's ear cutting in C++, which is kept and used widely and takes concave
polygons and holes that a bridge connects to the rim. Earcut promises no right answer, hence its
triangles count only when their areas add up to the polygon's, the sum of cross products along its
rim. It leaves out corners that lie on a straight edge.

A polygon need not be plane: corners are judged along the normal that its rim has on average
(Newell). One without area, all corners on a line, becomes triangles without area. One that
crosses itself or goes around twice has no inside that files define, and is refused; so is one of
five or more corners that is concave and far from plane, of which every reader makes another
surface.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hybrid_rt.scene.io.fault import FormatError
from hybrid_rt.scene.io.words import F64, I64

_BLOCK = 1 << 18  # corners at a time
_BENT = 0.1  # distance from the mean plane, in units of the polygon's extent
_FANS = 12  # corners that are tried as the common one
# Twice an area that float64 differences leave uncertain, and that coordinates rounded to float32
# do, in units of (largest coordinate) x (extent of the polygon).
_SURE = 2.0**-48
_ROUNDED = 2.0**-21


def triangulate(
    vertices: F64, corners: I64, counts: I64, where: Callable[[int], str]
) -> tuple[I64, I64]:
    """Return the triangles of polygons, in their order.

    Parameters
    ----------
    vertices : (V, 3) float64
    corners : (C,) int64
        Indices into `vertices`, checked, of one polygon after the other.
    counts : (P,) int64
        How many corners each polygon has, >= 3.
    where : callable
        Takes the index of a polygon and says where in the file it is, for the message.

    Returns
    -------
    faces : (F, 3) int64
    polygon_id : (F,) int64
        From which polygon a triangle comes, ascending.

    Raises
    ------
    FormatError
        A polygon that crosses itself; coordinates that `Mesh` would refuse.
    """
    if len(counts) == 0 or (counts == 3).all():
        return corners.reshape(-1, 3), np.arange(len(counts))
    if np.abs(vertices).max() > np.finfo(np.float32).max:
        raise FormatError("polygons, and coordinates beyond float32")
    begin = np.cumsum(counts) - counts
    faces, owners = [], []
    for n in np.unique(counts).tolist():
        alike = np.flatnonzero(counts == n)
        step = max(1, _BLOCK // n)
        for some in np.split(alike, range(step, len(alike), step)):
            rims = corners[begin[some, None] + np.arange(n)]
            if n == 3:
                faces.append(rims)
                owners.append(some)
                continue
            for triangles, chosen in _alike(vertices, rims, some, where):
                faces.append(triangles)
                owners.append(chosen)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(faces)[order], owner[order]


def _alike(
    vertices: F64, rims: I64, index: I64, where: Callable[[int], str]
) -> list[tuple[I64, I64]]:
    """Return triangles of polygons with as many corners, and of which polygon each is."""
    n = rims.shape[1]
    points = vertices[rims]
    left = np.arange(len(rims))
    found = []
    for first in range(min(n if n > 4 else 2, _FANS)):  # a quad's other two are the same
        if len(left) == 0:
            break
        if first == 1 and n > 4:
            _refuse_bent(points[left], index[left], where)
        fits = _fan_fits(np.roll(points[left], -first, axis=1))
        chosen, left = left[fits], left[~fits]
        fan = (first + _fan(n)) % n
        found.append((rims[chosen][:, fan].reshape(-1, 3), np.repeat(index[chosen], n - 2)))
    for k in left.tolist():
        triangles = _one(points[k])
        if triangles is None:
            raise FormatError(
                f"{where(int(index[k]))}: a polygon of {n} corners that crosses itself"
            )
        found.append((rims[k][triangles], np.full(len(triangles), index[k])))
    return found


def _refuse_bent(points: F64, index: I64, where: Callable[[int], str]) -> None:
    """Raise for the first polygon (P, n, 3) that is far from plane: its triangles are a guess."""
    rim = points - points.mean(axis=1, keepdims=True)
    normal = np.cross(rim, np.roll(rim, -1, axis=1)).sum(axis=1)
    length = np.linalg.norm(normal, axis=1)
    away = np.abs(np.einsum("pkc,pc->pk", rim, normal)).max(axis=1)
    bent = away > _BENT * length * np.abs(rim).max(axis=(1, 2))
    bent &= length > _doubt(points, _ROUNDED)  # else there is no plane to speak of
    if bent.any():
        k = int(np.argmax(bent))
        what = f"a polygon of {points.shape[1]} corners that is concave and far from plane"
        raise FormatError(f"{where(int(index[k]))}: {what}")


def _fan(n: int) -> I64:
    k = np.arange(1, n - 1)
    return np.stack([np.zeros_like(k), k, k + 1], axis=1)


def _doubt(points: F64, unit: float) -> F64:
    """Return twice the area that is uncertain in each polygon; points are (..., n, 3)."""
    span = np.abs(points - points[..., :1, :]).max(axis=(-2, -1))
    return np.asarray(unit * np.abs(points).max(axis=(-2, -1)) * span)


def _fan_fits(points: F64) -> NDArray[np.bool_]:
    """Return for which polygons (P, n, 3) the fan around the first corner does not overlap."""
    rim = points[:, 1:] - points[:, :1]
    crosses = np.cross(rim[:, :-1], rim[:, 1:])
    normal = crosses.sum(axis=1)
    length = np.linalg.norm(normal, axis=1)
    doubt = _doubt(points, _SURE)
    up = normal / np.maximum(length, np.finfo(np.float64).tiny)[:, None]
    signed = np.einsum("pkc,pc->pk", crosses, up)
    turned = np.arctan2(signed, np.einsum("pkc,pkc->pk", rim[:, :-1], rim[:, 1:])).sum(axis=1)
    once = turned <= 2 * np.pi + 1e-9
    fits = (length > doubt) & (signed >= -doubt[:, None]).all(axis=1) & once
    return np.asarray(fits & ~_goes_around_again(points, up))


def _goes_around_again(points: F64, up: F64) -> NDArray[np.bool_]:
    """Return which rims (P, n, 3) turn twice or more: those of no simple polygon do.

    Where a rim turns back it could have turned either way; the way that counts less is taken.
    """
    along = np.roll(points, -1, axis=1) - points
    after = np.roll(along, -1, axis=1)
    sine = np.einsum("pkc,pc->pk", np.cross(along, after), up)
    angle = np.arctan2(sine, np.einsum("pkc,pkc->pk", along, after))
    angle[angle > np.pi - 1e-6] = -np.pi
    return np.asarray(angle.sum(axis=1) > 3 * np.pi)


def _one(points: F64) -> I64 | None:
    """Return triangles (F, 3) of a polygon (n, 3) that is no fan, or None if it crosses itself."""
    import mapbox_earcut  # only files with such polygons need it

    n = len(points)
    rim = points[1:] - points[:1]
    crosses = np.cross(rim[:-1], rim[1:])
    normal = crosses.sum(axis=0)
    loose = float(_doubt(points, _ROUNDED))
    if np.linalg.norm(crosses, axis=1).sum() <= loose:
        return _fan(n)  # nothing but a line
    if _goes_around_again(points[None], normal[None])[0]:
        return None
    axis = int(np.argmax(np.abs(normal)))
    twice = float(normal[axis])
    if abs(twice) <= float(_doubt(points, _SURE)):
        return None
    flat = np.ascontiguousarray(np.delete(rim, axis, axis=1) if axis != 1 else rim[:, [2, 0]])
    flat = np.concatenate([np.zeros((1, 2)), flat])
    cut = mapbox_earcut.triangulate_float64(flat, np.array([n], np.uint32))
    best: I64 = np.asarray(cut, np.int64).reshape(-1, 3)
    areas = _twice_areas(flat, best)
    if areas.sum() * twice < 0:
        best = best[:, [0, 2, 1]]
    excess = abs(np.abs(areas).sum() - abs(twice))
    for first in (0, 1):
        if excess <= n * float(_doubt(points, _SURE)):
            break
        fan = (first + _fan(n)) % n
        other = abs(np.abs(_twice_areas(flat, fan)).sum() - abs(twice))
        if other < excess:
            best, excess = fan, other
    return best if excess <= loose and _left_out_is_straight(points, best, loose) else None


def _left_out_is_straight(points: F64, triangles: I64, loose: float) -> bool:
    """Return whether corners without triangles lie between their neighbours, as space has them."""
    used = np.zeros(len(points), bool)
    used[triangles] = True
    kept = np.flatnonzero(used)
    for k in np.flatnonzero(~used).tolist():
        place = int(np.searchsorted(kept, k))
        before, after = points[kept[place - 1]], points[kept[place % len(kept)]]
        if np.linalg.norm(np.cross(points[k] - before, after - before)) > loose:
            return False
    return True


def _twice_areas(flat: F64, triangles: I64) -> F64:
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
