"""What is true of a ray and a few triangles, found without any tracer.

Rays and vertices are float32 and taken as exact. Every triangle is tried. Float64 decides where its
error bound allows that, and rational arithmetic where it does not; only which of two hits less than
an ulp of float64 apart is the nearer stays open.

A tracer in float32 cannot know more than the ray to within its rounding: `SLACK` times the largest
coordinate of the triangle's corners *relative to the origin* (whoever subtracts the origin first
errs by no more, however far from 0 the scene lies). What may be answered is what is true of some
ray that is shifted sideways by at most that much:

- a triangle that the ray hits, or passes as closely, with t in the interval that follows: the
  shift over the sine of the angle between ray and plane, and more for a needle, whose plane its
  rounded corners tilt;
- what lies behind it, if the shifted ray misses it: so at the outline of an object the object and
  its background are both right, while at an edge inside a closed mesh only the triangles that
  share it are;
- what lies behind a triangle whose interval holds `t_near` or `t_far`, and so may not count;
- a miss, if nothing of this kind is left.

A triangle that the ray lies in, edge-on, or that has no area is never hit; the former may be.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt.kernels.arrays import F64, I32, I64, Bool

SLACK = 8 * 2.0**-24
"""Of float32: eight half units in the last place, as in `hybrid_rt.judging.metrics`."""
_DOUBTFUL = 64 * 2.0**-53
# A sheared corner errs by 5 e r and is at most 2 r large, with e = 2**-53 and r the largest
# relative coordinate: an edge function, a difference of two products of such, errs by less than
# 2 (2 r 10 e r) + 8 e r**2 < 64 e r**2.
_CHUNK = 1 << 17

_UNIT = 2**149
Whole = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Truth:
    """What is true of each of N rays among F triangles, and what may be answered.

    Attributes
    ----------
    prim_id : (N,) int32
        The nearest triangle, of equally near ones the first; -1 for a miss.
    t : (N,) float64
        Where it is hit; infinity for a miss.
    may_hit : (N, F) bool
        Triangles that may be answered.
    t_low, t_high : (N, F) float64
        The interval of t of such an answer; NaN elsewhere.
    may_miss : (N,) bool
        Whether a miss may be answered.
    """

    prim_id: I32
    t: F64
    may_hit: Bool
    t_low: F64
    t_high: F64
    may_miss: Bool

    @property
    def ambiguous(self) -> Bool:
        """(N,) bool: whether float32 leaves more than one answer."""
        return np.asarray(self.may_hit.sum(axis=1) + self.may_miss > 1)

    def __len__(self) -> int:
        return len(self.prim_id)


def truth(scene: hrt.Scene, rays: hrt.Rays) -> Truth:
    """Return what is true of `rays` in `scene`; memory and time grow with rays times triangles.

    A ray with a NaN, an infinity or a zero direction, or with ``t_near > t_far``, hits nothing.
    """
    corners = scene.vertices[scene.faces].astype(np.float64)
    n, f = len(rays), len(corners)
    result = Truth(
        np.full(n, -1, np.int32), np.full(n, np.inf), np.zeros((n, f), np.bool_),
        np.full((n, f), np.nan), np.full((n, f), np.nan), np.ones(n, np.bool_),
    )  # fmt: skip
    finite = np.isfinite(rays.origin).all(axis=1) & np.isfinite(rays.direction).all(axis=1)
    some = (rays.direction != 0).any(axis=1) & (rays.t_near <= rays.t_far)
    index = np.flatnonzero(finite & some)
    step = max(1, _CHUNK // f)
    for first in range(0, len(index), step):
        _fill(result, index[first : first + step], rays, corners)
    return result


def _fill(result: Truth, at: Any, rays: hrt.Rays, corners: F64) -> None:
    """Write the rows `at` of `result`."""
    o, d = rays.origin[at].astype(np.float64), rays.direction[at].astype(np.float64)
    near, far = rays.t_near[at].astype(np.float64), rays.t_far[at].astype(np.float64)
    limits = near[:, None], far[:, None]
    met = _meet(o, d, corners[None])
    length = np.linalg.norm(d, axis=1)[:, None]
    slack = SLACK * met.reach
    low, high = _interval(met, slack, length)
    touched = np.asarray((met.hit | (met.distance <= slack)) & met.area)
    touched &= (high >= limits[0]) & (low <= limits[1])
    hit: Bool = np.asarray(met.hit & met.area)
    t = met.t.copy()
    at_limit = ((low <= limits[0]) & (high >= limits[0])) | (
        (low <= limits[1]) & (high >= limits[1])
    )
    for i, k in np.argwhere((met.doubtful | at_limit | (met.needle > 1e4)) & touched):
        exact = _exact_t(o[i], d[i], corners[k])
        hit[i, k] = exact is not None and near[i] <= exact <= far[i]
        if exact is not None:
            t[i, k] = float(exact)
    hit &= (t >= limits[0]) & (t <= limits[1]) & touched
    low, high = np.fmin(low, np.where(hit, t, low)), np.fmax(high, np.where(hit, t, high))
    low, high = np.maximum(low, limits[0]), np.minimum(high, limits[1])

    t_hit = np.where(hit, t, np.inf)
    nearest = t_hit.argmin(axis=1)
    row = np.arange(len(at))
    result.t[at] = t_hit[row, nearest]
    result.prim_id[at] = np.where(hit.any(axis=1), nearest, -1)
    # A hit at a limit of t may be on either side of it.
    sure = hit & ~at_limit
    may_hit = touched & (low <= np.where(sure, high, np.inf).min(axis=1)[:, None])
    may_miss = ~sure.any(axis=1)
    # Only a ray that passes an outline closely may see past it.
    close = np.flatnonzero((may_hit & (met.margin <= slack)).any(axis=1))
    if len(close):
        shift = np.where(may_hit[close], slack[close], 0.0).max(axis=1)
        in_reach = met.area & (met.distance[close] <= 2 * shift[:, None])
        pairs = np.nonzero(in_reach)
        seen, missed = _seen_by_shifted(
            o[close], d[close], near[close], far[close], shift, corners, *pairs
        )
        # What a shifted ray sees of a triangle that the ray itself does not even graze is not true.
        may_hit[close] |= seen & touched[close]
        may_miss[close] |= missed
    result.may_hit[at], result.may_miss[at] = may_hit, may_miss
    result.t_low[at] = np.where(may_hit, low, np.nan)
    result.t_high[at] = np.where(may_hit, high, np.nan)


@dataclass(frozen=True, eq=False)
class _Met:
    """How rays (N,) and triangles (F,) meet in float64; every array broadcasts to (N, F)."""

    hit: Bool
    """The ray's line goes through the closed triangle."""
    doubtful: Bool
    """Float64 cannot tell whether it does."""
    area: Bool
    needle: F64
    """Longest edge by the height over it: how much a corner's error tilts the plane."""
    t: F64
    sine: F64
    """Of the angle between the ray and the triangle's plane."""
    reach: F64
    """The largest coordinate of a corner relative to the origin."""
    distance: F64
    """From the triangle to the ray across its main axis, 0 inside."""
    margin: F64
    """From the triangle's outline to the ray across its main axis."""
    first: F64
    last: F64
    """The part of the ray along which the triangle lies."""


