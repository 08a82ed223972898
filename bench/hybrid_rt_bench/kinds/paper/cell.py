"""Measure one cell: a scene, a camera, a resolution.

All stages run in one process and in turn, round after round, so that whatever slows the machine
for a while slows all of them; ratios are then taken inside a round. Every other round traces before
it marches, so that neither always finds the caches as the other left them. Whatever Numba compiles
is compiled before, on a tiny picture, and timed apart.
"""

from __future__ import annotations

import functools
import gc
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.paper import quality, summary
from hybrid_rt_bench.kinds.paper.columns import SHARED
from hybrid_rt_bench.kinds.paper.spec import PaperExperiment
from hybrid_rt_bench.measure import compiling, shade, strongest
from hybrid_rt_bench.measure.errors import CellError
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.measure.loaded import LoadedScene, prepare
from hybrid_rt_bench.measure.screens import Screens


@dataclass(frozen=True, eq=False)
class CellRecord:
    """Everything that is kept of a cell, as rows for `RunWriter.add_cell`."""

    details: dict[str, Any]
    samples: list[dict[str, Any]]
    results: list[dict[str, Any]]
    verdicts: list[dict[str, Any]]
    picture: dict[str, Any] | None


def measure_cell(
    loaded: LoadedScene,
    camera: hrt.Camera,
    name: str,
    experiment: PaperExperiment,
    techniques: list[hrt.Technique],
    threads: int,
    on_round: Callable[[], None] = lambda: None,
) -> CellRecord:
    """Return timings, verdicts and, at the experiment's picture size, the picture of one cell.

    Parameters
    ----------
    loaded : LoadedScene
    camera : Camera
    name : str
        For warnings.
    experiment : PaperExperiment
    techniques : list of Technique
    threads : int
        For every stage alike.
    on_round : callable
        Called after every round, warm-up rounds too.

    Raises
    ------
    CellError
        The camera sees no surface.
    """
    gbuffer = hrt.rasterize(
        loaded.scene, camera, derivatives=experiment.derivatives, threads=threads
    )
    rays = hrt.mirror_rays(gbuffer)
    if len(rays) == 0:
        raise CellError(f"{name}: the camera sees no surface, so there are no mirror rays")
    primary = hrt.primary_rays(camera, order="tiles")
    mirror_choice = strongest.choose(loaded.candidates, rays, experiment.selection_rays)
    primary_choice = strongest.choose(loaded.candidates, primary, experiment.selection_rays)
    stages = _Stages(
        loaded.scene, camera, rays, primary, mirror_choice.best.tracer,
        primary_choice.best.tracer, techniques, threads, experiment.derivatives,
    )  # fmt: skip
    rows: list[dict[str, Any]] = []
    for number in range(-experiment.warmup, experiment.rounds):
        phase = "warmup" if number < 0 else "measured"
        for (owner, stage), seconds in stages.run(trace_first=number % 2 == 0).items():
            row = {"technique": owner, "stage": stage, "round": number, "seconds": seconds}
            rows.append({**row, "phase": phase})
        on_round()
    keep_picture = (camera.width, camera.height) == (
        experiment.picture.width,
        experiment.picture.height,
    )
    picture: dict[str, Any] = {}
    if keep_picture:
        picture["shaded"] = shade.shaded(gbuffer, rays, loaded.reference)
    screens = Screens(gbuffer, threads)
    reference = loaded.reference.intersect(rays)
    results, verdicts = [], []
    unstable: dict[str, float] = {}
    steps_by_level: dict[str, NDArray[np.int64] | None] = {}
    for technique in techniques:
        result = hrt.trace_hybrid(rays, screens.of(technique), stages.tracer, threads=threads)
        found = quality.judge(rays, gbuffer, result, reference, loaded.truth)
        steps_by_level[technique.name] = technique.steps_by_level(
            rays, screens.of(technique), threads=threads
        )
        timed = _by_stage(rows, technique.name)
        results.append(
            {
                "technique": technique.name,
                **found.columns,
                "steps_per_ray": float(result.marched.steps.mean()),
                **summary.timing_columns(timed, found.columns["alpha"]),
                "embree_path": mirror_choice.best.label,
                "embree_primary_path": primary_choice.best.label,
            }
        )
        verdicts += [{"technique": technique.name, **row} for row in found.verdicts]
        unstable |= summary.unstable(timed)
        if keep_picture:
            grey, classes = quality.picture(gbuffer, rays, result, found.wrong)
            picture |= {f"grey_{technique.name}": grey, f"classes_{technique.name}": classes}
    details = {
        "unstable": unstable,
        "rays": len(rays),
        "embree_ns_per_ray": mirror_choice.nanoseconds,
        "embree_primary_ns_per_ray": primary_choice.nanoseconds,
        "steps_by_level": {
            technique: None if steps is None else [int(n) for n in steps]
            for technique, steps in steps_by_level.items()
        },
    }
    return CellRecord(details, rows, results, verdicts, picture or None)


