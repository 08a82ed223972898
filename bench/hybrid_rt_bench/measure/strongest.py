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
SHORTEST = 8192  # rays of a block, beside which the time of a call is small
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
        Shortest time per ray, on the sample and on one thread, by label.
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
        if hrt.embree_problem() is not None:
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

    Two rounds over all, then four more among the best few. The shortest time of each block of
    neighbours counts: what disturbs a run of a millisecond only ever makes it longer. All trace on
    one thread, which finds an undisturbed moment on a busy machine where several that wait for each
    other find none; and what is fastest on one core is so on each, since they share no work.

    Parameters
    ----------
    contenders : sequence of Candidate
    rays : Rays
    sample : int
        How many rays to time, in a few runs of neighbours spread over the whole.
    trace : callable
        What is asked of a tracer about the rays; by default the nearest hit.
    """
    blocks = [rays.take(block) for block in _blocks(len(rays), sample, SHORTEST)]
    alone = [contender.tracer.with_path(threads=1) for contender in contenders]
    for tracer in alone:  # first touch of the BVH and of the path
        trace(tracer, blocks[0])
    best = np.full((len(contenders), len(blocks)), np.inf)
    for rounds, entrants in ((2, len(contenders)), (4, FINALISTS)):
        order = np.argsort(best.sum(axis=1), kind="stable")[:entrants]
        for _ in range(rounds):
            for index in order:
                for k, block in enumerate(blocks):
                    start = clock()
                    trace(alone[index], block)
                    best[index, k] = min(best[index, k], clock() - start)
    seconds = best.sum(axis=1)
    count = max(1, sum(map(len, blocks)))
    each = {c.label: float(1e9 * seconds[i] / count) for i, c in enumerate(contenders)}
    return Choice(contenders[int(np.argmin(seconds))], each)


def sample_of(rays: hrt.Rays, count: int) -> hrt.Rays:
    """Return about `count` of the rays, in a few runs of neighbours spread over the whole."""
    rows = np.arange(len(rays))
    return rays.take(np.concatenate([rows[block] for block in _blocks(len(rays), count, 1)]))


def _blocks(n: int, sample: int, shortest: int) -> list[slice]:
    """Return runs of neighbours, spread over `n` rays, that are about `sample` rays together."""
    sample = min(n, sample)
    count = min(BLOCKS, max(1, sample // shortest))
    length = sample // count
    starts = np.linspace(0, n - length, count).astype(np.int64)
    return [slice(int(start), int(start) + length) for start in starts]
