"""Run an experiment of kind "error": every cell judged, some of them timed, each kept when done."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench import env, error_cell
from hybrid_rt_bench.error_spec import ErrorExperiment, Which, WorkloadEntry
from hybrid_rt_bench.measure import CellError, LoadedScene, prepare
from hybrid_rt_bench.plan import Plan, PlannedScene, make_plan
from hybrid_rt_bench.points import Point, View, points_of
from hybrid_rt_bench.pooling import CELL
from hybrid_rt_bench.progress import Reporter
from hybrid_rt_bench.queries import query_of
from hybrid_rt_bench.results import ReportsError, RunWriter
from hybrid_rt_bench.run import (
    Outcome,
    carry_out,
    cell_keys,
    fail,
    load_planned,
    reason_of,
)
from hybrid_rt_bench.spec_base import Resolution
from hybrid_rt_bench.techniques import Technique, get_technique
from hybrid_rt_bench.workloads import get_workload

PICTURED = "mirror"
"""The workload whose image is looked at: one ray a pixel, the same in every run."""


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
    points: tuple[Point, ...]
    rivals: bool = False

    def passes(self, rounds: int) -> int:
        """Return how often the rays go through a point: once to be judged, then once a round."""
        judged = len(self.points)
        return judged + (rounds * (judged + 2 * self.rivals) if self.timed else 0)


def run_error(
    experiment: ErrorExperiment,
    *,
    reporter: Reporter,
    scenes: Sequence[str] | None = None,
    cameras: Sequence[str] | None = None,
    threads: int | None = None,
    out: Path = Path("reports"),
    command: Sequence[str] = (),
) -> Outcome:
    """Measure an experiment of kind "error" and write its folder.

    Parameters, returns and raises: see `hybrid_rt_bench.run.run_experiment`.
    """
    workers = env.checked_threads(threads)
    techniques = {name: get_technique(name) for name in experiment.techniques}
    for entry in experiment.workloads:
        get_workload(entry.name)
    reporter.doing("reading scenes")
    plan = make_plan(experiment, scenes, cameras)
    return carry_out(
        experiment,
        plan,
        reporter=reporter,
        threads=workers,
        out=out,
        command=command,
        compile_all=lambda: _compile(experiment, techniques, workers),
        measure_all=lambda writer: _Run(
            experiment, plan, techniques, workers, writer, reporter
        ).measure(),
        keys=CELL,
    )


def plan_cells(
    experiment: ErrorExperiment,
    techniques: dict[str, Technique],
    scene: hrt.Scene,
    resolution: Resolution,
    camera: int,
) -> list[PlannedCell]:
    """Return the cells of one view, in order.

    Parameters
    ----------
    experiment : ErrorExperiment
    techniques : dict of Technique
    scene : Scene
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
            found = [points_of(techniques[name], scene, which) for name in names]
            if found:
                points = tuple(point for some in found for point in some)
                cells.append(PlannedCell(entry, seed, timed, points, complete))
    return cells


