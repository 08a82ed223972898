"""Run an experiment of kind "peers": every view through every peer that there is."""

from __future__ import annotations

from typing import Any

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench.kinds.peers import cell as peers_cell
from hybrid_rt_bench.kinds.peers.cell import Contender
from hybrid_rt_bench.kinds.peers.columns import SCHEMA
from hybrid_rt_bench.kinds.peers.programs import EMBREE, get_peer
from hybrid_rt_bench.kinds.peers.programs.base import Peer
from hybrid_rt_bench.kinds.peers.programs.ours import Embree
from hybrid_rt_bench.kinds.peers.spec import PeersExperiment
from hybrid_rt_bench.kinds.peers.trial import Trial, attempt
from hybrid_rt_bench.measure import compiling
from hybrid_rt_bench.measure.errors import CellError, reason_of
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.measure.lifecycle import Outcome, Request, Session, carry_out, cell_keys
from hybrid_rt_bench.measure.plan import PlannedScene


def run_peers(experiment: PeersExperiment, request: Request) -> Outcome:
    """Measure an experiment of kind "peers" and write its folder.

    A peer that cannot be imported, crashes, takes too long or raises has a row with the reason,
    which is no failure of the run.
    """
    chosen = [get_peer(name) for name in dict.fromkeys(experiment.peers)]
    return carry_out(
        experiment,
        request,
        request.plan(experiment),
        SCHEMA,
        stages=lambda: stages_to_compile(chosen, request.workers),
        measure_all=lambda session: _Run(experiment, chosen, session).measure(),
    )


class _Run:
    """All cells of a run, one after the other."""

    def __init__(self, experiment: PeersExperiment, chosen: list[Peer], session: Session) -> None:
        self.experiment, self.chosen, self.session = experiment, chosen, session
        self.threads, self.writer, self.reporter = (
            session.threads, session.writer, session.reporter,
        )  # fmt: skip
        self.refused: dict[str, str] = {}

    def measure(self) -> None:
        """Measure every scene."""
        self.writer.meta["peers"] = [
            {"name": p.name, "description": p.description, "version": p.version, "detail": ""}
            for p in self.chosen
        ]
        views = sum(self._views(planned) for planned in self.session.plan.scenes)
        self.reporter.total(views, "views")
        self.session.each_scene(
            self._load,
            self._measure_scene,
            lambda planned: self.reporter.advance(self._views(planned)),
        )

    def _views(self, planned: PlannedScene) -> int:
        return len(planned.cameras) * len(self.experiment.resolutions)

    def _load(self, planned: PlannedScene) -> Embree:
        scene = planned.spec.load(size=planned.size)
        base = Embree(scene, self.threads)
        self.session.note_scene(planned, scene, {"robust": base.build_seconds})
        return base

    def _measure_scene(self, planned: PlannedScene, base: Embree) -> None:
        contenders = [self._contender(peer, base.scene, base) for peer in self.chosen]
        try:
            for camera in planned.cameras:
                for resolution in self.experiment.resolutions:
                    self._measure_view(planned, contenders, base, camera, resolution)
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
        planned: PlannedScene,
        contenders: list[Contender],
        base: Embree,
        camera: str,
        resolution: Resolution,
    ) -> None:
        name = f"{planned.name}, {camera}, {resolution}"
        self.reporter.doing(name)
        keys = cell_keys(planned.name, camera, resolution)

        def measure() -> peers_cell.PeersRecord:
            seen = planned.spec.camera(camera, resolution.width, resolution.height)
            gbuffer = hrt.rasterize(base.scene, seen, threads=self.threads)
            if not (gbuffer.prim_id >= 0).any():
                raise CellError(f"{name}: the camera sees no surface, so there are no mirror rays")
            return peers_cell.measure_cell(
                contenders,
                base,
                seen,
                gbuffer,
                self.experiment.rounds,
                self.experiment.selection_rays,
                self.experiment.sample_seconds,
            )

        record = self.session.measured(keys, measure, lambda: None)
        if record is None:
            return
        for known, contender in zip(self.writer.meta["peers"], contenders, strict=True):
            if contender.opened is not None:
                known["detail"] = contender.opened.detail
        self.writer.add_cell({**keys, **record.details}, record.samples, record.results, [])
        self.session.say_off_terminal(f"{name}: {_said(record.results)}")


def _said(results: list[dict[str, Any]]) -> str:
    """Return what is said of a finished view on a console without a bar."""
    rates = [
        f"{row['technique']} {row['rays'] / row['ms'] / 1e3:.2f}"
        for row in results
        if row["workload"] == "mirror" and row["state"] == "ok"
    ]
    return "Mrays/s of mirror rays: " + ", ".join(rates) if rates else "done"


def stages_to_compile(chosen: list[Peer], threads: int) -> compiling.Stages:
    """Return what is to be compiled: our own kernels, on a tiny view.

    Peers compile at their first call, which is told apart in every view. None of them is imported
    before Numba has started its threads, since some bring a TBB of their own.
    """
    spec = hrs.get_scene("cornell")
    scene = spec.load()
    camera = spec.camera(next(iter(spec.cameras)), 64, 48)
    base = Embree(scene, threads)
    ours = [peer for peer in chosen if peer.open.__module__ == Embree.__module__]
    opened = [Contender(peer, peer.open(scene, threads)) for peer in ours]

    def raster() -> hrt.GBuffer:
        return hrt.rasterize(scene, camera, threads=threads)

    return {
        "raster": raster,
        "ours": lambda: peers_cell.measure_cell(opened, base, camera, raster(), 1, 1024, 0.1),
    }
