"""March every ray first, trace those that the screen cannot answer."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from hybrid_rt import _threads, modes
from hybrid_rt.kernels import hybrid as kernels
from hybrid_rt.march import march
from hybrid_rt.modes import Certified, Mode
from hybrid_rt.types import (
    I64,
    Bool,
    GBuffer,
    Hits,
    HybridResult,
    Marched,
    OcclusionResult,
    Pyramid,
    Rays,
)

Answer = TypeVar("Answer")


class Tracer(Protocol):
    """Whatever answers rays exactly."""

    def intersect(self, rays: Rays) -> Hits:
        """Return the nearest hit of each ray."""
        ...


class OcclusionTracer(Protocol):
    """Whatever says exactly which rays are free."""

    def occluded(self, rays: Rays) -> Bool:
        """Return, as (N,) bool, whether each ray hits anything between its t_near and t_far."""
        ...


def trace_hybrid(
    rays: Rays,
    gbuffer: GBuffer,
    pyramid: Pyramid,
    tracer: Tracer,
    mode: str | Mode = "paper",
    *,
    threads: int | None = None,
) -> HybridResult:
    """Return the hit of every ray, from the screen where it answers and from `tracer` elsewhere.

    Parameters
    ----------
    rays : Rays
        N rays, world.
    gbuffer : GBuffer
    pyramid : DepthPyramid or SlopePyramid
        Of `gbuffer`; as in `march`.
    tracer : Tracer
        An `EmbreeTracer`, a `BruteForceTracer` or anything with their `intersect`, over the scene
        of `gbuffer`.
    mode, threads
        As in `march`; the tracer keeps its own number of threads.

    Returns
    -------
    HybridResult
        N hits of the same kind as a tracer's. Where the march answered with a hit, t is the mode's
        (in modes "paper" and "slope" the distance to the pixel's tilted plane), and u, v are the
        barycentrics of that point, brought to the plane of the pixel's primitive: a pixel is
        answered and not a triangle, so they may lie outside [0, 1]. Mode "certified" answers with
        the hit itself.

    Notes
    -----
    Unresolved rays are traced in their order, so that neighbours stay neighbours; in mode
    "certified" from where the march has proven them free (`hybrid_rt.kernels.hybrid.handed_over`).
    `timings` holds
    wall-clock seconds, without JIT compilation only from the second call on.
    """

    def merge(marched: Marched, starts: I64, traced: Hits) -> Hits:
        hits = Hits.unfilled(len(rays))
        kernels.merge(
            marched.resolved,
            starts,
            rays.origin,
            rays.direction,
            marched.prim_id,
            marched.t,
            gbuffer.scene.vertices,
            gbuffer.scene.faces,
            *traced.arrays,
            *hits.arrays,
        )
        return hits

    def first() -> Marched:
        return march(rays, gbuffer, pyramid, mode, threads=threads)

    reach = _reach(gbuffer, mode)
    return HybridResult(*_in_stages(rays, first, reach, tracer.intersect, merge, threads))


def occluded_hybrid(
    rays: Rays,
    gbuffer: GBuffer,
    pyramid: Pyramid,
    tracer: OcclusionTracer,
    mode: str | Mode = "paper",
    *,
    threads: int | None = None,
) -> OcclusionResult:
    """Return whether each ray meets anything, from the screen where it says so, else from `tracer`.

    Parameters
    ----------
    rays : Rays
        N rays, world; any hit with ``t_near <= t <= t_far`` occludes.
    gbuffer : GBuffer
    pyramid : DepthPyramid or SlopePyramid
        Of `gbuffer`.
    tracer : OcclusionTracer
        An `EmbreeTracer`, a `BruteForceTracer` or anything with their `occluded`, over the scene of
        `gbuffer`.
    mode, threads
        As in `march`, which is asked for any hit; the tracer keeps its own number of threads.

    Returns
    -------
    OcclusionResult
        N answers. A ray that the march resolves is occluded where it names a primitive and free
        where it resolves to a miss.

    Notes
    -----
    As for `trace_hybrid`.
    """

    def merge(marched: Marched, starts: I64, traced: Bool) -> Bool:
        occluded = np.empty(len(rays), np.bool_)
        kernels.merge_occlusion(marched.resolved, starts, marched.prim_id, traced, occluded)
        return occluded

    def first() -> Marched:
        return march(rays, gbuffer, pyramid, mode, any_hit=True, threads=threads)

    reach = _reach(gbuffer, mode)
    return OcclusionResult(*_in_stages(rays, first, reach, tracer.occluded, merge, threads))


def _reach(gbuffer: GBuffer, mode: str | Mode) -> float | None:
    """Return the scene's largest coordinate where rays are handed over, else None."""
    chosen = modes.named(mode)
    if isinstance(chosen, Certified) and chosen.hand_over:
        return float(np.abs(gbuffer.scene.bounds).max())
    return None


def _in_stages(
    rays: Rays,
    first: Callable[[], Marched],
    reach: float | None,
    trace: Callable[[Rays], Answer],
    merge: Callable[[Marched, I64, Answer], Answer],
    threads: int | None,
) -> tuple[Answer, Marched, dict[str, float]]:
    """March, trace what is left, merge; return the answers, the march, and seconds by stage."""
    clock = [time.perf_counter()]
    marched = first()
    clock.append(time.perf_counter())
    with _threads.limited(threads):
        starts, rest = _compact(rays, marched, reach)
        clock.append(time.perf_counter())
        traced = trace(rest)
        clock.append(time.perf_counter())
        merged = merge(marched, starts, traced)
        clock.append(time.perf_counter())
    stages = ("march", "compaction", "fallback", "merge")
    return merged, marched, {stage: clock[k + 1] - clock[k] for k, stage in enumerate(stages)}


def _compact(rays: Rays, marched: Marched, reach: float | None) -> tuple[I64, Rays]:
    """Return, for each chunk, how many unresolved rays come before it, and the unresolved rays.

    With `reach` they start where the march has left them.
    """
    resolved = marched.resolved
    counts = np.empty(-(-len(rays) // kernels.CHUNK), np.int64)
    kernels.count_unresolved(resolved, counts)
    m = int(counts.sum())
    starts = np.cumsum(counts) - counts
    rest = Rays(
        np.empty((m, 3), np.float32),
        np.empty((m, 3), np.float32),
        np.empty((m, 2), np.int32),
        np.empty(m, np.float32),
        np.empty(m, np.float32),
    )
    kernels.compact(
        resolved,
        starts,
        reach is not None,
        marched.t_free,
        reach or 0.0,
        *rays.arrays,
        *rest.arrays,
    )
    return starts, rest
