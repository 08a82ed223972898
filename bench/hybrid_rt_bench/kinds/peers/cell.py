"""Measure one view through all peers: each answer held against robust Embree, each timed in turn.

A peer's first call is apart: it compiles, and is judged. Then, round after round, every peer traces
all the rays right beside the strongest Embree tracing them, now before it and now after it; ratios
are taken inside such a pair. Pictures are timed in the same way beside our own raster.
"""

from __future__ import annotations

import dataclasses
import gc
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.peers import agreement
from hybrid_rt_bench.kinds.peers.columns import TIMES
from hybrid_rt_bench.kinds.peers.programs import RASTER
from hybrid_rt_bench.kinds.peers.programs.base import Opened, Peer, View
from hybrid_rt_bench.kinds.peers.programs.ours import Embree
from hybrid_rt_bench.measure import strongest
from hybrid_rt_bench.measure.errors import reason_of
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.files import ReportsError

MORE = 4
"""By how many times a sampled peer's rays grow until it takes long enough to know its rate."""

NOT_TIMED = ("convert_ms", "first_ms", "read_ms", *(column.name for column in TIMES))

Row = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Contender:
    """A peer in a run: opened, or the reason why it is not.

    Attributes
    ----------
    peer : Peer
    opened : Opened, optional
    reason : str
    peak_mib : float
        See `hybrid_rt_bench.kinds.peers.trial.Trial`.
    """

    peer: Peer
    opened: Opened | None
    reason: str = ""
    peak_mib: float = float("nan")

    def row(self, workload: str, **more: Any) -> Row:
        """Return what is known of the peer before it has traced anything, as a row of results."""
        opened = self.opened
        return {
            "technique": self.peer.name,
            "workload": workload,
            "state": "ok" if opened is not None else "absent",
            "reason": self.reason,
            "threads": opened.threads if opened is not None else 0,
            "build_seconds": opened.build_seconds if opened is not None else np.nan,
            "peak_mib": self.peak_mib,
            "sampled": self.peer.sampled,
            "label": "",
            "rays": 0,
            **dict.fromkeys(
                ("convert_ms", "first_ms", "read_ms", *(c.name for c in TIMES)), np.nan
            ),
            **more,
        }


@dataclass(eq=False)
class _Runner:
    """What is timed of a contender, and its samples."""

    row: Row
    run: Callable[[], Any]
    read: Callable[[], Any] | None = None
    samples: list[Row] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class PeersRecord:
    """Everything that is kept of a cell, as rows for `RunWriter.add_cell`."""

    details: dict[str, Any]
    samples: list[Row]
    results: list[Row]


def measure_cell(
    contenders: Iterable[Contender],
    base: Embree,
    camera: hrt.Camera,
    gbuffer: hrt.GBuffer,
    rounds: int,
    selection_rays: int,
    sample_seconds: float,
    on_pass: Callable[[], None] = lambda: None,
) -> PeersRecord:
    """Return the timings and the agreement of all peers on one view.

    Parameters
    ----------
    contenders : iterable of Contender
    base : Embree
        Over the same scene.
    camera : Camera
    gbuffer : GBuffer
        Of that camera.
    rounds, selection_rays, sample_seconds
        As in `PeersExperiment`.
    on_pass : callable
        Called whenever a peer has been through a workload.
    """
    contenders = list(contenders)
    results: list[Row] = []
    samples: list[Row] = []
    details: dict[str, Any] = {}
    tracing = [c for c in contenders if not c.peer.raster]
    for workload, rays, seen in (
        ("mirror", hrt.mirror_rays(gbuffer), gbuffer),
        ("primary", _from_the_eye(camera), None),
    ):
        choice = strongest.choose(base.candidates, rays, selection_rays)
        view = View(workload, rays, seen, choice.best.tracer, choice.best.label)
        details |= {f"{workload}_rays": len(rays), f"{workload}_path": choice.best.label}
        found = _trace(tracing, view, base.reference, rounds, sample_seconds, on_pass)
        for runner in found:
            results.append(runner.row)
            samples += runner.samples
    drawing = [c for c in contenders if c.peer.raster]
    for runner in _draw(drawing, camera, gbuffer, rounds, on_pass):
        results.append(runner.row)
        samples += runner.samples
    return PeersRecord(details, samples, results)


def _from_the_eye(camera: hrt.Camera) -> hrt.Rays:
    """Return primary rays without t_near, which no peer can be told of."""
    rays = hrt.primary_rays(camera, order="tiles")
    return hrt.Rays.from_arrays(rays.origin, rays.direction)


def _trace(
    contenders: list[Contender],
    view: View,
    reference: hrt.EmbreeTracer,
    rounds: int,
    sample_seconds: float,
    on_pass: Callable[[], None],
) -> list[_Runner]:
    truth = reference.intersect(view.rays)
    tracer = view.tracer or reference

    def prepare(contender: Contender) -> _Runner | None:
        assert contender.opened is not None
        asked, beside = view, truth
        if contender.peer.sampled:
            index = _sample(contender.opened, view, sample_seconds)
            asked = dataclasses.replace(view, rays=view.rays.take(index))
            beside = _take(truth, index)
        start = time.perf_counter()
        query = contender.opened.load(asked)
        if query is None:
            return None
        loaded = time.perf_counter()
        found = query.run()
        called = time.perf_counter()
        row = contender.row(
            view.workload,
            label=query.label,
            rays=len(asked.rays),
            convert_ms=1e3 * (loaded - start),
            first_ms=1e3 * (called - loaded),
            **agreement.of_rays(query.answers(found), beside, asked.rays),
        )
        return _Runner(row, query.run)

    runners = _prepared(contenders, view.workload, prepare, on_pass)
    _time(runners, lambda: tracer.intersect(view.rays), len(view.rays), rounds)
    return runners


