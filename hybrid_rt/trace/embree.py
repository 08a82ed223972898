"""Trace rays with Embree."""

from __future__ import annotations

import functools
import time
from typing import Any

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.base import ANY, NEAREST, register
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import I32, Bool
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene
from hybrid_rt.trace.embreex import EmbreexScene
from hybrid_rt.trace.native import QUALITIES, WIDTHS, NativeScene, Way
from hybrid_rt.trace.rows import checked_rays, checked_some, rows_at, writable_hits

PATHS = ("packet", "run")
ORDERS = ("given", "direction")

# Embree's float32 products of coordinates leave its range beyond about 2**-45 and 2**45, and it
# answers with misses; see test_scenes_beyond_the_range_of_embree_are_refused.
SMALLEST_SCENE, LARGEST_SCENE = 2.0**-40, 2.0**40


@register
class EmbreeTracer:
    """Nearest hits by Embree.

    Parameters
    ----------
    scene : Scene
    threads : int, optional
        Threads that trace, and that build where Embree lets one choose. Default: as many as
        `numba.get_num_threads` says at each call.
    path : {"packet", "run"}
        "packet" calls Embree's own 1, 4, 8 or 16 wide queries from a compiled loop. "run" is
        embreex's call, one ray at a time, in chunks over a thread pool.
    width : {1, 4, 8, 16}
        Rays in a packet, for path "packet".
    robust : bool
        Embree's robust mode: edges shared by triangles let fewer rays through.
    coherent : bool
        Tell Embree that neighbouring rays are alike, for path "packet": it then takes a packet
        through its BVH as a whole.
    order : {"given", "direction"}
        Which rays share a packet, for path "packet": neighbours, or, of every 2048 neighbours,
        those that go the same way. The hits stay in the order of the rays.
    build_quality : {"high", "medium", "low"}
        Of Embree's BVH, for path "packet"; embreex always builds with "medium".

    Raises
    ------
    ArgumentError
        An option that is not one of those above; a scene so large or so small (beyond 2**40 or
        2**-40) that Embree's arithmetic overflows or underflows.
    EmbreeError
        Path "packet" where the library cannot be reached (see `embree_problem`), or an error that
        Embree reports.

    Notes
    -----
    A ray with a NaN, an infinity or a zero direction hits nothing, and neither does one with
    ``t_near > t_far``. Hits are bit for bit the same for any number of threads.

    Path "packet" gives t_near and t_far to Embree. Robust mode takes ``t_near <= t <= t_far``; the
    default mode takes ``t_near < t``. In both, t carries Embree's rounding (about 3e-7 relative),
    so a surface that lies this near to a limit may fall on either side of it.

    Path "run" has tnear fixed at 0 in embreex. A ray whose nearest hit lies before its t_near is
    traced again from ``origin + t_near * direction``, summed in float64 and rounded to float32.
    Such a ray is displaced by up to half an ulp of each coordinate, and may meet a surface at its
    new origin that the true ray left behind. Rays whose nearest hit is not before t_near, which are
    nearly all when t_near is a distance proven free, are exact.
    """

    name = "embree"
    description = "Embree's BVH, in packets of 1, 4, 8 or 16 rays"
    queries = frozenset({NEAREST, ANY})

    def __init__(
        self,
        scene: Scene,
        *,
        threads: int | None = None,
        path: str = "packet",
        width: int = 8,
        robust: bool = True,
        coherent: bool = False,
        order: str = "given",
        build_quality: str = "high",
    ) -> None:
        _check.instance("scene", scene, Scene)
        _check.choice("build_quality", build_quality, QUALITIES)
        robust = _check.boolean("robust", robust)
        largest = float(np.abs(scene.vertices).max())
        if largest != 0 and not SMALLEST_SCENE <= largest <= LARGEST_SCENE:
            raise ArgumentError(
                "scene",
                f"a largest coordinate from {SMALLEST_SCENE:g} to {LARGEST_SCENE:g}",
                f"{largest:g}",
            )
        self._bvh = _Bvh(scene, _threads.count(threads), robust, build_quality)
        self._set_path(path, width, coherent, order, threads)

    def with_path(
        self,
        path: str | None = None,
        *,
        width: int | None = None,
        coherent: bool | None = None,
        order: str | None = None,
        threads: int | None = None,
    ) -> EmbreeTracer:
        """Return a tracer of the same scene that goes another way.

        What is not given stays. Nothing is built again, except by the first tracer of path "run",
        since embreex keeps a scene of its own.
        """
        other = object.__new__(EmbreeTracer)
        other._bvh = self._bvh
        other._set_path(
            self.path if path is None else path,
            self.width if width is None else width,
            self.coherent if coherent is None else coherent,
            self.order if order is None else order,
            self._threads if threads is None else threads,
        )
        return other

    def _set_path(
        self, path: str, width: int, coherent: bool, order: str, threads: int | None
    ) -> None:
        _threads.count(threads)
        self._threads = threads
        self._path = str(_check.choice("path", path, PATHS))
        self._width = _check.integer("width", width, least=1, most=max(WIDTHS))
        _check.choice("width", self._width, WIDTHS)
        self._coherent = _check.boolean("coherent", coherent)
        self._order = str(_check.choice("order", order, ORDERS))
        self._bvh.build(self._path)

    @property
    def _way(self) -> Way:
        return Way(self._width, self._coherent, self._order == "direction")

    @property
    def path(self) -> str:
        """How Embree is called: "packet" or "run"."""
        return self._path

    @property
    def width(self) -> int:
        """Rays in a packet."""
        return self._width

    @property
    def coherent(self) -> bool:
        """Whether Embree is told that neighbouring rays are alike."""
        return self._coherent

    @property
    def order(self) -> str:
        """Which rays share a packet: "given" for neighbours, or "direction"."""
        return self._order

    @property
    def robust(self) -> bool:
        """Whether Embree's robust mode is on."""
        return self._bvh.robust

    @property
    def build_quality(self) -> str:
        """The quality asked of Embree's BVH."""
        return self._bvh.quality

    @property
    def threads(self) -> int:
        """Threads that the next call will use."""
        return _threads.count(self._threads)

    @property
    def build_seconds(self) -> float:
        """Seconds that it took to hand the scene to Embree and build the BVH of this path."""
        return self._bvh.seconds[self._path]

    @property
    def scene(self) -> Scene:
        """What is traced."""
        return self._bvh.scene

    def intersect(self, rays: Rays) -> Hits:
        """Return the nearest hit of each ray.

        Parameters
        ----------
        rays : Rays
            N rays, also none.

        Returns
        -------
        Hits
        """
        checked_rays(rays, self.scene)
        hits = Hits.unfilled(len(rays))
        self._intersect(rays, hits, None)
        return hits

    def intersect_into(
        self, rays: Rays, hits: Hits, indices: Any = None, t_near: Any = None
    ) -> None:
        """Write the nearest hits of some rays into their rows of `hits`.

        No ray is copied and no hit is moved, so that a caller who has the answers to the other rays
        need neither compact nor merge. Without `indices` it is `intersect` into memory of the
        caller's.

        Parameters
        ----------
        rays : Rays
            N rays.
        hits : Hits
            N rows, C-contiguous and writable; those of the rays at `indices` are written.
        indices : (M,) array_like of int, optional
            Which rays to trace, each from 0 to N - 1, in any order. Neighbours share a packet, so
            rays that go alike should be neighbours. Default: all.
        t_near : (N,) array_like of float32, optional
            What stands in for ``rays.t_near``, >= 0; only the values at `indices` are looked at.

        Raises
        ------
        ArgumentError
            Arrays of another shape or dtype, `hits` that cannot be written in place, an index that
            no ray has, a `t_near` that is negative or NaN.

        Notes
        -----
        The rows written are those of ``intersect(rays.take(indices))``, bit for bit.
        """
        rays, places = checked_some(rays, self.scene, indices, t_near)
        self._intersect(rays, writable_hits(hits, len(rays)), places)

    def occluded(self, rays: Rays) -> Bool:
        """Return, as (N,) bool, whether each ray hits anything between its t_near and t_far."""
        checked_rays(rays, self.scene)
        hit = np.empty(len(rays), np.bool_)
        self._occluded(rays, hit, None)
        return hit

    def occluded_into(
        self, rays: Rays, occluded: Bool, indices: Any = None, t_near: Any = None
    ) -> None:
        """Write whether some rays hit anything into their rows of `occluded`, (N,) bool.

        All else is as in `intersect_into`.
        """
        rays, places = checked_some(rays, self.scene, indices, t_near)
        _check.writable("occluded", occluded, (len(rays),), np.bool_)
        self._occluded(rays, occluded, places)

    def _intersect(self, rays: Rays, hits: Hits, indices: I32 | None) -> None:
        if self._path == "run":
            rows = rows_at(indices)
            hits.put(rows, self._bvh.embreex.intersect(rays.take(rows), self.threads))
            return
        with _threads.limited(self.threads):
            self._bvh.native.intersect(rays, hits, indices, self._way)

    def _occluded(self, rays: Rays, hit: Bool, indices: I32 | None) -> None:
        if self._path == "run":
            rows = rows_at(indices)
            hit[rows] = self._bvh.embreex.occluded(rays.take(rows), self.threads)
            return
        with _threads.limited(self.threads):
            self._bvh.native.occluded(rays, hit, indices, self._way)


class _Bvh:
    """What tracers of one scene share: the built structures, each made when first asked for."""

    def __init__(self, scene: Scene, threads: int, robust: bool, quality: str) -> None:
        self.scene, self.threads, self.robust, self.quality = scene, threads, robust, quality
        self.seconds: dict[str, float] = {}

    def build(self, path: str) -> None:
        if path not in self.seconds:
            start = time.perf_counter()
            _ = self.native if path == "packet" else self.embreex
            self.seconds[path] = time.perf_counter() - start

    @functools.cached_property
    def native(self) -> NativeScene:
        return NativeScene(
            self.scene, threads=self.threads, robust=self.robust, build_quality=self.quality
        )

    @functools.cached_property
    def embreex(self) -> EmbreexScene:
        return EmbreexScene(self.scene, self.robust)
