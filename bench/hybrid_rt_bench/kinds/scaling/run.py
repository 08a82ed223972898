"""Run an experiment of kind "scaling": series after series, the cells of each in turn."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.executors.processes import Worker, WorkerError
from hybrid_rt_bench.kinds.scaling import cell as scaling_cell
from hybrid_rt_bench.kinds.scaling.cell import Task, Visit
from hybrid_rt_bench.kinds.scaling.columns import SCHEMA
from hybrid_rt_bench.kinds.scaling.spec import ScalingExperiment, Series
from hybrid_rt_bench.kinds.scaling.stages import (
    SHARED,
    Key,
    rows_of,
    unstable,
    with_sums,
)
from hybrid_rt_bench.measure.errors import NothingToRunError
from hybrid_rt_bench.measure.lifecycle import Outcome, Request, Session, carry_out, described
from hybrid_rt_bench.measure.plan import Plan, find_scene, size_text

FEW_THREADS = 8
"""Up to so many threads every number is measured, beyond them about three in each doubling."""


@dataclass(frozen=True)
class PlannedCell:
    """A cell before anything of it is loaded.

    Attributes
    ----------
    x : int
        Where it stands on the axis: triangles, pixels or threads.
    label : str
        The same, to be read.
    task : Task
    """

    x: int
    label: str
    task: Task


@dataclass(frozen=True)
class PlannedSeries:
    """A series with its cells, in ascending order."""

    series: Series
    cells: tuple[PlannedCell, ...]


@dataclass
class Measured:
    """What is known and measured of a cell so far.

    Attributes
    ----------
    series : Series
    planned : PlannedCell
    details : dict
        See `hybrid_rt_bench.kinds.scaling.cell.Cell`.
    samples : list of dict
    alpha, steps : dict of float
    peak : int
        Most bytes of memory in any visit, 0 where the system does not say.
    """

    series: Series
    planned: PlannedCell
    details: dict[str, Any]
    samples: list[dict[str, Any]] = field(default_factory=list)
    alpha: dict[str, float] = field(default_factory=dict)
    steps: dict[str, float] = field(default_factory=dict)
    peak: int = 0

    def add(self, visit: Visit) -> None:
        """Take in what a visit found."""
        self.samples += visit.rows
        self.alpha, self.steps = visit.alpha, visit.steps
        self.peak = max(self.peak, visit.peak or 0)

    def seconds(self) -> dict[Key, Any]:
        """Return the seconds of each measured round by technique and stage, sums too."""
        found: dict[Key, list[float]] = {}
        for row in self.samples:
            if row["phase"] == "measured":
                found.setdefault((row["technique"], row["stage"]), []).append(row["seconds"])
        arrays = {key: np.array(values) for key, values in found.items()}
        return with_sums(arrays, self.planned.task.techniques)

    def record(self) -> tuple[dict[str, Any], list[dict[str, Any]], list[dict[str, Any]]]:
        """Return the cell, its samples and its results, for `RunWriter.add_cell`."""
        task, details = self.planned.task, self.details
        place = {
            "scene": task.scene, "camera": task.camera, "width": task.width, "height": task.height,
            "triangles": details["triangles"], "threads": task.threads,
            "label": self.planned.label, "axis": self.series.axis, "rays": details["rays"],
        }  # fmt: skip
        memory = {
            "peak_bytes": self.peak,
            "program_bytes": details["program_bytes"],
            "scene_bytes": details["scene_bytes"],
        }
        seconds = self.seconds()
        sampled = min(task.brute_rays, details["rays"])
        rows = [
            {
                **place,
                **row,
                **memory,
                "alpha": self.alpha.get(row["technique"], float("nan")),
                "steps_per_ray": self.steps.get(row["technique"], float("nan")),
                "embree_path": details["embree_path"],
            }
            for row in rows_of(seconds, {"brute_force": sampled}, details["rays"])
        ]
        cell = {
            **_keys(self.series, self.planned),
            **place,
            **details,
            **memory,
            "alpha": self.alpha,
            "steps_per_ray": self.steps,
            "unstable": unstable(seconds),
        }
        return cell, self.samples, rows


@dataclass
class _Live:
    """A cell whose process is alive."""

    measured: Measured
    worker: Worker
    took: float = 0.0


def run_scaling(experiment: ScalingExperiment, request: Request) -> Outcome:
    """Measure an experiment of kind "scaling" and write its folder.

    Threads are those of the cells of other axes, and the most on the axis "threads". After Ctrl-C
    the rounds measured so far are kept.
    """
    experiment = experiment.picked(request.picks.get("series"), request.picks.get("triangles"))
    for name in experiment.techniques:
        hrt.TECHNIQUES[name]  # refuses an unknown one, with a suggestion
    planned, notes = plan_series(experiment, request.workers)

    return carry_out(
        experiment,
        request,
        Plan(notes=notes),
        SCHEMA,
        stages=lambda: scaling_cell.stages_to_compile(planned[0].cells[0].task),
        measure_all=lambda session: _Run(experiment, planned, session).measure(),
    )


def plan_series(
    experiment: ScalingExperiment, threads: int
) -> tuple[list[PlannedSeries], list[str]]:
    """Return the series that can be measured, and what is to be said of the others.

    Parameters
    ----------
    experiment : ScalingExperiment
    threads : int
        The most that any cell uses.

    Raises
    ------
    UnknownNameError, ArgumentError, MeshFileError
        A scene or camera that does not exist, a number of triangles for a scene that has only one.
    NothingToRunError
        No series is left.
    """
    planned, notes = [], []
    for series in experiment.series:
        spec = find_scene(series.scene)
        if series.triangles and not spec.resizable:
            raise hrt.ArgumentError(
                f"series {series.name!r}: scene",
                "one whose number of triangles can be chosen",
                repr(series.scene),
            )
        camera = series.camera or next(iter(spec.cameras))
        spec.camera(camera, 16, 9)  # refuses an unknown one, with a suggestion
        missing = spec.missing()
        if missing is not None:
            notes.append(f"series {series.name!r} is left out: {missing}")
            continue
        counts = _thread_counts(threads) if series.threads is None else sorted(set(series.threads))
        beyond = [str(count) for count in counts if count > threads]
        if series.axis == "threads" and beyond:
            notes.append(
                f"series {series.name!r} goes without {', '.join(beyond)} threads: "
                f"{threads} can be used"
            )
        cells = _cells(experiment, series, camera, [c for c in counts if c <= threads], threads)
        if cells:
            planned.append(PlannedSeries(series, tuple(cells)))
    if not planned:
        raise NothingToRunError("nothing left to run\n" + "\n".join(notes))
    return planned, notes


def _cells(
    experiment: ScalingExperiment, series: Series, camera: str, counts: list[int], threads: int
) -> list[PlannedCell]:
    def task(size: int | None, resolution: Any, workers: int) -> Task:
        brute = series.brute_force
        return Task(
            series.scene, camera, size, resolution.width, resolution.height, workers,
            tuple(experiment.techniques), experiment.selection_rays, series.build,
            brute.rays if brute else 0, brute.seconds if brute else 0.0,
        )  # fmt: skip

    sizes: list[int | None] = [*series.triangles] or [None]
    resolutions = sorted(set(series.resolutions), key=lambda r: r.width * r.height)
    if series.axis == "triangles":
        return [
            PlannedCell(size, size_text(size), task(size, resolutions[0], threads))
            for size in series.triangles
        ]
    if series.axis == "pixels":
        return [
            PlannedCell(r.width * r.height, str(r), task(sizes[0], r, threads)) for r in resolutions
        ]
    return [PlannedCell(n, str(n), task(sizes[0], resolutions[0], n)) for n in counts]


class _Run:
    """All series of a run, one after the other."""

    def __init__(
        self,
        experiment: ScalingExperiment,
        planned: list[PlannedSeries],
        session: Session,
    ) -> None:
        self.experiment, self.planned, self.session = experiment, planned, session
        self.writer, self.reporter = session.writer, session.reporter

    def measure(self) -> None:
        """Measure every series."""
        visits = self.experiment.rounds + 1  # to be made ready counts as one
        self.reporter.total(visits * sum(len(p.cells) for p in self.planned), "steps")
        named = dict.fromkeys(planned.series.scene for planned in self.planned)
        self.writer.meta["scenes"] += [described(find_scene(name), name) for name in named]
        for planned in self.planned:
            live: list[_Live] = []
            try:
                self._make_ready(planned, live)
                self._measure_rounds(planned.series, live)
            finally:
                for cell in live:
                    cell.worker.stop()
        self.session.warn_of_scatter(lambda cell: f"{cell['series']}, {cell['label']}")

    def _make_ready(self, planned: PlannedSeries, live: list[_Live]) -> None:
        for cell in planned.cells:
            name = f"{planned.series.name}, {cell.label}"
            self.reporter.doing(f"{name}: making ready")
            start = time.monotonic()
            worker = Worker(scaling_cell.Cell, cell.task)
            try:
                details = worker.ready()
            except WorkerError as error:
                worker.stop()
                self._fail(planned.series, cell, str(error))
                self.reporter.advance(self.experiment.rounds + 1)
                continue
            except BaseException:
                worker.stop()
                raise
            live.append(_Live(Measured(planned.series, cell, details), worker))
            self.reporter.advance()
            self.session.say_off_terminal(
                f"{name}: ready in {time.monotonic() - start:.0f} s, {details['rays']:,} rays, "
                f"strongest Embree: {details['embree_path']}"
            )

    def _measure_rounds(self, series: Series, live: list[_Live]) -> None:
        rounds = self.experiment.rounds
        for number in range(rounds):
            # Up and down in turn, so that a machine that grows slower does not tilt the line.
            for cell in list(live) if number % 2 == 0 else list(reversed(live)):
                self.reporter.doing(
                    f"{series.name}, {cell.measured.planned.label}: round {number + 1} of {rounds}"
                )
                start = time.monotonic()
                try:
                    visit = cell.worker.ask(number, self.experiment.warmup)
                except WorkerError as error:
                    cell.worker.stop()
                    live.remove(cell)
                    self._fail(
                        series, cell.measured.planned, f"in round {number + 1} of {rounds}: {error}"
                    )
                    self.reporter.advance(rounds - number)
                    continue
                cell.took = time.monotonic() - start
                cell.measured.add(visit)
                details, samples, rows = cell.measured.record()
                self.writer.add_cell(details, samples, rows, [])
                self.reporter.advance()
            if live:
                left = sum(cell.took for cell in live) * (rounds - number - 1)
                self.session.say_off_terminal(
                    f"{series.name}: round {number + 1} of {rounds} done"
                    + (f", about {_duration(left)} left of this series" if left else "")
                )
        for cell in live:
            label = cell.measured.planned.label
            self.session.say_off_terminal(f"{series.name}, {label}: {_said(cell.measured)}")

    def _fail(self, series: Series, cell: PlannedCell, reason: str) -> None:
        self.session.failed({**_keys(series, cell), "label": cell.label}, reason)


def _said(cell: Measured) -> str:
    """Return what is said of a finished cell on a console without a bar."""
    seconds = cell.seconds()

    def ms(technique: str, stage: str) -> str:
        return f"{1e3 * float(np.median(seconds[technique, stage])):.3g} ms"

    parts = [f"raster {ms(SHARED, 'raster')}", f"Embree {ms(SHARED, 'embree')}"]
    parts += [
        f"{name} march {ms(name, 'march')}, hybrid {ms(name, 'hybrid')}"
        for name in cell.planned.task.techniques
    ]
    if cell.peak:
        parts.append(f"peak {cell.peak / 2**20:.0f} MiB")
    return "; ".join(parts)


def _keys(series: Series, cell: PlannedCell) -> dict[str, Any]:
    return {"series": series.name, "x": cell.x}


def _thread_counts(most: int) -> list[int]:
    """Return 1 to `most`, thinned out above `FEW_THREADS`, `most` always among them."""
    counts = set(range(1, min(most, FEW_THREADS) + 1)) | {most}
    step = float(FEW_THREADS)
    while step < most:
        counts.add(round(step))
        step *= 2 ** (1 / 3)
    return sorted(counts)


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