class _Run:
    """All cells of a run, one after the other."""

    def __init__(
        self,
        experiment: ErrorExperiment,
        plan: Plan,
        techniques: dict[str, Technique],
        threads: int,
        writer: RunWriter,
        reporter: Reporter,
    ) -> None:
        self.experiment, self.plan, self.techniques = experiment, plan, techniques
        self.threads, self.writer, self.reporter = threads, writer, reporter
        self.small = hrs.get_scene("cornell").load()
        self.started, self.done, self.total = time.monotonic(), 0.0, 0.0

    def measure(self) -> None:
        """Measure every scene."""
        for path, reason in self.plan.unreadable:
            self._fail(Path(path).stem, "", None, reason)
        work = {id(planned): self._work(planned) for planned in self.plan.scenes}
        self.total = sum(work.values())
        self.reporter.total(self.total, "Mrays, all points")
        for planned in self.plan.scenes:
            self._measure_scene(planned, work[id(planned)])

    def _measure_scene(self, planned: PlannedScene, work: float) -> None:
        # The scene ends with this call: two of them together may be more than there is memory for.
        self.reporter.doing(f"loading {planned.name}")
        try:
            loaded = load_planned(planned, self.threads, self.writer)
        except (hrt.HybridRTError, MemoryError) as error:
            self._fail(planned.name, "", None, reason_of(error))
            self._advance(work)
            return
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
        cells = plan_cells(self.experiment, self.techniques, loaded.scene, resolution, number)
        try:
            seen = planned.spec.camera(camera, resolution.width, resolution.height)
            view = View(loaded.scene, seen, self.threads)
        except Exception as error:
            self._fail(planned.name, camera, resolution, reason_of(error))
            self._advance(sum(self._cell_work(cell, resolution) for cell in cells))
            return
        for cell in cells:
            self._measure_cell(planned, loaded, view, camera, resolution, cell)

    def _measure_cell(
        self,
        planned: PlannedScene,
        loaded: LoadedScene,
        view: View,
        camera: str,
        resolution: Resolution,
        cell: PlannedCell,
    ) -> None:
        workload = get_workload(cell.entry.name)
        name = f"{planned.name}, {camera}, {resolution}, {workload.name}"
        self.reporter.doing(name)
        before, whole = self.done, self._cell_work(cell, resolution)
        keys = {"workload": workload.name, "seed": cell.seed}
        try:
            rays = workload.make(planned.spec, view.gbuffer, cell.seed)
            if len(rays) == 0:
                raise CellError(f"{name}: no rays, since the camera sees no surface")
            record = error_cell.measure_cell(
                loaded,
                view,
                error_cell.Cell(
                    query_of(workload),
                    rays,
                    cell.points,
                    self.experiment.rounds if cell.timed else 0,
                    cell.timed
                    and workload.name == PICTURED
                    and resolution == self.experiment.picture,
                    self.experiment.selection_rays,
                    cell.rivals,
                ),
                lambda: self._advance(whole / cell.passes(self.experiment.rounds)),
            )
        except ReportsError:
            raise
        except Exception as error:  # one bad cell must not cost the others
            self._fail(planned.name, camera, resolution, reason_of(error), **keys)
            self._advance(whole - (self.done - before))
            return
        self.writer.add_cell(
            {**cell_keys(planned.name, camera, resolution), **keys, **record.details},
            record.samples,
            record.results,
            record.verdicts,
            record.picture,
        )
        if not self.reporter.console.is_terminal:
            self.reporter.say(f"{name}{_said(record.results, cell)}{self._eta()}")

    def _work(self, planned: PlannedScene) -> float:
        """Return the millions of rays that go through points for a scene."""
        # Which scene it is changes lengths, not how many points there are, so none is loaded here.
        return sum(
            self._cell_work(cell, resolution)
            for number in range(len(planned.cameras))
            for resolution in self.experiment.resolutions
            for cell in plan_cells(self.experiment, self.techniques, self.small, resolution, number)
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
        return f"; {share:.0f} % done, about {left / 60:.0f} min left"

    def _fail(
        self, scene: str, camera: str, resolution: Resolution | None, reason: str, **keys: Any
    ) -> None:
        keys = {"workload": "", "seed": 0} | keys
        fail(self.writer, self.reporter, scene, camera, resolution, reason, **keys)


def _said(results: list[dict[str, Any]], cell: PlannedCell) -> str:
    """Return what is said of a finished cell on a console without a bar."""
    shown = [row for row in results if row["default"] and row["technique"] != error_cell.EMBREE]
    parts = [
        f"{row['technique']} alpha {row['alpha']:.3f} wrong {100 * row['wrong_rate']:.3g} %"
        + (f" speed-up {row['speedup']:.2f}" if cell.timed else "")
        for row in shown
    ]
    return ": " + ", ".join(parts)


def _compile(
    experiment: ErrorExperiment, techniques: dict[str, Technique], threads: int
) -> dict[str, float]:
    """Have everything compiled on a tiny view, and return by how much that took longer.

    Every workload goes through every technique twice; what the first time takes longer is
    compilation, or loading what an earlier process compiled.
    """
    spec = hrs.get_scene("cornell")
    loaded = prepare(spec.load(), threads)
    camera = spec.camera(next(iter(spec.cameras)), 64, 48)
    seconds = {}
    for entry in experiment.workloads:
        workload = get_workload(entry.name)
        took = []
        for _ in range(2):
            start = time.perf_counter()
            view = View(loaded.scene, camera, threads)
            rays = workload.make(spec, view.gbuffer, 0)
            points = [
                point
                for technique in techniques.values()
                for point in points_of(technique, loaded.scene, entry.points)
            ]
            error_cell.measure_cell(
                loaded,
                view,
                error_cell.Cell(
                    query_of(workload), rays, points, 1, workload.name == PICTURED, 1024
                ),
            )
            took.append(time.perf_counter() - start)
        seconds[workload.name] = max(0.0, took[0] - took[1])
    return seconds
