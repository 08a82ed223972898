"""The truth about rays and a scene: what lies nearest, decided without any doubt.

Rays and vertices are float32 and taken as exact. A triangle is

- *hit*: the ray passes through the closed triangle with t_near <= t <= t_far;
- *grazed*: not hit, but the ray passes its edge within ``8 * 2**-24`` times the largest coordinate
  of the origin and the triangle, or t exceeds a limit by as little as ``8 * 2**-24 * |t|`` and that
  distance over |direction|. A tracer in float32 cannot tell a grazed triangle from a hit one;
- *missed* otherwise. A triangle of exactly zero area is always missed, and one that is seen exactly
  edge-on is never hit.

Whether a triangle is hit, and which of two hits is nearer, is a fact, and is found exactly. How far
a graze reaches is a convention, and is decided in plain float64.

How it is found. With a, b, c the corners less the origin, each rounded once, a ray along d passes
inside the triangle if d.(c x b), d.(a x c) and d.(b x a) do not differ in sign, and meets its plane
at t = a.n / d.n, n = (b - a) x (c - a). All five are sums of six products of three factors. With
e = 2**-53, no term suffers more than eight roundings (up to three factors that are differences,
two products, three sums), so that a value errs by less than 8 e / (1 - 8 e) of the sum of its
terms' sizes, and by less than 16 e of that sum as computed. Nothing overflows or underflows:
products of three float32 lie between 2**-447 and 2**387. From the errors E of a.n and F of d.n
follows that of t: (E + |t| F) / (|d.n| - F), and 4 e |t| for the roundings of the quotient and of
the ends of the interval. A sign is certain if the value exceeds its bound, an order if two
intervals do not overlap.

Where a sign, an order, or the place of t between the limits is not certain, and where t is known
to no better than 2**-30 of itself, the triangles in question are met again in exact rational
arithmetic. Triangles with the same three corners need none to be known to tie.

No triangle is overlooked: boxes of the tree are exact, and are grown, for each ray, by a graze's
reach of 2**-21 of the largest coordinate of scene and origin and another 2**-20 of that, where the
rounding of the slabs can move a plane by no more than 2**-49 of the same.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt._record import writable
from hybrid_rt.errors import ArgumentError
from hybrid_rt.judging import exact as _exact
from hybrid_rt.judging.bvh import Bvh, build_bvh
from hybrid_rt.kernels.arrays import F32, F64, I32, U8, Bool
from hybrid_rt.kernels.judging import truth as kernels
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene

MISSED, GRAZED, HIT = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Nearest:
    """The nearest hit of each ray.

    Attributes
    ----------
    prim_id : (N,) int32
        -1 for a miss; of equal t the least.
    t : (N,) float64
        Infinity for a miss.
    t_error : (N,) float64
        Bound of the error of t, at most ``2**-30 * |t|``.
    t_grazed : (N,) float64
        Where the nearest grazed triangle is met that lies in front of t; infinity for none. A ray
        that starts on a surface, but for float32's rounding, grazes it at its start.
    exact : (N,) bool
        Whether exact arithmetic was needed.
    """

    prim_id: I32
    t: F64
    t_error: F64
    t_grazed: F64
    exact: Bool

    def __len__(self) -> int:
        return len(self.t)


class Truth:
    """What rays truly meet in a scene; the definitions are those of the module's docstring.

    Parameters
    ----------
    scene : Scene
    threads : int, optional
        Default: as many as `numba.get_num_threads` says at each call.

    Notes
    -----
    The tree is built when first needed, in seconds for a million triangles, and kept. A ray with a
    NaN, an infinity or a zero direction hits nothing. Results are bit for bit the same for any
    number of threads.
    """

    def __init__(self, scene: Scene, *, threads: int | None = None) -> None:
        _check.instance("scene", scene, Scene)
        _threads.count(threads)
        self._scene, self._threads = scene, threads
        self._vertices, self._faces, _ = scene.arrays

    @property
    def scene(self) -> Scene:
        """What the truth is about."""
        return self._scene

    def nearest(self, rays: Rays) -> Nearest:
        """Return the nearest hit of each ray, among all triangles.

        Parameters
        ----------
        rays : Rays
            N rays, also none.

        Returns
        -------
        Nearest
        """
        _check.instance("rays", rays, Rays)
        n = len(rays)
        prim_id, sure = np.empty(n, np.int32), np.empty(n, np.uint8)
        t, error, grazed = np.empty(n), np.empty(n), np.empty(n)
        with _threads.limited(self._threads):
            kernels.nearest(
                *_limited(rays),
                self._vertices, self._faces, self._largest,
                self._bvh.prim_id, self._bvh.box, self._bvh.link,
                prim_id, t, error, grazed, sure,
            )  # fmt: skip
        unsure = sure != kernels.YES
        for i in np.flatnonzero(unsure):
            prim_id[i], t[i], error[i], grazed[i] = self._settle(rays, int(i))
        return Nearest(prim_id, t, error, grazed, np.asarray(unsure))

    def touch(self, rays: Rays, prim_id: Any) -> tuple[U8, F64]:
        """Return how each ray meets the triangle named for it.

        Parameters
        ----------
        rays : Rays
            N rays.
        prim_id : (N,) array_like of int
            -1 for no triangle.

        Returns
        -------
        state : (N,) uint8
            `HIT`, `GRAZED` or `MISSED`.
        t : (N,) float64
            Good to ``2**-30 * |t|`` where it is hit; NaN where it is missed.

        Raises
        ------
        ArgumentError
            A prim_id that the scene does not have.
        """
        _check.instance("rays", rays, Rays)
        named = self._named(prim_id, len(rays))
        n = len(rays)
        hit, t, error, grazed = np.empty(n, np.uint8), np.empty(n), np.empty(n), np.empty(n)
        area = self._area
        with _threads.limited(self._threads):
            kernels.touch(
                *_limited(rays), named,
                self._vertices, self._faces, area, hit, t, error, grazed,
            )  # fmt: skip
        for i in np.flatnonzero(hit == kernels.UNSURE):
            exact = _exact.intersect(*_exact_ray(rays, int(i)), self._corners(int(named[i])))
            hit[i] = kernels.NO if exact is None else kernels.YES
            t[i] = 0.0 if exact is None else float(exact)
        is_hit = hit == kernels.YES
        state = np.where(is_hit, HIT, np.where(np.isnan(grazed), MISSED, GRAZED))
        return state.astype(np.uint8), np.where(is_hit, t, grazed)

    def tolerance(self, rays: Rays, prim_id: Any, t: Any) -> F64:
        """Return within how much of t another hit counts as the same: (N,) float64.

        ``8 * 2**-24 * (|t| + largest coordinate of origin and triangle / |direction|)``, and 0 for
        no triangle.
        """
        _check.instance("rays", rays, Rays)
        named = self._named(prim_id, len(rays))
        at = _check.array("t", t, ("N",), np.float64)
        _check.same_length("t", at, "rays", len(rays))
        reach = np.empty(len(rays))
        with _threads.limited(self._threads):
            kernels.reach(
                *rays.arrays[:2], named, self._vertices, self._faces, reach
            )  # fmt: skip
        return np.where(named >= 0, kernels.TOUCH * np.abs(at) + reach, 0.0)

    def _named(self, prim_id: Any, n: int) -> I32:
        named: I32 = _check.array("prim_id", prim_id, ("N",), np.int32)
        _check.same_length("prim_id", named, "rays", n)
        if n and not (named.min() >= -1 and named.max() < len(self._scene)):
            bad = named[(named < -1) | (named >= len(self._scene))]
            raise ArgumentError("prim_id", f"from -1 to {len(self._scene) - 1}", str(bad[0]))
        return writable(named)

    @functools.cached_property
    def _area(self) -> Bool:
        """(F,) bool: the triangles that have an area."""
        kind = np.empty(len(self._scene), np.uint8)
        with _threads.limited(self._threads):
            kernels.area(self._vertices, self._faces, kind)
        area = np.asarray(kind == kernels.YES)
        for i in np.flatnonzero(~area):
            area[i] = _exact.has_area(*self._corners(int(i)))
        return area

    @functools.cached_property
    def _bvh(self) -> Bvh:
        with _threads.limited(self._threads):
            ids = np.flatnonzero(self._area).astype(np.int32)
            return build_bvh(self._vertices, self._faces, ids)

    @functools.cached_property
    def _largest(self) -> float:
        return float(np.abs(self._vertices).max())

    def _settle(self, rays: Rays, i: int) -> tuple[int, float, float, float]:
        """Return (prim_id, t, bound of its error, nearest graze) of ray i in exact arithmetic."""
        room = 64
        while True:
            met, met_graze = np.empty(room, np.int32), np.empty(room)
            count = kernels.gather(
                i, *_limited(rays),
                self._vertices, self._faces, self._largest,
                self._bvh.prim_id, self._bvh.box, self._bvh.link, met, met_graze,
            )  # fmt: skip
            if count <= room:
                break
            room = count
        best: tuple[Fraction, int] | None = None
        grazed = math.inf
        ray = _exact_ray(rays, i)
        for prim, graze in zip(met[:count].tolist(), met_graze[:count].tolist(), strict=True):
            t = _exact.intersect(*ray, self._corners(prim))
            if t is not None:
                best = (t, prim) if best is None else min(best, (t, prim))
            elif graze < grazed:
                grazed = graze
        if best is None:
            return -1, math.inf, 0.0, grazed
        t_best = float(best[0])
        return best[1], t_best, 2.0**-53 * abs(t_best), grazed if grazed < t_best else math.inf

    def _corners(self, prim: int) -> tuple[_exact.Vector, _exact.Vector, _exact.Vector]:
        a, b, c = (_exact.vector(p) for p in self._vertices[self._faces[prim]])
        return a, b, c


def _exact_ray(rays: Rays, i: int) -> tuple[_exact.Vector, _exact.Vector, float, float]:
    origin, direction = _exact.vector(rays.origin[i]), _exact.vector(rays.direction[i])
    return origin, direction, float(rays.t_near[i]), float(rays.t_far[i])


def _limited(rays: Rays) -> tuple[F32, F32, F32, F32]:
    """Return what the truth looks at of rays: origins, directions and limits."""
    origin, direction, _, t_near, t_far = rays.arrays
    return origin, direction, t_near, t_far
