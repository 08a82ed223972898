"""Trace rays exactly: with Embree, or slowly against all triangles in float64."""

from __future__ import annotations

import dataclasses
import functools
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt import _check, _threads
from hybrid_rt._arrays import I32, Bool
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.trace import brute as kernels
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene
from hybrid_rt.trace.embreex import EmbreexScene
from hybrid_rt.trace.native import QUALITIES, WIDTHS, NativeScene, embree_info, packet_available

__all__ = ["BruteForceTracer", "EmbreeTracer", "embree_info", "packet_available"]

PATHS = ("packet", "run")
ORDERS = ("given", "direction")

# Embree's float32 products of coordinates leave its range beyond about 2**-45 and 2**45, and it
# answers with misses; see test_scenes_beyond_the_range_of_embree_are_refused.
SMALLEST_SCENE, LARGEST_SCENE = 2.0**-40, 2.0**40


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
        Path "packet" where the library cannot be reached (see `packet_available`), or an error that
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
        _check.choice("robust", robust, (True, False))
        largest = float(np.abs(scene.vertices).max())
        if largest != 0 and not SMALLEST_SCENE <= largest <= LARGEST_SCENE:
            raise ArgumentError(
                "scene",
                f"a largest coordinate from {SMALLEST_SCENE:g} to {LARGEST_SCENE:g}",
                f"{largest:g}",
            )
        self._bvh = _Bvh(scene, _threads.count(threads), bool(robust), build_quality)
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
        self._width = int(_check.choice("width", width, WIDTHS))
        self._coherent = bool(_check.choice("coherent", coherent, (True, False)))
        self._order = str(_check.choice("order", order, ORDERS))
        self._bvh.build(self._path)

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
        rays = _checked(rays)
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
            What stands in for ``rays.t_near``; only the values at `indices` are looked at.

        Raises
        ------
        ArgumentError
            Arrays of another shape or dtype, `hits` that cannot be written in place, an index that
            no ray has.

        Notes
        -----
        The rows written are those of ``intersect(rays.take(indices))``, bit for bit.
        """
        rays, places = _checked_some(rays, indices, t_near)
        self._intersect(rays, _checked_hits(hits, len(rays)), places)

    def occluded(self, rays: Rays) -> Bool:
        """Return, as (N,) bool, whether each ray hits anything between its t_near and t_far."""
        rays = _checked(rays)
        hit = np.empty(len(rays), np.bool_)
        self._occluded(rays, hit, None)
        return hit

    def occluded_into(
        self, rays: Rays, occluded: Bool, indices: Any = None, t_near: Any = None
    ) -> None:
        """Write whether some rays hit anything into their rows of `occluded`, (N,) bool.

        All else is as in `intersect_into`.
        """
        rays, places = _checked_some(rays, indices, t_near)
        _check.writable("occluded", occluded, (len(rays),), np.bool_)
        self._occluded(rays, occluded, places)

    def _intersect(self, rays: Rays, hits: Hits, indices: I32 | None) -> None:
        if self._path == "run":
            rows = _rows(indices)
            hits.put(rows, self._bvh.embreex.intersect(rays.take(rows), self.threads))
            return
        with _threads.limited(self.threads) as workers:
            self._bvh.native.intersect(
                rays, hits, indices, width=self._width, coherent=self._coherent,
                by_direction=self._order == "direction", workers=workers,
            )  # fmt: skip

    def _occluded(self, rays: Rays, hit: Bool, indices: I32 | None) -> None:
        if self._path == "run":
            rows = _rows(indices)
            hit[rows] = self._bvh.embreex.occluded(rays.take(rows), self.threads)
            return
        with _threads.limited(self.threads) as workers:
            self._bvh.native.occluded(
                rays, hit, indices, width=self._width, coherent=self._coherent,
                by_direction=self._order == "direction", workers=workers,
            )  # fmt: skip


class BruteForceTracer:
    """Nearest hits by testing every triangle in float64: the slow truth.

    Parameters
    ----------
    scene : Scene
    threads : int, optional
        Default: as many as `numba.get_num_threads` says at each call.

    Notes
    -----
    Rays and vertices are float32 and taken as exact; see `hybrid_rt.kernels.triangle` for the test
    and its error. Edges are closed, so a ray through a shared edge hits both triangles. Of equal t
    the smallest prim_id is taken. Triangles of exactly zero area are never hit. A ray with a NaN,
    an infinity or a zero direction hits nothing. t is rounded to float32 at the very end.
    """

    def __init__(self, scene: Scene, *, threads: int | None = None) -> None:
        _check.instance("scene", scene, Scene)
        _threads.count(threads)
        self._scene, self._threads = scene, threads
        self._vertices, self._faces = _kernel_array(scene.vertices), _kernel_array(scene.faces)

    @property
    def threads(self) -> int:
        """Threads that the next call will use."""
        return _threads.count(self._threads)

    @property
    def scene(self) -> Scene:
        """What is traced."""
        return self._scene

    def intersect(self, rays: Rays) -> Hits:
        """Return the nearest hit of each ray."""
        rays = _checked(rays)
        hits = Hits.empty(len(rays))
        with _threads.limited(self.threads):
            kernels.nearest(
                rays.origin, rays.direction, rays.t_near, rays.t_far,
                self._vertices, self._faces,
                hits.t, hits.prim_id, hits.u, hits.v, hits.n_g,
            )  # fmt: skip
        return hits

    def intersect_into(
        self, rays: Rays, hits: Hits, indices: Any = None, t_near: Any = None
    ) -> None:
        """Write the nearest hits of some rays into their rows, as `EmbreeTracer.intersect_into`."""
        rays, places = _checked_some(rays, indices, t_near)
        rows = _rows(places)
        _checked_hits(hits, len(rays)).put(rows, self.intersect(rays.take(rows)))

    def occluded(self, rays: Rays) -> Bool:
        """Return, as (N,) bool, whether each ray hits anything between its t_near and t_far."""
        return np.asarray(self.intersect(rays).prim_id >= 0)

    def occluded_into(
        self, rays: Rays, occluded: Bool, indices: Any = None, t_near: Any = None
    ) -> None:
        """Write whether some rays hit anything, as `EmbreeTracer.occluded_into`."""
        rays, places = _checked_some(rays, indices, t_near)
        _check.writable("occluded", occluded, (len(rays),), np.bool_)
        rows = _rows(places)
        occluded[rows] = self.occluded(rays.take(rows))


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


def _checked(rays: Rays) -> Rays:
    """Return rays whose arrays a kernel may have: a length that differs would be read past."""
    _check.instance("rays", rays, Rays)
    n = len(rays)
    arrays = []
    for name, shape, dtype in (
        ("origin", ("N", 3), np.float32),
        ("direction", ("N", 3), np.float32),
        ("pixel", ("N", 2), np.int32),
        ("t_near", ("N",), np.float32),
        ("t_far", ("N",), np.float32),
    ):
        value = _check.array(f"rays.{name}", getattr(rays, name), shape, dtype)
        _check.same_length(f"rays.{name}", value, "rays.origin", n)
        arrays.append(_kernel_array(value))
    return Rays(*arrays)


def _checked_some(rays: Rays, indices: Any, t_near: Any) -> tuple[Rays, I32 | None]:
    """Return rays with the t_near that is to be used, and indices that all are in range."""
    rays = _checked(rays)
    n = len(rays)
    if t_near is not None:
        near = _check.array("t_near", t_near, ("N",), np.float32)
        _check.same_length("t_near", near, "rays", n)
        rays = dataclasses.replace(rays, t_near=_kernel_array(near))
    if indices is None:
        return rays, None
    places = _check.array("indices", indices, ("M",), np.int32)
    if len(places):
        low, high = int(places.min()), int(places.max())
        if low < 0 or high >= n:
            raise ArgumentError("indices", f"values from 0 to {n - 1}", f"values {low} to {high}")
    return rays, _kernel_array(places)


def _checked_hits(hits: Hits, n: int) -> Hits:
    """Return `hits` if a kernel may write `n` rows there."""
    _check.instance("hits", hits, Hits)
    for name, shape, dtype in (
        ("t", (n,), np.float32),
        ("prim_id", (n,), np.int32),
        ("u", (n,), np.float32),
        ("v", (n,), np.float32),
        ("n_g", (n, 3), np.float32),
    ):
        _check.writable(f"hits.{name}", getattr(hits, name), shape, dtype)
    return hits


def _rows(indices: I32 | None) -> Any:
    """Return what selects the rows of `indices`, or all of them."""
    return slice(None) if indices is None else indices


def _kernel_array(value: NDArray[Any]) -> NDArray[Any]:
    # A read-only array has a type of its own in Numba and would compile every kernel again.
    return np.require(value, requirements=["C", "W"])
