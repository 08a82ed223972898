"""Trace rays exactly: with Embree, or slowly against all triangles in float64."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import numba
import numpy as np

from hybrid_rt import _check
from hybrid_rt.embree import QUALITIES, WIDTHS, NativeScene, embree_info, packet_available
from hybrid_rt.kernels import embree as embree_kernels
from hybrid_rt.kernels import trace as kernels
from hybrid_rt.types import Bool, Hits, Rays, Scene

__all__ = ["BruteForceTracer", "EmbreeTracer", "embree_info", "packet_available"]

PATHS = ("packet", "run")


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
        Tell Embree that neighbouring rays are alike, for path "packet".
    build_quality : {"high", "medium", "low"}
        Of Embree's BVH, for path "packet"; embreex always builds with "medium".

    Raises
    ------
    ArgumentError
        An option that is not one of those above.
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
        build_quality: str = "high",
    ) -> None:
        _check.instance("scene", scene, Scene)
        _check.choice("build_quality", build_quality, QUALITIES)
        _check.choice("robust", robust, (True, False))
        self._bvh = _Bvh(scene, _thread_count(threads), bool(robust), build_quality)
        self._set_path(path, width, coherent, threads)

    def with_path(
        self,
        path: str | None = None,
        *,
        width: int | None = None,
        coherent: bool | None = None,
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
            self._threads if threads is None else threads,
        )
        return other

    def _set_path(self, path: str, width: int, coherent: bool, threads: int | None) -> None:
        _thread_count(threads)
        self._threads = threads
        self._path = str(_check.choice("path", path, PATHS))
        self._width = int(_check.choice("width", width, WIDTHS))
        self._coherent = bool(_check.choice("coherent", coherent, (True, False)))
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
        return _thread_count(self._threads)

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
        _check.instance("rays", rays, Rays)
        if self._path == "run":
            return self._bvh.embreex.intersect(rays, self.threads)
        with _numba_threads(self.threads) as workers:
            return self._bvh.native.intersect(
                rays, width=self._width, coherent=self._coherent, workers=workers
            )

    def occluded(self, rays: Rays) -> Bool:
        """Return, as (N,) bool, whether each ray hits anything between its t_near and t_far."""
        _check.instance("rays", rays, Rays)
        if self._path == "run":
            return self._bvh.embreex.occluded(rays, self.threads)
        with _numba_threads(self.threads) as workers:
            return self._bvh.native.occluded(
                rays, width=self._width, coherent=self._coherent, workers=workers
            )


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
        _thread_count(threads)
        self._scene, self._threads = scene, threads

    @property
    def threads(self) -> int:
        """Threads that the next call will use."""
        return _thread_count(self._threads)

    @property
    def scene(self) -> Scene:
        """What is traced."""
        return self._scene

    def intersect(self, rays: Rays) -> Hits:
        """Return the nearest hit of each ray."""
        _check.instance("rays", rays, Rays)
        hits = Hits.empty(len(rays))
        with _numba_threads(self.threads):
            kernels.nearest(
                rays.origin, rays.direction, rays.t_near, rays.t_far,
                self._scene.vertices, self._scene.faces,
                hits.t, hits.prim_id, hits.u, hits.v, hits.n_g,
            )  # fmt: skip
        return hits

    def occluded(self, rays: Rays) -> Bool:
        """Return, as (N,) bool, whether each ray hits anything between its t_near and t_far."""
        return np.asarray(self.intersect(rays).prim_id >= 0)


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
    def embreex(self) -> _EmbreexScene:
        return _EmbreexScene(self.scene, self.robust)


class _EmbreexScene:
    """A scene in embreex, traced by `EmbreeScene.run` with the traps of that call closed."""

    CHUNK = 16384

    def __init__(self, scene: Scene, robust: bool) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene(robust=robust)
        self._mesh = TriangleMesh(self._scene, scene.vertices, scene.faces)
        # The first run builds, without a lock: it must be over before threads come.
        self._scene.run(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32))

    def intersect(self, rays: Rays, threads: int) -> Hits:
        usable = _usable(rays)
        if not usable.all():
            hits = Hits.empty(len(rays))
            _put(hits, usable, self.intersect(rays.take(usable), threads))
            return hits
        hits = self._from_zero(rays, threads)
        early = np.flatnonzero(hits.t < rays.t_near)
        if len(early):
            _put(hits, early, self._displaced(rays.take(early), threads))
        return hits

    def occluded(self, rays: Rays, threads: int) -> Bool:
        hit = np.zeros(len(rays), np.bool_)
        usable = _usable(rays)
        # A hit before t_near would end an occlusion query, so rays with one ask for the hit.
        late = usable & (rays.t_near > 0)
        hit[late] = self.intersect(rays.take(late), threads).prim_id >= 0
        rest = usable & ~late
        part = rays.take(rest)
        found = np.empty(len(part), np.int32)
        t_far = part.t_far.copy()  # run overwrites it

        def one(s: slice) -> None:
            found[s] = self._scene.run(
                part.origin[s], part.direction[s], dists=t_far[s], query="OCCLUDED"
            )

        _in_chunks(one, len(part), self.CHUNK, threads)
        hit[rest] = found == 0  # 0 for a hit, -1 for none
        return hit

    def _from_zero(self, rays: Rays, threads: int) -> Hits:
        """Return the nearest hits with 0 <= t <= t_far of usable rays."""
        hits = Hits.empty(len(rays))
        t_far = rays.t_far.copy()  # run overwrites it

        def one(s: slice) -> None:
            found = self._scene.run(rays.origin[s], rays.direction[s], dists=t_far[s], output=True)
            # u, v and Ng of a miss are those of the ray before it.
            hit = found["primID"] >= 0
            np.copyto(hits.t[s], found["tfar"], where=hit)
            np.copyto(hits.prim_id[s], found["primID"], where=hit)
            np.copyto(hits.u[s], found["u"], where=hit)
            np.copyto(hits.v[s], found["v"], where=hit)
            np.copyto(hits.n_g[s], found["Ng"], where=hit[:, None])

        _in_chunks(one, len(rays), self.CHUNK, threads)
        return hits

    def _displaced(self, rays: Rays, threads: int) -> Hits:
        """Return the nearest hits of usable rays, traced from the float32 point at their t_near."""
        start = rays.origin + rays.t_near[:, None].astype(np.float64) * rays.direction
        with np.errstate(over="ignore"):
            origin = start.astype(np.float32)
        t_far = rays.t_far - rays.t_near
        moved = Rays(origin, rays.direction, rays.pixel, np.zeros_like(t_far), t_far)
        hits = self.intersect(moved, threads)
        np.add(hits.t, rays.t_near, out=hits.t)
        return hits


def _put(hits: Hits, where: Any, values: Hits) -> None:
    """Write `values` into `hits` at an index or boolean array."""
    for name in ("t", "prim_id", "u", "v", "n_g"):
        getattr(hits, name)[where] = getattr(values, name)


def _usable(rays: Rays) -> Bool:
    """Return which rays may be given to Embree."""
    usable = np.empty(len(rays), np.bool_)
    embree_kernels.usable(rays.origin, rays.direction, rays.t_near, rays.t_far, usable)
    return usable


def _in_chunks(work: Callable[[slice], None], n: int, size: int, threads: int) -> None:
    slices = [slice(start, min(start + size, n)) for start in range(0, n, size)]
    if threads == 1 or len(slices) < 2:
        for s in slices:
            work(s)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(work, slices))


def _thread_count(threads: int | None) -> int:
    if threads is None:
        return int(numba.get_num_threads())
    most = int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    return _check.integer("threads", threads, least=1, most=most)


@contextmanager
def _numba_threads(count: int) -> Iterator[int]:
    """Let Numba use `count` threads, and give its setting back afterwards."""
    before = numba.get_num_threads()
    numba.set_num_threads(count)
    try:
        yield count
    finally:
        numba.set_num_threads(before)
