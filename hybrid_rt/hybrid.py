"""March every ray first, trace those that the screen cannot answer."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.base import ANY, NEAREST, Screen, Tracer, check_tracer
from hybrid_rt.kernels import hybrid as kernels
from hybrid_rt.kernels.arrays import F32, I32, U8, Bool
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.marched import Marched
from hybrid_rt.rays.rays import Rays


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

STAGES = ("march", "compaction", "fallback", "merge")
"""What a hybrid does, in turn."""


def trace_hybrid(
    rays: Rays, screen: Screen, tracer: Tracer, *, threads: int | None = None
) -> HybridResult:
    """Return the hit of every ray, from the screen where it answers and from `tracer` elsewhere.

    Parameters
    ----------
    rays : Rays
        N rays, world.
    screen : Screen
        What a technique reads of a view, from `prepare`.
    tracer : Tracer
        An `EmbreeTracer`, a `BruteForceTracer` or anything with a `scene` and their `intersect`,
        over the scene of `screen`.
    threads : int, optional
        For all but the tracer, which keeps its own number. Default: as many as Numba is set to.

    Returns
    -------
    HybridResult
        N hits of the same kind as a tracer's. Where the march answered with a hit, t is the
        technique's (of "paper" and "slope" the distance to the pixel's tilted plane), and u, v are
        the barycentrics of that point, brought to the plane of the pixel's primitive: a pixel is
        answered and not a triangle, so they may lie outside [0, 1]. "certified" answers with the
        hit itself.

    Raises
    ------
    ArgumentError
        Rays, screen and tracer that do not belong together; a tracer that gives other than one
        whole answer to each ray.

    Notes
    -----
    Unresolved rays are traced in their order, so that neighbours stay neighbours; with a technique
    that hands over, from where the march has proven them free
    (`hybrid_rt.kernels.hybrid.hand_over`). "compaction" makes a list of them, "fallback" writes
    their hits into their rows of the result, and "merge" those of the others. `timings` holds
    wall-clock seconds, without JIT compilation only from the second call on.
    """
    _check.instance("screen", screen, Screen)
    check_tracer(tracer, screen.scene, NEAREST, "intersect")
    faces = len(screen.scene)

    def trace(traced: Rays, indices: I32) -> Hits:
        hits = Hits.unfilled(len(traced))
        into: Any = getattr(tracer, "intersect_into", None)
        if into is None:
            found = tracer.intersect(traced.take(indices))
            _check.instance("what the tracer returns", found, Hits)
            hits.put(indices, found._checked("what the tracer returns", len(indices), faces))
        else:
            into(traced, hits, indices)
            if not _ours(tracer):
                rows: list[Any] = [array[indices] for array in hits.arrays]
                Hits(*rows)._checked("what the tracer writes", len(indices), faces)
        return hits

    def merge(marched: Marched, hits: Hits) -> None:
        vertices, triangles, _ = screen.scene.arrays
        origin, direction = rays.arrays[:2]
        kernels.answer_hits(
            marched.resolved, origin, direction, marched.prim_id, marched.t,
            vertices, triangles, *hits.arrays,
        )  # fmt: skip

    return HybridResult(*_in_stages(rays, screen, False, trace, merge, threads))


def occluded_hybrid(
    rays: Rays, screen: Screen, tracer: Tracer, *, threads: int | None = None
) -> OcclusionResult:
    """Return whether each ray meets anything, from the screen where it says so, else from `tracer`.

    Parameters
    ----------
    rays : Rays
        N rays, world; any hit with ``t_near <= t <= t_far`` occludes.
    screen, threads
        As in `trace_hybrid`; the march is asked for any hit.
    tracer : Tracer
        An `EmbreeTracer`, a `BruteForceTracer` or anything with a `scene` and their `occluded`,
        over the scene of `screen`.

    Returns
    -------
    OcclusionResult
        N answers. A ray that the march resolves is occluded where it names a primitive and free
        where it resolves to a miss.

    Raises
    ------
    ArgumentError
        As by `trace_hybrid`.

    Notes
    -----
    As for `trace_hybrid`.
    """
    _check.instance("screen", screen, Screen)
    check_tracer(tracer, screen.scene, ANY, "occluded")

    def trace(traced: Rays, indices: I32) -> Bool:
        occluded = np.empty(len(traced), np.bool_)
        into: Any = getattr(tracer, "occluded_into", None)
        if into is None:
            found = tracer.occluded(traced.take(indices))
            shape = (len(indices),)
            occluded[indices] = _check.array("what the tracer returns", found, shape, np.bool_)
        else:
            into(traced, occluded, indices)
        return occluded

    def merge(marched: Marched, occluded: Bool) -> None:
        kernels.answer_occlusion(marched.resolved, marched.prim_id, occluded)

    return OcclusionResult(*_in_stages(rays, screen, True, trace, merge, threads))


def _ours(tracer: Tracer) -> bool:
    """Is a tracer one of this library's, which are tested to answer as they should."""
    return type(tracer).__module__.partition(".")[0] == __package__


def _in_stages(
    rays: Rays,
    screen: Screen,
    any_hit: bool,
    trace: Callable[[Rays, I32], Answers],
    merge: Callable[[Marched, Answers], None],
    threads: int | None,
) -> tuple[Answers, Marched, dict[str, float]]:
    """March, trace what is left, merge; return the answers, the march, and seconds by stage.

    `trace` makes room for all answers and writes those of some rays, `merge` writes the others.
    """
    clock = [time.perf_counter()]
    marched = screen.technique.march(rays, screen, any_hit=any_hit, threads=threads)
    clock.append(time.perf_counter())
    with _threads.limited(threads):
        indices = _unresolved(marched)
        traced = _handed_over(rays, marched, screen) if screen.technique.hands_over else rays
        clock.append(time.perf_counter())
        answers = trace(traced, indices)
        clock.append(time.perf_counter())
        merge(marched, answers)
        clock.append(time.perf_counter())
    return answers, marched, {stage: clock[k + 1] - clock[k] for k, stage in enumerate(STAGES)}


def _unresolved(marched: Marched) -> I32:
    """Return, as (M,) int32, which rays the march left unresolved, in their order."""
    counts = np.empty(-(-len(marched) // kernels.CHUNK), np.int64)
    kernels.count_unresolved(marched.resolved, counts)
    indices = np.empty(int(counts.sum()), np.int32)
    kernels.list_unresolved(marched.resolved, np.cumsum(counts) - counts, indices)
    return indices


def _handed_over(rays: Rays, marched: Marched, screen: Screen) -> Rays:
    """Return the rays with a t_near that, for unresolved ones, is where their proof ended."""
    arrays = rays.arrays
    reach = float(np.abs(screen.scene.bounds).max())
    t_near: F32 = np.empty(len(rays), np.float32)
    kernels.hand_over(
        marched.resolved, arrays.origin, arrays.direction, arrays.t_near, marched.t_free, reach,
        t_near,
    )  # fmt: skip
    return rays._starting(t_near)
