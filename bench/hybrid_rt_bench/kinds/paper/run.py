"""Run an experiment of kind "paper": scenes, cameras and resolutions in turn, each kept."""

from __future__ import annotations

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.paper import cell
from hybrid_rt_bench.kinds.paper.columns import SCHEMA
from hybrid_rt_bench.kinds.paper.spec import PaperExperiment
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.measure.lifecycle import Outcome, Request, Session, carry_out, cell_keys
from hybrid_rt_bench.measure.loaded import LoadedScene
from hybrid_rt_bench.measure.plan import PlannedScene


def run_paper(experiment: PaperExperiment, request: Request) -> Outcome:
    """Measure an experiment of kind "paper" and write its folder."""
    techniques = [hrt.TECHNIQUES[name]() for name in experiment.techniques]
    plan = request.plan(experiment)
    return carry_out(
        experiment,
        request,
        plan,
        SCHEMA,
        stages=lambda: cell.stages_to_compile(experiment, techniques, request.workers),
        measure_all=lambda session: _Run(experiment, techniques, session).measure(),
    )


class _Run:
    """All cells of a run, one after the other."""

    def __init__(
        self, experiment: PaperExperiment, techniques: list[hrt.Technique], session: Session
    ) -> None:
        self.experiment, self.techniques, self.session = experiment, techniques, session
        self.rounds = experiment.warmup + experiment.rounds

    def measure(self) -> None:
        """Measure every scene."""
        session = self.session
        session.reporter.total(sum(self._work(planned) for planned in session.plan.scenes))
        session.each_scene(
            session.load,
            self._measure_scene,
            lambda planned: session.reporter.advance(self._work(planned)),
        )
        session.warn_of_scatter(
            lambda cell: f"{cell['scene']}, {cell['camera']}, {cell['width']}x{cell['height']}"
        )

    def _work(self, planned: PlannedScene) -> int:
        return len(planned.cameras) * len(self.experiment.resolutions) * self.rounds

    def _measure_scene(self, planned: PlannedScene, loaded: LoadedScene) -> None:
        for camera in planned.cameras:
            for resolution in self.experiment.resolutions:
                self._measure_one(planned, loaded, camera, resolution)

    def _measure_one(
        self, planned: PlannedScene, loaded: LoadedScene, camera: str, resolution: Resolution
    ) -> None:
        session, name = self.session, f"{planned.name}, {camera}, {resolution}"
        session.reporter.doing(name)
        rounds = session.reporter.counted(self.rounds)
        keys = cell_keys(planned.name, camera, resolution)
        record = session.measured(
            keys,
            lambda: cell.measure_cell(
                loaded,
                planned.spec.camera(camera, resolution.width, resolution.height),
                name,
                self.experiment,
                self.techniques,
                session.threads,
                rounds.one,
            ),
            rounds.rest,
        )
        if record is None:
            return
        session.writer.add_cell(
            {**keys, **record.details},
            record.samples,
            record.results,
            record.verdicts,
            record.picture,
        )
        row = record.results[0]
        session.say_off_terminal(
            f"{name}: alpha {row['alpha']:.3f}, Embree {row['embree_ms']:.1f} ms, "
            f"hybrid {row['hybrid_ms']:.1f} ms, measured speed-up {row['measured']:.3f}"
        )
