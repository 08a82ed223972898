"""The rows of this project itself: the strongest Embree, the hybrid before it, the raster."""

from __future__ import annotations

import functools
import time
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.peers.programs.base import (
    Answers,
    Drawing,
    Opened,
    Picture,
    Query,
    View,
)
from hybrid_rt_bench.measure import strongest
from hybrid_rt_bench.measure.loaded import native_path


class Embree(Opened):
    """Embree by whichever of its paths is fastest on the rays asked about."""

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        path = native_path()
        self.scene, self.threads, self._path = scene, threads, path
        self.reference = hrt.EmbreeTracer(scene, threads=threads, path=path, robust=True)
        self.build_seconds = self.reference.build_seconds

    @functools.cached_property
    def candidates(self) -> list[strongest.Candidate]:
        """What competes for the strongest; the default mode's BVH is built when first asked for."""
        default = hrt.EmbreeTracer(self.scene, threads=self.threads, path=self._path, robust=False)
        return strongest.candidates(self.reference, default)

    def load(self, view: View) -> Query:
        """Return the query of the view's strongest Embree."""
        tracer = view.tracer or self.reference
        return Query(lambda: tracer.intersect(view.rays), hits, view.label)


class EmbreexThreads(Opened):
    """embreex's own call, in chunks on a pool of threads and with t_near kept."""

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        self.tracer = hrt.EmbreeTracer(scene, threads=threads, path="run")
        self.threads, self.build_seconds = threads, self.tracer.build_seconds

    def load(self, view: View) -> Query:
        """Return the query of `EmbreeTracer` by path "run"."""
        return Query(lambda: self.tracer.intersect(view.rays), hits)


class Hybrid(Opened):
    """The march of technique "certified", then the strongest Embree for the unresolved rays."""

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        self.scene, self.threads = scene, threads

    def load(self, view: View) -> Query | None:
        """Return the hybrid's query; the lists of primitives and the pyramid are made in here."""
        if view.gbuffer is None:  # primary rays are what the raster answers
            return None
        screen = hrt.prepare(view.gbuffer, "certified", threads=self.threads)
        tracer = view.tracer or hrt.EmbreeTracer(self.scene, threads=self.threads)

        def run() -> hrt.Hits:
            return hrt.trace_hybrid(view.rays, screen, tracer, threads=self.threads).hits

        return Query(run, hits, f"fallback: {view.label}")


class Raster(Opened):
    """`hybrid_rt.rasterize`."""

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        self.scene, self.threads, self.build_seconds = scene, threads, 0.0

    def draw(self, camera: hrt.Camera) -> Drawing:
        """Return the drawing; it ends in NumPy arrays, so there is nothing to read back."""
        drawn: list[hrt.GBuffer] = []

        def draw() -> None:
            drawn[:] = [hrt.rasterize(self.scene, camera, threads=self.threads)]

        return Drawing(draw, lambda: Picture(drawn[0].depth, drawn[0].prim_id))


class EmbreexRun(Opened):
    """embreex's ``EmbreeScene.run`` as it is: one thread, one ray at a time, no t_near."""

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        start = time.perf_counter()
        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, scene.vertices, scene.faces)
        self._scene.run(scene.vertices[:1], scene.vertices[:1])  # the first call builds
        self.build_seconds = time.perf_counter() - start

    def load(self, view: View) -> Query:
        """Return the query; embreex takes float32 arrays as ours are."""
        origin, direction = view.rays.origin, view.rays.direction

        def answers(found: dict[str, Any]) -> Answers:
            prim_id = found["primID"]
            return Answers(np.where(prim_id >= 0, found["tfar"], np.inf), prim_id)

        return Query(lambda: self._scene.run(origin, direction, output=True), answers)


def hits(found: hrt.Hits) -> Answers:
    """Return the answers in a tracer's hits."""
    return Answers(found.t, found.prim_id)
