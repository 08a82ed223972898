"""The slow truth: every ray against every triangle in float64."""

from __future__ import annotations

from typing import Any

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.base import ANY, NEAREST, register
from hybrid_rt.kernels.arrays import Bool
from hybrid_rt.kernels.trace import brute as kernels
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene
from hybrid_rt.trace.rows import checked_rays, checked_some, rows_at, writable_hits


@register
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

    name = "brute"
    description = "Every triangle for every ray, in float64"
    queries = frozenset({NEAREST, ANY})

    def __init__(self, scene: Scene, *, threads: int | None = None) -> None:
        _check.instance("scene", scene, Scene)
        _threads.count(threads)
        self._scene, self._threads = scene, threads

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
        checked_rays(rays, self._scene)
        hits = Hits.empty(len(rays))
        origin, direction, _, t_near, t_far = rays.arrays
        vertices, faces, _ = self._scene.arrays
        with _threads.limited(self.threads):
            kernels.nearest(
                origin, direction, t_near, t_far, vertices, faces, *hits.arrays,
            )  # fmt: skip
        return hits

    def intersect_into(
        self, rays: Rays, hits: Hits, indices: Any = None, t_near: Any = None
    ) -> None:
        """Write the nearest hits of some rays into their rows, as `EmbreeTracer.intersect_into`."""
        rays, places = checked_some(rays, self._scene, indices, t_near)
        rows = rows_at(places)
        writable_hits(hits, len(rays)).put(rows, self.intersect(rays.take(rows)))

    def occluded(self, rays: Rays) -> Bool:
        """Return, as (N,) bool, whether each ray hits anything between its t_near and t_far."""
        return np.asarray(self.intersect(rays).prim_id >= 0)

    def occluded_into(
        self, rays: Rays, occluded: Bool, indices: Any = None, t_near: Any = None
    ) -> None:
        """Write whether some rays hit anything, as `EmbreeTracer.occluded_into`."""
        rays, places = checked_some(rays, self._scene, indices, t_near)
        _check.writable("occluded", occluded, (len(rays),), np.bool_)
        rows = rows_at(places)
        occluded[rows] = self.occluded(rays.take(rows))