def _draw(
    contenders: list[Contender],
    camera: hrt.Camera,
    gbuffer: hrt.GBuffer,
    rounds: int,
    on_pass: Callable[[], None],
) -> list[_Runner]:
    pixels = camera.width * camera.height

    def prepare(contender: Contender) -> _Runner:
        assert contender.opened is not None
        start = time.perf_counter()
        drawing = contender.opened.draw(camera)
        loaded = time.perf_counter()
        drawing.draw()
        called = time.perf_counter()
        row = contender.row(
            RASTER,
            rays=pixels,
            convert_ms=1e3 * (loaded - start),
            first_ms=1e3 * (called - loaded),
            **agreement.of_pictures(drawing.read(), gbuffer),
        )
        return _Runner(row, drawing.draw, drawing.read)

    runners = _prepared(contenders, RASTER, prepare, on_pass)
    threads = next((c.opened.threads for c in contenders if c.opened), 1)
    scene = gbuffer.known_scene
    _time(runners, lambda: hrt.rasterize(scene, camera, threads=threads), pixels, rounds)
    return runners


def _prepared(
    contenders: list[Contender],
    workload: str,
    prepare: Callable[[Contender], _Runner | None],
    on_pass: Callable[[], None],
) -> list[_Runner]:
    """Return a runner for each contender; one that cannot run has a row that says why."""
    runners = []
    for contender in contenders:
        if contender.opened is None:
            runners.append(_Runner(contender.row(workload), _never))
            continue
        try:
            runner = prepare(contender)
        except ReportsError:
            raise
        except Exception as error:  # whatever a peer raises is its own row's affair
            row = contender.row(workload, state="error", reason=reason_of(error))
            runner = _Runner(row, _never)
        if runner is not None:
            runners.append(runner)
        on_pass()
    return runners


def _never() -> None:
    raise AssertionError("a peer that cannot run is not timed")


def _time(runners: list[_Runner], beside: Callable[[], Any], amount: int, rounds: int) -> None:
    """Time every runner that can run beside `beside`, which does `amount` of the same work."""
    for number in range(rounds):
        for k, runner in enumerate(runners):
            if runner.row["state"] != "ok":
                continue
            gc.collect()
            gc.disable()
            try:
                sample = _pair(runner, beside, amount, beside_first=(number + k) % 2 == 0)
            except Exception as error:
                runner.row |= {"state": "error", "reason": reason_of(error)}
                runner.samples.clear()
                continue
            finally:
                gc.enable()
            names = {key: runner.row[key] for key in ("technique", "workload")}
            runner.samples.append({**names, "round": number, **sample})
    for runner in runners:
        if runner.samples:
            runner.row |= _timing_columns(runner.row["rays"], runner.samples)


def _pair(
    runner: _Runner, beside: Callable[[], Any], amount: int, *, beside_first: bool
) -> dict[str, float]:
    def embree() -> float:
        start = time.perf_counter()
        beside()
        return time.perf_counter() - start

    other = embree() if beside_first else 0.0
    start, busy = time.perf_counter(), time.process_time()
    found = runner.run()
    seconds, cpu = time.perf_counter() - start, time.process_time() - busy
    read = float("nan")
    if runner.read is not None:
        start = time.perf_counter()
        runner.read()
        read = time.perf_counter() - start
    del found
    if not beside_first:
        other = embree()
    sample = {"seconds": seconds, "cpu_seconds": cpu, "read_seconds": read}
    return {**sample, "beside": other, "beside_rays": amount}


def _timing_columns(rays: int, samples: list[Row]) -> Row:
    """Return medians in milliseconds, and the median of the paired ratios of the times per ray."""
    seconds = np.array([s["seconds"] for s in samples])
    other = np.array([s["beside"] / s["beside_rays"] for s in samples])
    middle = stats.median(1e3 * seconds)
    ratio = stats.paired_ratio(seconds / rays, other)
    return {
        "ms": middle.value,
        "ms_low": middle.low,
        "ms_high": middle.high,
        "read_ms": 1e3 * float(np.median([s["read_seconds"] for s in samples])),
        "cores": float(np.median([s["cpu_seconds"] / s["seconds"] for s in samples])),
        "ratio": ratio.value,
        "ratio_low": ratio.low,
        "ratio_high": ratio.high,
    }


def _sample(opened: Opened, view: View, seconds: float) -> Any:
    """Return the indices of about as many rays, spread over the view, as take `seconds`.

    It begins with one ray: a peer may need a second for each.
    """
    rays, count = view.rays, 1
    while True:
        query = opened.load(dataclasses.replace(view, rays=rays.take(_spread(len(rays), count))))
        if query is None:
            break
        start = time.perf_counter()
        query.run()
        took = time.perf_counter() - start
        if count == len(rays) or took * MORE >= seconds:
            count = max(1, min(len(rays), int(count * seconds / took)))
            break
        count = min(len(rays), count * MORE)
    return _spread(len(rays), count)


def _spread(n: int, count: int) -> Any:
    """Return `count` of `n` indices, evenly spread, none at an end."""
    return ((np.arange(count) + 0.5) * n / count).astype(np.int64)


def _take(hits: hrt.Hits, index: Any) -> hrt.Hits:
    return hrt.Hits(*(array[index] for array in hits.arrays))
