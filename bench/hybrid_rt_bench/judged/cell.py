"""Measure one cell of an experiment that judges: every point judged and, in timed cells, timed.

Judging and timing are apart. A point is judged once, with robust Embree as the fallback, so that
whatever is wrong comes from the march or from its hand-over. It is timed in front of the strongest
Embree, round after round, each time right beside that Embree tracing all the rays, now before it
and now after it.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt
from hybrid_rt_bench.judged import image_error
from hybrid_rt_bench.judged.columns import (
    EMBREE,
    MAP_CLASSES,
    PREPARED,
    T_ERRORS,
    VERDICTS,
    WRONG,
)
from hybrid_rt_bench.measure import shade, strongest
from hybrid_rt_bench.measure.loaded import LoadedScene
from hybrid_rt_bench.measure.queries import SAMPLED, Query
from hybrid_rt_bench.measure.screens import Screens
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.schema import HYBRID_STAGES

Columns = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Cell:
    """What is measured in a cell.

    Attributes
    ----------
    query : Query
    rays : Rays
    points : sequence of Point
    rounds : int
        Timed rounds; 0 for a counted cell.
    picture : bool
        Whether to keep error maps and the error of the image.
    selection_rays : int
        See `hybrid_rt_bench.measure.strongest.choose`.
    rivals : bool
        Whether Embree's two modes have rows of their own in a timed cell.
    """

    query: Query
    rays: hrt.Rays
    points: Sequence[hrt.Point]
    rounds: int
    picture: bool
    selection_rays: int
    rivals: bool = True


@dataclass(frozen=True, eq=False)
class JudgedRecord:
    """Everything that is kept of a cell, as rows for `RunWriter.add_cell`."""

    details: dict[str, Any]
    samples: list[dict[str, Any]]
    results: list[dict[str, Any]]
    verdicts: list[dict[str, Any]]
    picture: dict[str, Any] | None


def measure_cell(
    loaded: LoadedScene, screens: Screens, cell: Cell, on_pass: Callable[[], None] = lambda: None
) -> JudgedRecord:
    """Return verdicts, timings and, where asked for, the picture of one cell.

    `on_pass` is called whenever the rays have been through one point.
    """
    reference = cell.query.trace(loaded.reference, cell.rays)
    judged = _Judged(cell, screens, loaded, reference)
    for point in cell.points:
        judged.add(point)
        on_pass()
    samples: list[dict[str, Any]] = []
    details: dict[str, Any] = {"rays": len(cell.rays), "timed": cell.rounds > 0}
    if cell.rounds:
        choice = strongest.choose(
            loaded.candidates, cell.rays, cell.selection_rays, trace=cell.query.trace
        )
        rivals = {
            mode: _best_of(loaded.candidates, choice.nanoseconds, mode)
            for mode in (("default", "robust") if cell.rivals else ())
        }
        if cell.rivals:
            judged.add_embree("default", cell.query.trace(rivals["default"].tracer, cell.rays))
            judged.add_reference()
        samples = _time(cell, screens, choice.best.tracer, rivals, on_pass)
        details |= {
            "embree_path": choice.best.label,
            "embree_ns_per_ray": choice.nanoseconds,
            "rivals": {mode: rival.label for mode, rival in rivals.items()},
        }
    results = [{**row, **_timing_columns(row, samples)} for row in judged.results]
    return JudgedRecord(details, samples, results, judged.verdicts, judged.picture)


class _Judged:
    """The verdicts of a cell, point after point."""

    def __init__(self, cell: Cell, screens: Screens, loaded: LoadedScene, reference: Any) -> None:
        self.cell, self.screens, self.reference = cell, screens, reference
        self.gbuffer, self.camera = screens.gbuffer, screens.gbuffer.camera
        self.robust, self.truth = loaded.reference, loaded.truth
        self.results: list[dict[str, Any]] = []
        self.verdicts: list[dict[str, Any]] = []
        self.reference_wrong = np.zeros(len(cell.rays), np.bool_)
        self.picture: dict[str, Any] | None = None
        if cell.picture:
            self.image = shade.reflection(self.gbuffer, cell.rays, reference)
            self.picture = {"grey": np.round(255 * self.image.mean(axis=2)).astype(np.uint8)}

    def add(self, point: hrt.Point) -> None:
        """Judge what a point answers."""
        cell, screen = self.cell, self.screens.of(point.technique)
        result = cell.query.hybrid(cell.rays, screen, self.robust, self.screens.threads)
        claims = cell.query.claims(result)
        marched = result.marched
        judged = cell.query.judge(
            cell.rays, claims, self.reference, self.camera, self.truth, marched.pixel
        )
        self._note(judged)
        row = {
            **_names(point.name, point.label, point.default),
            **_count_columns(judged, marched.resolved),
            "steps": float(marched.steps.sum(dtype=np.int64)),
            "prepare_ms": 1e3 * screen.seconds,
            "prepare_mib": screen.nbytes / 2**20,
            "lists_mib": getattr(getattr(screen.data, "lists", None), "nbytes", 0) / 2**20,
            "tests": float(marched.tests),
        }
        if self.picture is not None and point.default:
            image = shade.reflection(self.gbuffer, cell.rays, claims)
            row |= image_error.columns(self.image, image)
            classes = _classes(cell.rays, marched.resolved, judged, self.gbuffer)
            self.picture[f"classes_{point.name}"] = classes
        self.results.append(row)
        self.verdicts += [
            {"technique": point.name, "point": point.label, **counted}
            for counted in _by_status(marched, judged)
        ]

    def add_embree(self, mode: str, claims: Any) -> None:
        """Judge what Embree answers in one of its modes."""
        judged = self.cell.query.judge(
            self.cell.rays, claims, self.reference, self.camera, self.truth
        )
        self._note(judged)
        row = _count_columns(judged, np.ones(len(self.cell.rays), np.bool_))
        if self.picture is not None:
            image = shade.reflection(self.gbuffer, self.cell.rays, claims)
            row |= image_error.columns(self.image, image)
        self.results.append(self._embree_row(mode, row))

    def add_reference(self) -> None:
        """Count where the reference itself was found wrong, by any of the points judged before."""
        cell = self.cell
        verdict = cell.query.kinds(
            cell.rays, self.reference, self.reference_wrong, self.camera, self.truth
        )
        counts = np.bincount(verdict, minlength=len(hrt.Verdict))
        found = {name: int(counts[hrt.Verdict[name.upper()]]) for name in VERDICTS}
        n = len(cell.rays)
        row = {"rays": n, "resolved": n, "alpha": 1.0, **found, **dict.fromkeys(T_ERRORS, np.nan)}
        row |= {f"all_{name}": count for name, count in found.items()}
        self.results.append(self._embree_row("robust", {**row, **_wrong_columns(row)}))

    def _embree_row(self, mode: str, row: Columns) -> Columns:
        nothing = {"steps": np.nan} | dict.fromkeys(PREPARED, 0.0)
        return {**_names(EMBREE, mode, mode == "robust"), **row, **nothing}

    def _note(self, judged: hrt.Judged) -> None:
        self.reference_wrong |= judged.reference_wrong


def _names(technique: str, point: str, default: bool) -> Columns:
    return {"technique": technique, "point": point, "default": default}


def _count_columns(judged: hrt.Judged, resolved: NDArray[np.bool_]) -> Columns:
    """Return the counts of a row: of every verdict, among resolved rays and among all."""
    size = len(hrt.Verdict)
    of_all = np.bincount(judged.verdict, minlength=size)
    of_resolved = np.bincount(judged.verdict[resolved], minlength=size)
    row: Columns = {"rays": len(judged), "resolved": int(resolved.sum())}
    for prefix, counts in (("", of_resolved), ("all_", of_all)):
        for name in VERDICTS:
            row[prefix + name] = int(counts[hrt.Verdict[name.upper()]])
    row["alpha"] = row["resolved"] / max(1, row["rays"])
    row |= _wrong_columns(row)
    errors = np.where(resolved & np.isfinite(judged.error_t), judged.error_t, np.nan)
    sample, found = errors[::SAMPLED], np.full(3, np.nan)
    if np.isfinite(sample).any():
        found = np.array([*np.nanquantile(sample, [0.5, 0.99]), np.nanmax(errors)])
    return row | dict(zip(T_ERRORS, found.tolist(), strict=True))


def _wrong_columns(row: Columns) -> Columns:
    wrong = hrt.Rate.of(sum(row[name] for name in WRONG), row["resolved"])
    return {"wrong_rate": wrong.value, "wrong_low": wrong.low, "wrong_high": wrong.high}


def _by_status(marched: hrt.Marched, judged: hrt.Judged) -> list[dict[str, Any]]:
    size = len(hrt.Verdict)
    verdict = np.where(marched.resolved, judged.verdict, hrt.Verdict.UNRESOLVED)
    counts = np.bincount(marched.status.astype(np.int64) * size + verdict)
    return [
        {
            "status": hrt.MarchStatus(key // size).name,
            "verdict": hrt.Verdict(key % size).name,
            "count": int(counts[key]),
        }
        for key in np.flatnonzero(counts).tolist()
    ]


def _classes(
    rays: hrt.Rays, resolved: NDArray[np.bool_], judged: hrt.Judged, gbuffer: hrt.GBuffer
) -> NDArray[np.uint8]:
    """Return the class of every pixel (see `MAP_CLASSES`)."""
    kinds = np.where(resolved, MAP_CLASSES["right"], MAP_CLASSES["unresolved"])
    for name in (*WRONG, "wrong_primitive"):
        kinds[judged.verdict == hrt.Verdict[name.upper()]] = MAP_CLASSES[name]
    classes = np.zeros(gbuffer.prim_id.shape, np.uint8)
    classes[rays.pixel[:, 1], rays.pixel[:, 0]] = kinds
    return classes


def _best_of(
    candidates: Sequence[strongest.Candidate], nanoseconds: dict[str, float], mode: str
) -> strongest.Candidate:
    mine = [c for c in candidates if c.tracer.robust is (mode == "robust")]
    return min(mine, key=lambda candidate: nanoseconds[candidate.label])


def _time(
    cell: Cell,
    screens: Screens,
    best: hrt.EmbreeTracer,
    rivals: dict[str, strongest.Candidate],
    on_pass: Callable[[], None],
) -> list[dict[str, Any]]:
    """Return the samples of all rounds: seconds of Embree and, beside it, of each point."""

    def hybrid(point: hrt.Point) -> dict[str, float]:
        screen = screens.of(point.technique)
        result = cell.query.hybrid(cell.rays, screen, best, screens.threads)
        stages = {stage: float(result.timings[stage]) for stage in HYBRID_STAGES}
        return {**stages, "hybrid": sum(stages.values())}

    def embree(tracer: hrt.EmbreeTracer) -> float:
        start = time.perf_counter()
        cell.query.trace(tracer, cell.rays)
        return time.perf_counter() - start

    runs: list[tuple[str, str, Callable[[], dict[str, float]]]] = [
        (point.name, point.label, lambda p=point: hybrid(p))  # type: ignore[misc]
        for point in cell.points
    ]
    runs += [
        (EMBREE, mode, lambda r=rival: {"hybrid": embree(r.tracer)})  # type: ignore[misc]
        for mode, rival in rivals.items()
    ]
    samples = []
    for number in range(cell.rounds):
        gc.collect()
        gc.disable()
        try:
            for k, (technique, label, run) in enumerate(runs):
                if (number + k) % 2:
                    beside, seconds = embree(best), run()
                else:
                    seconds, beside = run(), embree(best)
                names = {"technique": technique, "point": label, "round": number}
                samples.append({**names, "embree": beside, **seconds})
                on_pass()
        finally:
            gc.enable()
    return samples


def _timing_columns(row: Columns, samples: list[dict[str, Any]]) -> Columns:
    """Return medians in milliseconds and the median of the paired ratios with its interval."""
    mine = [s for s in samples if all(s[key] == row[key] for key in ("technique", "point"))]
    columns: Columns = {"timed": bool(mine)}
    for stage in (*HYBRID_STAGES, "hybrid", "embree"):
        values = [1e3 * s[stage] for s in mine if stage in s]
        columns[f"{stage}_ms"] = float(np.median(values)) if values else np.nan
    if mine:
        ratio = stats.paired_ratio([s["embree"] for s in mine], [s["hybrid"] for s in mine])
        values = [ratio.value, ratio.low, ratio.high]
    else:
        values = [np.nan] * 3
    return columns | dict(zip(("speedup", "speedup_low", "speedup_high"), values, strict=True))
