"""Run an experiment of kind "peers": every view through every peer that there is."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench import env, peers_cell
from hybrid_rt_bench.measure import CellError
from hybrid_rt_bench.peers import EMBREE, get_peer
from hybrid_rt_bench.peers.base import Peer
from hybrid_rt_bench.peers.ours import Embree
from hybrid_rt_bench.peers.trial import Trial, attempt
from hybrid_rt_bench.peers_cell import Contender
from hybrid_rt_bench.plan import Plan, PlannedScene, make_plan
from hybrid_rt_bench.progress import Reporter
from hybrid_rt_bench.results import ReportsError, RunWriter
from hybrid_rt_bench.run import Outcome, carry_out, fail, note_scene, reason_of
from hybrid_rt_bench.spec_base import Resolution
from hybrid_rt_bench.spec_peers import PeersExperiment


def run_peers(
    experiment: PeersExperiment,
    *,
    reporter: Reporter,
    scenes: Sequence[str] | None = None,
    cameras: Sequence[str] | None = None,
    threads: int | None = None,
    out: Path = Path("reports"),
    command: Sequence[str] = (),
) -> Outcome:
    """Measure an experiment of kind "peers" and write its folder.

    A peer that cannot be imported, crashes, takes too long or raises has a row with the reason,
    which is no failure of the run. Parameters, returns and raises: see
    `hybrid_rt_bench.run.run_experiment`.
    """
    workers = env.checked_threads(threads)
    chosen = [get_peer(name) for name in dict.fromkeys(experiment.peers)]
    reporter.doing("reading scenes")
    plan = make_plan(experiment, scenes, cameras)
    return carry_out(
        experiment,
        plan,
        reporter=reporter,
        threads=workers,
        out=out,
        command=command,
        compile_all=lambda: _compile(chosen, workers),
        measure_all=lambda writer: _Run(
            experiment, plan, chosen, workers, writer, reporter
        ).measure(),
    )


class _Run:
    """All cells of a run, one after the other."""

    def __init__(
        self,
        experiment: PeersExperiment,
        plan: Plan,
        chosen: list[Peer],
        threads: int,
        writer: RunWriter,
        reporter: Reporter,
    ) -> None:
        self.experiment, self.plan, self.chosen = experiment, plan, chosen
        self.threads, self.writer, self.reporter = threads, writer, reporter
        self.refused: dict[str, str] = {}

    def measure(self) -> None:
        """Measure every scene."""
        self.writer.meta["peers"] = [
            {"name": p.name, "description": p.description, "version": p.version, "detail": ""}
            for p in self.chosen
        ]
        for path, reason in self.plan.unreadable:
            fail(self.writer, self.reporter, Path(path).stem, "", None, reason)
        cells = sum(len(planned.cameras) for planned in self.plan.scenes)
        self.reporter.total(cells * len(self.experiment.resolutions), "views")
        for planned in self.plan.scenes:
            self._measure_scene(planned)

    def _measure_scene(self, planned: PlannedScene) -> None:
        name, views = planned.name, len(planned.cameras) * len(self.experiment.resolutions)
        self.reporter.doing(f"loading {name}")
        try:
            scene = planned.spec.load(size=planned.size)
            base = Embree(scene, self.threads)
        except (hrt.HybridRTError, MemoryError) as error:
            fail(self.writer, self.reporter, name, "", None, reason_of(error))
            self.reporter.advance(views)
            return
        note_scene(planned, scene, {"robust": base.build_seconds}, self.writer)
        contenders = [self._contender(peer, scene, base) for peer in self.chosen]
        try:
            for camera in planned.cameras:
                for resolution in self.experiment.resolutions:
                    self._measure_view(planned.spec, contenders, base, camera, resolution)
                    self.reporter.advance()
        finally:
            for contender in contenders:
                if contender.opened is not None:
                    contender.opened.close()

    def _contender(self, peer: Peer, scene: hrt.Scene, base: Embree) -> Contender:
        """Return a peer with a scene in it, or the reason why it has none."""
        self.reporter.doing(f"{scene.name}: {peer.name} builds")
        seconds = self.experiment.patience_seconds
        tried = attempt(peer, scene, self.threads, seconds) if peer.alone else Trial()
        reason, opened = tried.reason, None
        if not reason:
            try:
                opened = base if peer.name == EMBREE else peer.open(scene, self.threads)
            except Exception as error:
                reason = reason_of(error)
        if reason and self.refused.get(peer.name) != reason:
            self.refused[peer.name] = reason
            self.reporter.say(f"{scene.name}: {peer.name} does not run: {reason}", "yellow")
        return Contender(peer, opened, reason, tried.peak_mib)

    def _measure_view(
        self,
        spec: hrs.SceneSpec,
        contenders: list[Contender],
        base: Embree,
        camera: str,
        resolution: Resolution,
    ) -> None:
        name = f"{spec.name}, {camera}, {resolution}"
        self.reporter.doing(name)
        try:
            seen = spec.camera(camera, resolution.width, resolution.height)
            gbuffer = hrt.rasterize(base.scene, seen, threads=self.threads)
            if not (gbuffer.prim_id >= 0).any():
                raise CellError(f"{name}: the camera sees no surface, so there are no mirror rays")
            record = peers_cell.measure_cell(
                contenders,
                base,
                seen,
                gbuffer,
                self.experiment.rounds,
                self.experiment.selection_rays,
                self.experiment.sample_seconds,
            )
        except ReportsError:
            raise
        except Exception as error:  # one bad cell must not cost the others
            fail(self.writer, self.reporter, spec.name, camera, resolution, reason_of(error))
            return
        for known, contender in zip(self.writer.meta["peers"], contenders, strict=True):
            if contender.opened is not None:
                known["detail"] = contender.opened.detail
        size = {"width": resolution.width, "height": resolution.height}
        self.writer.add_cell(
            {"scene": spec.name, "camera": camera, **size, **record.details},
            record.samples,
            record.results,
            [],
        )
        if not self.reporter.console.is_terminal:
            self.reporter.say(f"{name}: {_said(record.results)}")


def _said(results: list[dict[str, Any]]) -> str:
    """Return what is said of a finished view on a console without a bar."""
    rates = [
        f"{row['technique']} {row['rays'] / row['ms'] / 1e3:.2f}"
        for row in results
        if row["workload"] == "mirror" and row["state"] == "ok"
    ]
    return "Mrays/s of mirror rays: " + ", ".join(rates) if rates else "done"


def _compile(chosen: list[Peer], threads: int) -> dict[str, float]:
    """Have our own kernels compiled on a tiny view, and return the seconds.

    Peers compile at their first call, which is told apart in every view. None of them is imported
    before Numba has started its threads, since some bring a TBB of their own.
    """
    spec = hrs.get_scene("cornell")
    scene = spec.load()
    camera = spec.camera(next(iter(spec.cameras)), 64, 48)
    start = time.perf_counter()
    base = Embree(scene, threads)
    ours = [peer for peer in chosen if peer.open.__module__ == Embree.__module__]
    opened = [Contender(peer, peer.open(scene, threads)) for peer in ours]
    gbuffer = hrt.rasterize(scene, camera, threads=threads)
    peers_cell.measure_cell(opened, base, camera, gbuffer, 1, 1024, 0.1)
    return {"ours": time.perf_counter() - start}
