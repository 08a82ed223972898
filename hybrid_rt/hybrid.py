"""March every ray first, trace those that the screen cannot answer."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from hybrid_rt import _threads
from hybrid_rt._arrays import F32, I32, U8, Bool
from hybrid_rt.kernels import hybrid as kernels
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.slope_pyramid import Pyramid
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.techniques import modes
from hybrid_rt.techniques.march import march
from hybrid_rt.techniques.marched import Marched
from hybrid_rt.techniques.modes import Certified, Mode


class _OfMarch:
    """What the results of a hybrid say of its march."""

    marched: Marched

    @property
    def resolved(self) -> Bool:
        """(N,) bool: whether the march answered the ray."""
        return self.marched.resolved

    @property
    def status(self) -> U8:
        """(N,) uint8: `MarchStatus` of every ray."""
        return self.marched.status

    @property
    def pixel(self) -> I32:
        """(N, 2) int32: the pixel that answered the ray, (-1, -1) where none did."""
        return self.marched.pixel


@dataclass(frozen=True, eq=False)
class HybridResult(_OfMarch):
    """What `trace_hybrid` returns.

    Attributes
    ----------
    hits : Hits
        For every ray, from the march or from the tracer.
    marched : Marched
        What the march said of every ray.
    timings : dict of str to float
        Seconds of the stages "march", "compaction", "fallback", "merge".
    """

    hits: Hits
    marched: Marched
    timings: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class OcclusionResult(_OfMarch):
    """What `occluded_hybrid` returns.

    Attributes
    ----------
    occluded : (N,) bool
        For every ray, from the march or from the tracer.
    marched : Marched
        What the march said of every ray.
    timings : dict of str to float
        Seconds of the stages "march", "compaction", "fallback", "merge".
    """

    occluded: Bool
    marched: Marched
    timings: dict[str, float] = field(default_factory=dict)


Answers = TypeVar("Answers", Hits, Bool)


class Tracer(Protocol):
    """Whatever answers rays exactly.

    If it has a method `intersect_into` like `EmbreeTracer.intersect_into`, that is called instead:
    then no ray and no hit is copied.
    """

    def intersect(self, rays: Rays) -> Hits:
        """Return the nearest hit of each ray."""
        ...


class OcclusionTracer(Protocol):
    """Whatever says exactly which rays are free; `occluded_into` is called instead where it is."""

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
    "certified" from where the march has proven them free (`hybrid_rt.kernels.hybrid.hand_over`).
    "compaction" makes a list of them, "fallback" writes their hits into their rows of the result,
    and "merge" those of the others. `timings` holds wall-clock seconds, without JIT compilation
    only from the second call on.
    """

    def first() -> Marched:
        return march(rays, gbuffer, pyramid, mode, threads=threads)

    def trace(indices: I32, t_near: F32 | None) -> Hits:
        hits = Hits.unfilled(len(rays))
        into: Any = getattr(tracer, "intersect_into", None)
        if into is None:
            hits.put(indices, tracer.intersect(_rest(rays, indices, t_near)))
        else:
            into(rays, hits, indices, t_near)
        return hits

    def merge(marched: Marched, hits: Hits, workers: int) -> None:
        kernels.answer_hits(
            workers,
            marched.resolved,
            rays.origin,
            rays.direction,
            marched.prim_id,
            marched.t,
            gbuffer.scene.vertices,
            gbuffer.scene.faces,
            *hits.arrays,
        )

    return HybridResult(*_in_stages(rays, first, _reach(gbuffer, mode), trace, merge, threads))


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

    def first() -> Marched:
        return march(rays, gbuffer, pyramid, mode, any_hit=True, threads=threads)

    def trace(indices: I32, t_near: F32 | None) -> Bool:
        occluded = np.empty(len(rays), np.bool_)
        into: Any = getattr(tracer, "occluded_into", None)
        if into is None:
            occluded[indices] = tracer.occluded(_rest(rays, indices, t_near))
        else:
            into(rays, occluded, indices, t_near)
        return occluded

    def merge(marched: Marched, occluded: Bool, workers: int) -> None:
        kernels.answer_occlusion(marched.resolved, marched.prim_id, occluded)

    return OcclusionResult(*_in_stages(rays, first, _reach(gbuffer, mode), trace, merge, threads))


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
    trace: Callable[[I32, F32 | None], Answers],
    merge: Callable[[Marched, Answers, int], None],
    threads: int | None,
) -> tuple[Answers, Marched, dict[str, float]]:
    """March, trace what is left, merge; return the answers, the march, and seconds by stage.

    `trace` makes room for all answers and writes those of some rays, `merge` writes the others.
    """
    clock = [time.perf_counter()]
    marched = first()
    clock.append(time.perf_counter())
    with _threads.limited(threads) as workers:
        indices = _unresolved(marched)
        t_near = None if reach is None else _handed_over(rays, marched, reach)
        clock.append(time.perf_counter())
        answers = trace(indices, t_near)
        clock.append(time.perf_counter())
        merge(marched, answers, workers)
        clock.append(time.perf_counter())
    stages = ("march", "compaction", "fallback", "merge")
    return answers, marched, {stage: clock[k + 1] - clock[k] for k, stage in enumerate(stages)}


def _unresolved(marched: Marched) -> I32:
    """Return, as (M,) int32, which rays the march left unresolved, in their order."""
    counts = np.empty(-(-len(marched) // kernels.CHUNK), np.int64)
    kernels.count_unresolved(marched.resolved, counts)
    indices = np.empty(int(counts.sum()), np.int32)
    kernels.list_unresolved(marched.resolved, np.cumsum(counts) - counts, indices)
    return indices


def _handed_over(rays: Rays, marched: Marched, reach: float) -> F32:
    """Return a t_near, (N,) float32, that is set only for unresolved rays."""
    t_near = np.empty(len(rays), np.float32)
    kernels.hand_over(
        marched.resolved,
        rays.origin,
        rays.direction,
        rays.t_near,
        marched.t_free,
        reach,
        t_near,
    )
    return t_near


def _rest(rays: Rays, indices: I32, t_near: F32 | None) -> Rays:
    """Return the rays at `indices`, for a tracer that takes no indices."""
    rest = rays.take(indices)
    return rest if t_near is None else replace(rest, t_near=t_near[indices])
