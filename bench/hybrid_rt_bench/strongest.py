"""Find the fastest way to trace given rays with Embree: the baseline that the hybrid must beat."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import hybrid_rt as hrt

WIDTHS = (1, 4, 8, 16)
WAYS = (  # words of the label, least width, coherent, order
    ("", 1, False, "given"),
    (", coherent", 4, True, "given"),
    (", coherent, by direction", 8, True, "direction"),
)
BLOCKS = 8
FINALISTS = 5


@dataclass(frozen=True)
class Candidate:
    """One path through Embree.

    Attributes
    ----------
    label : str
        "packet 8, robust, coherent, by direction" and the like.
    tracer : EmbreeTracer
    """

    label: str
    tracer: hrt.EmbreeTracer


@dataclass(frozen=True)
class Choice:
    """The winner, and what every candidate took.

    Attributes
    ----------
    best : Candidate
    nanoseconds : dict of float
        Shortest time a ray, on the sample, by label.
    """

    best: Candidate
    nanoseconds: dict[str, float]


def candidates(robust: hrt.EmbreeTracer, default: hrt.EmbreeTracer) -> list[Candidate]:
    """Return every path over the two acceleration structures, those that this machine has.

    What never paid is left out: the coherent flag for single rays, and sorting by direction without
    that flag or in packets of 4. With the flag it pays on some rays and not on others.

    Parameters
    ----------
    robust, default : EmbreeTracer
        Over the same scene, in robust and in default mode; the candidates share their BVHs.
    """
    found = []
    for mode, tracer in (("robust", robust), ("default", default)):
        found.append(Candidate(f"run, {mode}", tracer.with_path(path="run")))
        if hrt.packet_available() is not None:
            continue
        for width in WIDTHS:
            for words, least, coherent, order in WAYS:
                if width >= least:
                    path = tracer.with_path("packet", width=width, coherent=coherent, order=order)
                    found.append(Candidate(f"packet {width}, {mode}{words}", path))
    return found


def _intersect(tracer: hrt.EmbreeTracer, rays: hrt.Rays) -> hrt.Hits:
    return tracer.intersect(rays)


def choose(
    contenders: Sequence[Candidate],
    rays: hrt.Rays,
    sample: int,
    *,
    trace: Callable[[hrt.EmbreeTracer, hrt.Rays], Any] = _intersect,
    clock: Callable[[], float] = time.perf_counter,
) -> Choice:
    """Return the candidate that traces `rays` fastest.

    Two rounds over all, then four more among the best few. The shortest time counts: what disturbs
    a run of a few milliseconds only ever makes it longer.

    Parameters
    ----------
    contenders : sequence of Candidate
    rays : Rays
    sample : int
        How many rays to time, in a few runs of neighbours spread over the whole.
    trace : callable
        What is asked of a tracer about the rays; by default the nearest hit.
    """
    few = rays.take(_blocks(len(rays), sample))
    for contender in contenders:  # first touch of the BVH and of the path
        trace(contender.tracer, few)
    best = dict.fromkeys(range(len(contenders)), np.inf)
    for rounds, entrants in ((2, len(contenders)), (4, FINALISTS)):
        order = sorted(best, key=best.__getitem__)[:entrants]
        for _ in range(rounds):
            for index in order:
                start = clock()
                trace(contenders[index].tracer, few)
                best[index] = min(best[index], clock() - start)
    winner = min(best, key=best.__getitem__)
    each = {c.label: float(1e9 * best[i] / max(1, len(few))) for i, c in enumerate(contenders)}
    return Choice(contenders[winner], each)


def _blocks(n: int, sample: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    if n <= sample:
        return np.arange(n)
    length = sample // BLOCKS
    starts = np.linspace(0, n - length, BLOCKS).astype(np.int64)
    return np.asarray((starts[:, None] + np.arange(length)).ravel())
