"""Mitsuba 3: variant ``llvm_ad_rgb``, whole arrays of rays through one compiled kernel."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.peers.programs.base import (
    Answers,
    Opened,
    Query,
    View,
)

VARIANT = "llvm_ad_rgb"


class Mitsuba(Opened):
    """``Scene.ray_intersect_preliminary``: t, primitive and barycentrics, no t_near.

    It is evaluated and waited for inside what is timed, since Dr.Jit puts everything off. Its flag
    `coherent` is tried both ways on the rays, and the faster is kept, as our own is chosen.
    """

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        import drjit
        import mitsuba

        mitsuba.set_variant(VARIANT)
        drjit.set_thread_count(threads)
        self._dr, self._mi = drjit, mitsuba
        self.threads = int(drjit.thread_count())
        self.detail = f"{VARIANT}, {'Embree' if mitsuba.MI_ENABLE_EMBREE else 'its own kd-tree'}"
        start = time.perf_counter()
        mesh = mitsuba.Mesh("mesh", len(scene.vertices), len(scene.faces))
        parameters = mitsuba.traverse(mesh)
        parameters["vertex_positions"] = mitsuba.Float(scene.vertices.ravel())
        parameters["faces"] = mitsuba.UInt32(scene.faces.astype(np.uint32).ravel())
        parameters.update()
        self._scene = mitsuba.load_dict({"type": "scene", "mesh": mesh})
        drjit.sync_thread()
        self.build_seconds = time.perf_counter() - start

    def load(self, view: View) -> Query:
        """Return the query, its rays in Dr.Jit's arrays, and the kernel compiled for both flags."""
        mi, dr = self._mi, self._dr
        origin = mi.Point3f(np.ascontiguousarray(view.rays.origin.T))
        direction = mi.Vector3f(np.ascontiguousarray(view.rays.direction.T))
        rays = mi.Ray3f(origin, direction)
        dr.eval(rays)
        dr.sync_thread()

        def run(coherent: bool) -> Any:
            found = self._scene.ray_intersect_preliminary(rays, coherent=coherent)
            dr.eval(found.t, found.prim_index, found.prim_uv)
            dr.sync_thread()
            return found

        def answers(found: Any) -> Answers:
            t = np.array(found.t)
            hit = np.isfinite(t)
            prim_id = np.array(found.prim_index).astype(np.int64)
            return Answers(t, np.where(hit, prim_id, -1))

        seconds = {True: np.inf, False: np.inf}
        for flag in (True, False, True, False, True, False):
            start = time.perf_counter()
            run(flag)
            seconds[flag] = min(seconds[flag], time.perf_counter() - start)
        best = min(seconds, key=seconds.__getitem__)
        return Query(lambda: run(best), answers, "coherent" if best else "incoherent")

    def close(self) -> None:
        """Give the scene's memory back."""
        del self._scene
        self._dr.flush_malloc_cache()
