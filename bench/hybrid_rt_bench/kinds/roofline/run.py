"""Run an experiment of kind "roofline": the rates of the machine, then view after view."""

from __future__ import annotations

import hybrid_rt_scenes as hrs
from hybrid_rt_bench.kinds.roofline import cell, rates
from hybrid_rt_bench.kinds.roofline.columns import SCHEMA
from hybrid_rt_bench.kinds.roofline.spec import RooflineExperiment
from hybrid_rt_bench.measure import compiling
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.measure.lifecycle import Outcome, Request, Session, carry_out, cell_keys
from hybrid_rt_bench.measure.loaded import LoadedScene, prepare
from hybrid_rt_bench.measure.plan import PlannedScene


def run_roofline(experiment: RooflineExperiment, request: Request) -> Outcome:
    """Measure an experiment of kind "roofline" and write its folder."""
    return carry_out(
        experiment,
        request,
        request.plan(experiment),
        SCHEMA,
        stages=lambda: stages_to_compile(experiment, request.workers),
        measure_all=lambda session: _Run(experiment, session).measure(),
    )


class _Run:
    """All views of a run, one after the other."""

    def __init__(self, experiment: RooflineExperiment, session: Session) -> None:
        self.experiment, self.session, self.reporter = experiment, session, session.reporter

    def measure(self) -> None:
        """Measure the machine, then every scene."""
        experiment, meta = self.experiment, self.session.writer.meta
        views = sum(self._rounds(planned) for planned in self.session.plan.scenes)
        self.reporter.total(len(experiment.table_kib) + views)
        self.reporter.doing("rates of the machine")
        meta["caches"] = rates.caches()
        meta["rates"] = rates.measure(
            [1024 * kib for kib in experiment.table_kib],
            cell.thread_counts(self.session.threads),
            experiment.repeats,
            experiment.repeat_seconds,
            on_size=self.reporter.advance,
        )
        self.session.each_scene(
            self.session.load,
            self._measure_scene,
            lambda planned: self.reporter.advance(self._rounds(planned)),
        )

    def _rounds(self, planned: PlannedScene) -> int:
        experiment = self.experiment
        return len(planned.cameras) * len(experiment.resolutions) * experiment.rounds

    def _measure_scene(self, planned: PlannedScene, loaded: LoadedScene) -> None:
        for camera in planned.cameras:
            for resolution in self.experiment.resolutions:
                self._measure_view(planned, loaded, camera, resolution)

    def _measure_view(
        self, planned: PlannedScene, loaded: LoadedScene, camera: str, resolution: Resolution
    ) -> None:
        session, name = self.session, f"{planned.name}, {camera}, {resolution}"
        self.reporter.doing(name)
        keys, share = cell_keys(planned.name, camera, resolution), self.experiment.rounds
        rounds = self.reporter.counted(share)
        record = session.measured(
            keys,
            lambda: cell.measure_cell(
                loaded,
                planned.spec.camera(camera, resolution.width, resolution.height),
                name,
                self.experiment,
                session.threads,
                rounds.one,
            ),
            rounds.rest,
        )
        if record is None:
            return
        session.writer.add_cell({**keys, **record.details}, record.samples, record.results, [])
        row = record.results[-1]
        session.say_off_terminal(
            f"{name}: march {row['march_ns']:.0f} ns per ray, "
            f"break-even {row['budget_ns']:.0f} ns, "
            f"Embree {row['embree_ns']:.0f} ns; measured speed-up {row['speedup']:.3f}"
        )


def stages_to_compile(experiment: RooflineExperiment, threads: int) -> compiling.Stages:
    """Return what is to be compiled: all that is timed, on a tiny view."""
    spec = hrs.get_scene("cornell")
    loaded = prepare(spec.load(), threads)
    once = experiment.model_copy(update={"rounds": 1, "selection_rays": 1024})
    camera = spec.camera(next(iter(spec.cameras)), 64, 48)
    return {
        "raster, march and Embree": lambda: cell.measure_cell(
            loaded, camera, "compiling", once, threads
        ),
        "rates of the machine": lambda: rates.measure(
            [16384], cell.thread_counts(threads), 1, 1e-6
        ),
    }