def stages_to_compile(
    experiment: PaperExperiment, techniques: list[hrt.Technique], threads: int
) -> compiling.Stages:
    """Return what is to be compiled: every stage, on a tiny view."""
    scene = _tiny_scene()
    camera = hrt.Camera.look_at((0, 1, 3), (0, 0.3, 0), width=64, height=48)
    loaded = prepare(scene, threads)
    best = loaded.candidates[0].tracer
    size = Resolution(width=camera.width, height=camera.height)
    tiny = experiment.model_copy(update={"rounds": 1, "warmup": 0, "picture": size})

    def gbuffer() -> hrt.GBuffer:
        return hrt.rasterize(scene, camera, derivatives=experiment.derivatives, threads=threads)

    def march(technique: hrt.Technique) -> Callable[[], Any]:
        drawn = functools.cache(gbuffer)
        return lambda: hrt.trace_hybrid(
            hrt.mirror_rays(drawn()), technique.prepare(drawn()), best, threads=threads
        )

    return {
        "raster": gbuffer,
        "mirror rays": lambda: hrt.mirror_rays(gbuffer()),
        "Embree": lambda: strongest.choose(
            loaded.candidates, hrt.primary_rays(camera, order="tiles"), 1024
        ),
        **{technique.name: march(technique) for technique in techniques},
        "judge and picture": lambda: measure_cell(
            loaded, camera, "compilation", tiny, techniques, threads
        ),
    }


class _Stages:
    """The stages of a cell, each run once by `run`."""

    def __init__(
        self,
        scene: hrt.Scene,
        camera: hrt.Camera,
        rays: hrt.Rays,
        primary: hrt.Rays,
        tracer: hrt.EmbreeTracer,
        primary_tracer: hrt.EmbreeTracer,
        techniques: list[hrt.Technique],
        threads: int,
        derivatives: Literal["plane", "quad"],
    ) -> None:
        self.scene, self.camera, self.rays, self.primary = scene, camera, rays, primary
        self.tracer, self.primary_tracer = tracer, primary_tracer
        self.techniques, self.threads, self.derivatives = techniques, threads, derivatives

    def run(self, *, trace_first: bool) -> dict[tuple[str, str], float]:
        """Return the seconds of every stage by (technique, stage), garbage collection apart."""
        seconds: dict[tuple[str, str], float] = {}

        def timed(stage: str, call: Callable[[], Any]) -> Any:
            start = time.perf_counter()
            result = call()
            seconds[SHARED, stage] = time.perf_counter() - start
            return result

        gc.collect()
        gc.disable()
        try:
            gbuffer = timed(
                "raster",
                lambda: hrt.rasterize(
                    self.scene, self.camera, derivatives=self.derivatives, threads=self.threads
                ),
            )
            timed("embree_primary", lambda: self.primary_tracer.intersect(self.primary))
            timed("rays", lambda: hrt.mirror_rays(gbuffer))
            if trace_first:
                timed("embree", lambda: self.tracer.intersect(self.rays))
            for technique in self.techniques:
                screen = technique.prepare(gbuffer, threads=self.threads)
                seconds[technique.name, "pyramid"] = screen.seconds
                result = hrt.trace_hybrid(self.rays, screen, self.tracer, threads=self.threads)
                for stage, value in result.timings.items():
                    seconds[technique.name, stage] = value
            if not trace_first:
                timed("embree", lambda: self.tracer.intersect(self.rays))
        finally:
            gc.enable()
        return seconds


def _by_stage(rows: list[dict[str, Any]], technique: str) -> summary.Samples:
    mine = [
        row
        for row in rows
        if row["phase"] == "measured" and row["technique"] in (SHARED, technique)
    ]
    stages = dict.fromkeys(row["stage"] for row in mine)
    return {s: np.array([row["seconds"] for row in mine if row["stage"] == s]) for s in stages}


def _tiny_scene() -> hrt.Scene:
    """Return a floor with a ridge on it: enough for a ray of every kind."""
    vertices = [
        (-2, 0, -2), (2, 0, -2), (2, 0, 2), (-2, 0, 2),
        (-1, 0, 0), (1, 0, 0), (0, 1, 0.2), (0, 0, 1),
    ]  # fmt: skip
    faces = [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7), (5, 6, 7)]
    return hrt.Scene.from_arrays(np.array(vertices, np.float32), np.array(faces, np.int32))
