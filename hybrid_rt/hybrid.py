"""March every ray first, trace those that the screen cannot answer."""

from __future__ import annotations

import time
from typing import Protocol

import numpy as np

from hybrid_rt import _threads
from hybrid_rt.kernels import hybrid as kernels
from hybrid_rt.march import march
from hybrid_rt.modes import Mode
from hybrid_rt.types import I64, Bool, GBuffer, Hits, HybridResult, Pyramid, Rays


class Tracer(Protocol):
    """Whatever answers rays exactly."""

    def intersect(self, rays: Rays) -> Hits:
        """Return the nearest hit of each ray."""
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
        answered and not a triangle, so they may lie outside [0, 1].

    Notes
    -----
    Unresolved rays are traced in their order, so that neighbours stay neighbours. `timings` holds
    wall-clock seconds, without JIT compilation only from the second call on.
    """
    clock = [time.perf_counter()]
    marched = march(rays, gbuffer, pyramid, mode, threads=threads)
    clock.append(time.perf_counter())
    resolved = marched.resolved
    with _threads.limited(threads):
        starts, rest = _compact(rays, resolved)
        clock.append(time.perf_counter())
        traced = tracer.intersect(rest)
        clock.append(time.perf_counter())
        hits = Hits.unfilled(len(rays))
        kernels.merge(
            resolved,
            starts,
            rays.origin,
            rays.direction,
            marched.prim_id,
            marched.t,
            gbuffer.scene.vertices,
            gbuffer.scene.faces,
            traced.t,
            traced.prim_id,
            traced.u,
            traced.v,
            traced.n_g,
            hits.t,
            hits.prim_id,
            hits.u,
            hits.v,
            hits.n_g,
        )
        clock.append(time.perf_counter())
    stages = ("march", "compaction", "fallback", "merge")
    timings = {stage: clock[k + 1] - clock[k] for k, stage in enumerate(stages)}
    return HybridResult(hits, marched, timings)


def _compact(rays: Rays, resolved: Bool) -> tuple[I64, Rays]:
    """Return, for each chunk, how many unresolved rays come before it, and the unresolved rays."""
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
        rays.origin,
        rays.direction,
        rays.pixel,
        rays.t_near,
        rays.t_far,
        rest.origin,
        rest.direction,
        rest.pixel,
        rest.t_near,
        rest.t_far,
    )
    return starts, rest
