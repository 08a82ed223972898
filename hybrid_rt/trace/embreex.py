"""Trace by embreex's own call, one ray at a time, with the traps of that call closed."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from hybrid_rt.kernels.arrays import F32, Bool
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene
from hybrid_rt.trace.native import usable


class EmbreexScene:
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
        """Return the nearest hit of each ray."""
        valid, scale = usable(rays)
        if not valid.all():
            hits = Hits.empty(len(rays))
            hits.put(valid, self.intersect(rays.take(valid), threads))
            return hits
        if (scale != 1).any():
            hits = self.intersect(_scaled(rays, scale), threads)
            with np.errstate(over="ignore"):
                np.multiply(hits.t, scale, out=hits.t)
            hit = hits.prim_id >= 0
            # A t beyond float32 stays finite: infinity would say that there is no hit.
            np.minimum(hits.t, np.finfo(np.float32).max, out=hits.t, where=hit)
            return hits
        hits = self._from_zero(rays, threads)
        early = np.flatnonzero(hits.t < rays.t_near)
        if len(early):
            hits.put(early, self._displaced(rays.take(early), threads))
        return hits

    def occluded(self, rays: Rays, threads: int) -> Bool:
        """Return whether each ray hits anything."""
        hit = np.zeros(len(rays), np.bool_)
        valid, scale = usable(rays)
        if (scale != 1).any():
            return self.occluded(_scaled(rays, scale), threads)
        # A hit before t_near would end an occlusion query, so rays with one ask for the hit.
        late = valid & (rays.t_near > 0)
        hit[late] = self.intersect(rays.take(late), threads).prim_id >= 0
        rest = valid & ~late
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
        moved = _changed(rays, origin=origin, t_near=np.zeros_like(t_far), t_far=t_far)
        hits = self.intersect(moved, threads)
        np.add(hits.t, rays.t_near, out=hits.t)
        return hits


def _changed(rays: Rays, **arrays: Any) -> Rays:
    """Return rays with other arrays, which this module has just made."""
    return Rays._made(rays.arrays._replace(**arrays), scene=rays.scene, camera=rays.camera)


def _scaled(rays: Rays, scale: F32) -> Rays:
    """Return the same rays with directions multiplied by powers of two."""
    with np.errstate(over="ignore"):
        return _changed(
            rays,
            direction=rays.direction * scale[:, None],
            t_near=rays.t_near / scale,
            t_far=rays.t_far / scale,
        )


def _in_chunks(work: Callable[[slice], None], n: int, size: int, threads: int) -> None:
    slices = [slice(start, min(start + size, n)) for start in range(0, n, size)]
    if threads == 1 or len(slices) < 2:
        for s in slices:
            work(s)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(work, slices))