def _interval(met: _Met, slack: F64, length: F64) -> tuple[F64, F64]:
    """Return between which t a triangle is met by a ray that is off by `slack`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        # SLACK does for a triangle up to 16 times as long as high; rounded corners tilt a needle.
        blur = slack * np.maximum(1, met.needle / 16) / (length * met.sine)
    blur += SLACK * np.abs(met.t)
    # A plane seen edge-on says nothing about t: the triangle's own length at most, and none of it
    # where the ray lies in the plane.
    margin = slack / length + SLACK * np.abs(met.t)
    extent = np.where(met.sine > 0, met.last - met.first, 0.0)
    low = np.maximum(met.t - blur, met.first - margin - extent)
    return low, np.minimum(met.t + blur, met.last + margin + extent)


def _meet(o: F64, d: F64, corners: F64) -> _Met:
    """Return how rays (N, 3) meet triangles: the same (1, F, 3, 3) for all, or (N, F, 3, 3)."""
    n = len(o)
    axis = np.abs(d).argmax(axis=1)
    order = (axis[:, None] + np.array([1, 2, 0])) % 3  # x, y across the main axis z
    row = np.arange(n)[:, None]
    slope = d[row, order[:, :2]] / d[row, order[:, 2:]]
    # (N, F, corner, coordinate), then permuted so that the main axis comes last
    world = corners - o[:, None, None]
    relative = np.take_along_axis(world, order[:, None, None, :], axis=3)
    flat = relative[..., :2] - slope[:, None, None] * relative[..., 2:]
    p, q = flat[:, :, [1, 2, 0]], flat[:, :, [2, 0, 1]]
    weight = p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
    whole = weight.sum(axis=2)
    same_side = (weight >= 0).all(axis=2) | (weight <= 0).all(axis=2)
    reach = np.abs(relative).max(axis=(2, 3))
    bound = _DOUBTFUL * reach**2
    along = relative[..., 2] / d[row, order[:, 2:]][:, :, None]
    normal = np.cross(
        corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    )
    size = np.linalg.norm(normal, axis=-1)
    longest2 = ((corners - np.roll(corners, 1, axis=2)) ** 2).sum(axis=3).max(axis=2)
    length = np.linalg.norm(d, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (weight * along).sum(axis=2) / whole
        sine = np.abs((normal * d[:, None]).sum(axis=-1)) / (length[:, None] * size)
        needle = longest2 / size
    margin = np.min([_to_segment(flat[:, :, i], flat[:, :, (i + 1) % 3]) for i in range(3)], axis=0)
    inside = same_side & (whole != 0)
    # Where the ray comes closest to a corner: |d| may be anything, so scale before squaring.
    unit = d / length[:, None]
    by_corner = (world * unit[:, None, None]).sum(axis=3) / length[:, None, None]
    return _Met(
        hit=inside,
        doubtful=(np.abs(weight) <= bound[:, :, None]).any(axis=2),
        area=_has_area(corners),
        needle=np.where(np.isfinite(needle), needle, 0.0),
        t=np.where(np.isfinite(t), t, 0.0),
        sine=np.where(np.isfinite(sine), sine, 0.0),
        reach=reach,
        distance=np.where(inside, 0.0, margin),
        margin=margin,
        first=by_corner.min(axis=2),
        last=by_corner.max(axis=2),
    )


def _to_segment(p: F64, q: F64) -> F64:
    """Return the distance from (0, 0) to segments (N, F, 2)."""
    edge = q - p
    length2 = (edge**2).sum(axis=-1)
    s = np.clip(-(p * edge).sum(axis=-1) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(p + s[..., None] * edge, axis=-1))


def _seen_by_shifted(
    o: F64, d: F64, near: F64, far: F64, shift: F64, corners: F64, ray: I64, triangle: I64
) -> tuple[Bool, Bool]:
    """Return (N, F) which triangles rays shifted sideways see first, and (N,) whether any misses.

    Sixteen shifts, far larger than the errors of float64. Pairs of `ray` and `triangle` (P,), in
    the order of rays, say which triangles a shifted ray can meet.
    """
    seen = np.zeros((len(o), len(corners)), np.bool_)
    missed = np.zeros(len(o), np.bool_)
    unit = d / np.linalg.norm(d, axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(unit).argmin(axis=1)]
    side = np.cross(unit, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(unit, side)
    for k in range(16):
        angle = 2 * np.pi * (k + 0.5) / 16
        moved = o + shift[:, None] * (np.cos(angle) * side + np.sin(angle) * other)
        met = _meet(moved[ray], d[ray], corners[triangle][:, None])
        t = np.where(met.hit & met.area, met.t, np.inf)[:, 0]
        t[(t < near[ray]) | (t > far[ray])] = np.inf
        nearest = np.full(len(o), np.inf)
        np.minimum.at(nearest, ray, t)
        first = np.isfinite(t) & (t == nearest[ray])
        seen[ray[first], triangle[first]] = True
        missed |= np.isinf(nearest)
    return seen, missed


def _has_area(corners: F64) -> Bool:
    """Return whether triangles (..., 3, 3) have an area, exactly."""
    a, b, c = (corners[..., k, :] for k in range(3))
    extent = np.ptp(corners, axis=-2).max(axis=-1)
    has = np.asarray((np.abs(np.cross(b - a, c - a)) > 2.0**-50 * extent[..., None] ** 2).any(-1))
    for index in zip(*np.nonzero(~has), strict=True):
        p, q, r = (_whole(corner) for corner in corners[index])
        has[index] = any(_cross(_sub(q, p), _sub(r, p)))
    return has


def _exact_t(origin: F64, direction: F64, triangle: F64) -> Fraction | None:
    """Return the exact t at which a ray's line meets a closed triangle, or None."""
    o, d = _whole(origin), _whole(direction)
    a, b, c = (_whole(p) for p in triangle)
    n = _cross(_sub(b, a), _sub(c, a))
    slope = _dot(n, d)
    if slope == 0:
        return None
    if slope < 0:
        n, slope = (-n[0], -n[1], -n[2]), -slope
    height = _dot(n, _sub(a, o))
    # The point times slope, which keeps it whole; n is that of the turned triangle if it was.
    p = tuple(o[k] * slope + height * d[k] for k in range(3))
    corners = (a, b, c) if _dot(n, _cross(_sub(b, a), _sub(c, a))) > 0 else (a, c, b)
    for k in range(3):
        start, end = corners[k], corners[(k + 1) % 3]
        from_start = (p[0] - start[0] * slope, p[1] - start[1] * slope, p[2] - start[2] * slope)
        if _dot(n, _cross(_sub(end, start), from_start)) < 0:
            return None
    return Fraction(height, slope)


def _whole(p: F64) -> Whole:
    """Return three float32 numbers times 2**149, which are whole."""
    x, y, z = (float(k).as_integer_ratio() for k in p)
    return (
        x[0] * (_UNIT // x[1]),
        y[0] * (_UNIT // y[1]),
        z[0] * (_UNIT // z[1]),
    )


def _sub(p: Whole, q: Whole) -> Whole:
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def _dot(p: Whole, q: Whole) -> int:
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def _cross(p: Whole, q: Whole) -> Whole:
    return (
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    )
