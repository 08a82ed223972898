"""Run an experiment that judges: every cell judged, some of them timed, each kept when done."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench.judged import cell as judged_cell
from hybrid_rt_bench.judged.columns import EMBREE, SCHEMA
from hybrid_rt_bench.judged.spec import JudgedExperiment, Which, WorkloadEntry
from hybrid_rt_bench.measure import compiling
from hybrid_rt_bench.measure.errors import CellError
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.measure.lifecycle import (
    Outcome,
    Request,
    Session,
    carry_out,
    cell_keys,
)
from hybrid_rt_bench.measure.loaded import LoadedScene, prepare
from hybrid_rt_bench.measure.plan import PlannedScene
from hybrid_rt_bench.measure.queries import query_of
from hybrid_rt_bench.measure.screens import Screens, points_of
from hybrid_rt_bench.measure.workloads import Workload, get_workload

PICTURED = "mirror"
"""The workload whose image is looked at: one ray a pixel, the same in every run."""


Techniques = dict[str, type[hrt.Technique]]


@dataclass(frozen=True)
class PlannedCell:
    """A cell before its rays are made.

    Attributes
    ----------
    entry : WorkloadEntry
    seed : int
    timed : bool
    points : tuple of Point
    rivals : bool
        Whether Embree's two modes are measured as well.
    """

    entry: WorkloadEntry
    seed: int
    timed: bool
    points: tuple[hrt.Point, ...]
    rivals: bool = False

    def passes(self, rounds: int) -> int:
        """Return how often the rays go through a point: once to be judged, then once a round."""
        judged = len(self.points)
        return judged + (rounds * (judged + 2 * self.rivals) if self.timed else 0)


def run_judged(experiment: JudgedExperiment, request: Request) -> Outcome:
    """Measure an experiment that judges and write its folder."""
    techniques = {name: hrt.TECHNIQUES[name] for name in experiment.techniques}
    for entry in experiment.workloads:
        get_workload(entry.name)
    return carry_out(
        experiment,
        request,
        request.plan(experiment),
        SCHEMA,
        stages=lambda: stages_to_compile(experiment, techniques, request.workers),
        measure_all=lambda session: _Run(experiment, techniques, session).measure(),
    )


def plan_cells(
    experiment: JudgedExperiment,
    techniques: Techniques,
    resolution: Resolution,
    camera: int,
) -> list[PlannedCell]:
    """Return the cells of one view, in order.

    Parameters
    ----------
    experiment : JudgedExperiment
    techniques : dict of type
    resolution : Resolution
    camera : int
        Its number in the scene.
    """
    cells = []
    for entry in experiment.workloads:
        for seed in range(entry.seeds):
            timed = (
                seed == 0
                and resolution in experiment.timed
                and (entry.cameras is None or camera < entry.cameras)
            )
            complete = timed and (experiment.complete is None or resolution in experiment.complete)
            which: Which = entry.points if timed else "default"
            names = experiment.techniques if complete else experiment.counted
            found = [points_of(techniques[name], which) for name in names]
            if found:
                points = tuple(point for some in found for point in some)
                cells.append(PlannedCell(entry, seed, timed, points, complete))
    return cells


class _Run:
    """All cells of a run, one after the other."""

    def __init__(
        self, experiment: JudgedExperiment, techniques: Techniques, session: Session
    ) -> None:
        self.experiment, self.techniques, self.session = experiment, techniques, session
        self.reporter = session.reporter
        self.started, self.done, self.total = time.monotonic(), 0.0, 0.0

    def measure(self) -> None:
        """Measure every scene."""
        self.total = sum(self._work(planned) for planned in self.session.plan.scenes)
        self.reporter.total(self.total, "Mrays, all points")
        self.session.each_scene(
            self.session.load,
            self._measure_scene,
            lambda planned: self._advance(self._work(planned)),
        )

    def _measure_scene(self, planned: PlannedScene, loaded: LoadedScene) -> None:
        for number, camera in enumerate(planned.cameras):
            for resolution in self.experiment.resolutions:
                self._measure_view(planned, loaded, number, camera, resolution)

    def _measure_view(
        self,
        planned: PlannedScene,
        loaded: LoadedScene,
        number: int,
        camera: str,
        resolution: Resolution,
    ) -> None:
        cells = plan_cells(self.experiment, self.techniques, resolution, number)
        screens = self.session.measured(
            _keys(cell_keys(planned.name, camera, resolution)),
            lambda: _screens(
                loaded.scene,
                planned.spec.camera(camera, resolution.width, resolution.height),
                self.session.threads,
            ),
            lambda: self._advance(sum(self._cell_work(cell, resolution) for cell in cells)),
        )
        if screens is not None:
            for cell in cells:
                self._measure_cell(planned, loaded, screens, camera, resolution, cell)

    def _measure_cell(
        self,
        planned: PlannedScene,
        loaded: LoadedScene,
        screens: Screens,
        camera: str,
        resolution: Resolution,
        cell: PlannedCell,
    ) -> None:
        workload = get_workload(cell.entry.name)
        name = f"{planned.name}, {camera}, {resolution}, {workload.name}"
        self.reporter.doing(name)
        before, whole = self.done, self._cell_work(cell, resolution)
        keys = _keys(cell_keys(planned.name, camera, resolution), workload, cell.seed)

        def measure() -> judged_cell.JudgedRecord:
            rays = workload.make(planned.spec, screens.gbuffer, cell.seed)
            if len(rays) == 0:
                raise CellError(f"{name}: no rays, since the camera sees no surface")
            pictured = workload.name == PICTURED and resolution == self.experiment.picture
            asked = judged_cell.Cell(
                query_of(workload),
                rays,
                cell.points,
                self.experiment.rounds if cell.timed else 0,
                cell.timed and pictured,
                self.experiment.selection_rays,
                cell.rivals,
            )
            share = whole / cell.passes(self.experiment.rounds)
            return judged_cell.measure_cell(loaded, screens, asked, lambda: self._advance(share))

        record = self.session.measured(
            keys, measure, lambda: self._advance(whole - (self.done - before))
        )
        if record is not None:
            self.session.writer.add_cell(
                {**keys, **record.details},
                record.samples,
                record.results,
                record.verdicts,
                record.picture,
            )
            self.session.say_off_terminal(f"{name}{_said(record.results, cell)}{self._eta()}")

    def _work(self, planned: PlannedScene) -> float:
        """Return the millions of rays that go through points for a scene."""
        return sum(
            self._cell_work(cell, resolution)
            for number in range(len(planned.cameras))
            for resolution in self.experiment.resolutions
            for cell in plan_cells(self.experiment, self.techniques, resolution, number)
        )

    def _cell_work(self, cell: PlannedCell, resolution: Resolution) -> float:
        pixels = resolution.width * resolution.height / 1e6
        return pixels * cell.passes(self.experiment.rounds)

    def _advance(self, amount: float) -> None:
        self.done += amount
        self.reporter.advance(amount)

    def _eta(self) -> str:
        left = (time.monotonic() - self.started) * (self.total / max(self.done, 1e-9) - 1)
        share = 100 * self.done / self.total
        return f"; {share:.0f} % done, about {max(left, 0.0) / 60:.0f} min left"


def _screens(scene: hrt.Scene, camera: hrt.Camera, threads: int) -> Screens:
    return Screens(hrt.rasterize(scene, camera, threads=threads), threads)


def _keys(view: dict[str, Any], workload: Workload | None = None, seed: int = 0) -> dict[str, Any]:
    """Return the keys of a cell of a view, or of the view as a whole."""
    return {**view, "workload": workload.name if workload else "", "seed": seed}


def _said(results: list[dict[str, Any]], cell: PlannedCell) -> str:
    """Return what is said of a finished cell on a console without a bar."""
    shown = [row for row in results if row["default"] and row["technique"] != EMBREE]
    parts = [
        f"{row['technique']} alpha {row['alpha']:.3f}, {_wrong(row)}"
        + (f", speed-up {row['speedup']:.2f}" if cell.timed else "")
        for row in shown
    ]
    return ": " + "; ".join(parts)


def _wrong(row: dict[str, Any]) -> str:
    if not row["resolved"]:
        return "no ray resolved"
    return f"{100 * row['wrong_rate']:.3g} % of resolved rays wrong"


def stages_to_compile(
    experiment: JudgedExperiment, techniques: Techniques, threads: int
) -> compiling.Stages:
    """Return what is to be compiled: each technique, then each workload through all of them."""
    spec = hrs.get_scene("cornell")
    loaded = prepare(spec.load(), threads)
    camera = spec.camera(next(iter(spec.cameras)), 64, 48)

    def cell(entry: WorkloadEntry, names: Sequence[str]) -> Callable[[], Any]:
        def measure() -> None:
            workload = get_workload(entry.name)
            screens = _screens(loaded.scene, camera, threads)
            points = [p for name in names for p in points_of(techniques[name], entry.points)]
            rays = workload.make(spec, screens.gbuffer, 0)
            pictured = workload.name == PICTURED
            asked = judged_cell.Cell(query_of(workload), rays, points, 1, pictured, 1024)
            judged_cell.measure_cell(loaded, screens, asked)

        return measure

    first = experiment.workloads[0]
    return {
        "raster": lambda: hrt.rasterize(loaded.scene, camera, threads=threads),
        **{name: cell(first, [name]) for name in techniques},
        **{f"{entry.name} rays": cell(entry, list(techniques)) for entry in experiment.workloads},
    }
