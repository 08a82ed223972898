"""What is asked about rays: the nearest hit, or only whether there is any."""

from __future__ import annotations

import dataclasses
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt
from hybrid_rt_bench.measure.workloads import Workload

Flags = NDArray[np.bool_]

SAMPLED = 8
"""Of the answers that agree with the reference, one in so many has its errors computed."""


class Query(Protocol):
    """A question about rays, as a tracer, a hybrid and the judge know it."""

    def trace(self, tracer: hrt.EmbreeTracer, rays: hrt.Rays) -> Any:
        """Return the tracer's answers."""
        ...

    def hybrid(
        self, rays: hrt.Rays, screen: hrt.Screen, tracer: hrt.EmbreeTracer, threads: int
    ) -> Any:
        """Return what the hybrid says: its answers, with ``marched`` and ``timings``."""
        ...

    def claims(self, result: Any) -> Any:
        """Return the answers in what the hybrid says."""
        ...

    def judge(
        self,
        rays: hrt.Rays,
        claims: Any,
        reference: Any,
        camera: hrt.Camera,
        truth: hrt.Truth,
        pixel: Any = None,
    ) -> hrt.Judged:
        """Return the verdict on every ray's answer, whether the screen gave it or not."""
        ...

    def kinds(
        self, rays: hrt.Rays, reference: Any, wrong: Flags, camera: hrt.Camera, truth: hrt.Truth
    ) -> NDArray[np.uint8]:
        """Return the verdict on those answers of the reference that are known to be wrong."""
        ...


class NearestHit:
    """The nearest hit of each ray."""

    def trace(self, tracer: hrt.EmbreeTracer, rays: hrt.Rays) -> hrt.Hits:
        """Return the tracer's hits."""
        return tracer.intersect(rays)

    def hybrid(
        self, rays: hrt.Rays, screen: hrt.Screen, tracer: hrt.EmbreeTracer, threads: int
    ) -> hrt.HybridResult:
        """Return the result of `hybrid_rt.trace_hybrid`."""
        return hrt.trace_hybrid(rays, screen, tracer, threads=threads)

    def claims(self, result: hrt.HybridResult) -> hrt.Hits:
        """Return the hybrid's hits."""
        return result.hits

    def judge(
        self,
        rays: hrt.Rays,
        claims: hrt.Hits,
        reference: hrt.Hits,
        camera: hrt.Camera,
        truth: hrt.Truth,
        pixel: Any = None,
    ) -> hrt.Judged:
        """Return the verdicts of `hybrid_rt.judging`, as if all rays were resolved.

        Answers that agree with the reference are correct; of these only every `SAMPLED`-th has its
        errors computed, which is most of a judge's work.
        """
        look = claims.prim_id != reference.prim_id
        look[::SAMPLED] = True
        judged = hrt.judge(
            rays, claims, look, reference, truth.scene, camera, pixel, truth=truth
        )  # fmt: skip
        verdict = np.where(look, judged.verdict, hrt.Verdict.CORRECT).astype(np.uint8)
        return dataclasses.replace(judged, verdict=verdict)

    def kinds(
        self,
        rays: hrt.Rays,
        reference: hrt.Hits,
        wrong: Flags,
        camera: hrt.Camera,
        truth: hrt.Truth,
    ) -> NDArray[np.uint8]:
        """Return the verdicts of `hybrid_rt.judging` on those rays, UNRESOLVED for the others."""
        return hrt.judge(
            rays, reference, wrong, reference, truth.scene, camera, truth=truth, every=True
        ).verdict


class AnyHit:
    """Whether each ray meets anything."""

    def trace(self, tracer: hrt.EmbreeTracer, rays: hrt.Rays) -> Flags:
        """Return which rays are occluded."""
        return tracer.occluded(rays)

    def hybrid(
        self, rays: hrt.Rays, screen: hrt.Screen, tracer: hrt.EmbreeTracer, threads: int
    ) -> hrt.OcclusionResult:
        """Return the result of `hybrid_rt.occluded_hybrid`."""
        return hrt.occluded_hybrid(rays, screen, tracer, threads=threads)

    def claims(self, result: hrt.OcclusionResult) -> Flags:
        """Return which rays the hybrid says are occluded."""
        return result.occluded

    def judge(
        self,
        rays: hrt.Rays,
        claims: Flags,
        reference: Flags,
        camera: hrt.Camera,
        truth: hrt.Truth,
        pixel: Any = None,
    ) -> hrt.Judged:
        """Return the verdicts of `hybrid_rt.judge_occlusion`, as if all rays were resolved."""
        every = np.ones(len(rays), np.bool_)
        return hrt.judge_occlusion(rays, claims, every, reference, truth.scene, truth=truth)

    def kinds(
        self, rays: hrt.Rays, reference: Flags, wrong: Flags, camera: hrt.Camera, truth: hrt.Truth
    ) -> NDArray[np.uint8]:
        """Return FALSE_HIT or FALSE_MISS for those rays, UNRESOLVED for the others."""
        verdict = np.where(reference, hrt.Verdict.FALSE_HIT, hrt.Verdict.FALSE_MISS)
        return np.where(wrong, verdict, hrt.Verdict.UNRESOLVED).astype(np.uint8)


def query_of(workload: Workload) -> Query:
    """Return what a workload asks about its rays."""
    return AnyHit() if workload.any_hit else NearestHit()
