"""What is asked about rays: the nearest hit, or only whether there is any."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.points import Screen
from hybrid_rt_bench.workloads import Workload


class Query(Protocol):
    """A question about rays, as a tracer, a hybrid and the judge know it."""

    any_hit: bool

    def trace(self, tracer: hrt.EmbreeTracer, rays: hrt.Rays) -> Any:
        """Return the tracer's answers."""
        ...

    def hybrid(
        self, rays: hrt.Rays, screen: Screen, tracer: hrt.EmbreeTracer, mode: hrt.Mode, threads: int
    ) -> Any:
        """Return what the hybrid says; it has ``marched``, ``resolved`` and ``timings``."""
        ...

    def claims(self, result: Any) -> Any:
        """Return the answers in what the hybrid says."""
        ...

    def judge(
        self, rays: hrt.Rays, claims: Any, reference: Any, view: hrt.GBuffer, pixel: Any = None
    ) -> hrt.Judged:
        """Return the verdict on every ray's answer, from the screen or not."""
        ...


class NearestHit:
    """The nearest hit of each ray."""

    any_hit = False

    def trace(self, tracer: hrt.EmbreeTracer, rays: hrt.Rays) -> hrt.Hits:
        """Return the tracer's hits."""
        return tracer.intersect(rays)

    def hybrid(
        self, rays: hrt.Rays, screen: Screen, tracer: hrt.EmbreeTracer, mode: hrt.Mode, threads: int
    ) -> hrt.HybridResult:
        """Return the result of `hybrid_rt.trace_hybrid`."""
        return hrt.trace_hybrid(
            rays, screen.gbuffer, screen.pyramid, tracer, mode=mode, threads=threads
        )

    def claims(self, result: hrt.HybridResult) -> hrt.Hits:
        """Return the hybrid's hits."""
        return result.hits

    def judge(
        self,
        rays: hrt.Rays,
        claims: hrt.Hits,
        reference: hrt.Hits,
        view: hrt.GBuffer,
        pixel: Any = None,
    ) -> hrt.Judged:
        """Return the verdicts of `hybrid_rt.judge`, as if all rays were resolved."""
        every = np.ones(len(rays), np.bool_)
        return hrt.judge(rays, claims, every, reference, view.scene, view.camera, pixel=pixel)


def query_of(workload: Workload) -> Query:
    """Return what a workload asks about its rays."""
    return NearestHit()
