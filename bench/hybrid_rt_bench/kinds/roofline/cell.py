"""Measure one view of kind "roofline": what the certified march does and takes, and its break-even.

Round after round, on one thread and on all of them: the strongest Embree traces all rays, the
hybrid marches them and hands the unresolved ones to the same Embree, the rays are marched without
vectors, and a march of one step is timed, which is the set-up of every ray and the writing of its
row. Beside it the raster draws the view, stage by stage, and the strongest Embree traces its
primary rays. Ratios are taken inside a round.
"""

from __future__ import annotations

import dataclasses
import gc
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt.kernels.techniques.certified import slots
from hybrid_rt_bench.kinds.roofline import reckon as roofline
from hybrid_rt_bench.kinds.roofline.spec import RooflineExperiment
from hybrid_rt_bench.measure import strongest
from hybrid_rt_bench.measure.errors import CellError
from hybrid_rt_bench.measure.loaded import LoadedScene
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.schema import HYBRID_STAGES

Row = dict[str, Any]


RAY_BYTES = 3 * 4 + 3 * 4 + 4 + 4
"""Origin, direction, t_near and t_far, which set-up reads."""


@dataclass(frozen=True, eq=False)
class RooflineRecord:
    """Everything that is kept of a view, as rows for `RunWriter.add_cell`."""

    details: Row
    samples: list[Row]
    results: list[Row]


def measure_cell(
    loaded: LoadedScene,
    camera: hrt.Camera,
    name: str,
    experiment: RooflineExperiment,
    threads: int,
    on_round: Callable[[], None] = lambda: None,
) -> RooflineRecord:
    """Return the times and the work of the march of a view's mirror rays.

    Parameters
    ----------
    loaded : LoadedScene
    camera : Camera
    name : str
        Of the view, in messages.
    experiment : RooflineExperiment
    threads : int
        All times are taken on one thread and on so many.
    on_round : callable
        Called after every round.

    Raises
    ------
    CellError
        The camera sees no surface, or the view is too large for the slots.
    """
    gbuffer = hrt.rasterize(loaded.scene, camera, threads=threads)
    screen = hrt.Certified(lists=experiment.lists).prepare(gbuffer, threads=threads)
    rays = hrt.mirror_rays(gbuffer)
    if len(rays) == 0:
        raise CellError(f"{name}: the camera sees no surface, so there are no mirror rays")
    choice = strongest.choose(loaded.candidates, rays, experiment.selection_rays)
    counts = thread_counts(threads)
    primary = hrt.primary_rays(camera, order="tiles")
    first_hit = strongest.choose(loaded.candidates, primary, experiment.selection_rays).best.tracer
    stages = [
        _Stages(
            rays, screen, choice.best.tracer.with_path(threads=n),
            primary, first_hit.with_path(threads=n), n,
        )
        for n in counts
    ]  # fmt: skip
    marched = stages[-1].hybrid().marched  # these are the first calls, which compile
    for each in stages:
        each.round(0)
    samples = []
    for number in range(experiment.rounds):
        for each in stages:
            samples.append({"threads": each.threads, "round": number, **each.round(number)})
        on_round()
    if marched.work is None:
        raise CellError(f"{name}: more numbers in an array than the march's lanes can index")
    row = {
        "technique": "certified",
        "rays": len(rays),
        "alpha": float(marched.resolved.mean()),
        **work_columns(marched, screen),
    }
    results = [
        {**row, "threads": n, **time_columns([s for s in samples if s["threads"] == n], len(rays))}
        for n in counts
    ]
    return RooflineRecord({"rays": len(rays), "path": choice.best.label}, samples, results)


def thread_counts(threads: int) -> list[int]:
    """Return the numbers of threads that are measured: one, and all."""
    return sorted({1, threads})


@dataclass(frozen=True, eq=False)
class _Stages:
    """What is timed of a view on one number of threads."""

    rays: hrt.Rays
    screen: hrt.Screen
    tracer: hrt.EmbreeTracer
    primary: hrt.Rays
    primary_tracer: hrt.EmbreeTracer
    threads: int

    def hybrid(self) -> hrt.HybridResult:
        """March, and hand over the unresolved rays."""
        return hrt.trace_hybrid(self.rays, self.screen, self.tracer, threads=self.threads)

    def round(self, number: int) -> dict[str, float]:
        """Return the seconds of every stage; every other round goes the other way round."""
        found: dict[str, float] = {}

        def timed(stage: str, call: Callable[[], Any]) -> None:
            start = time.perf_counter()
            call()
            found[stage] = time.perf_counter() - start

        def raster() -> None:
            drawn = hrt.rasterize(self.screen.scene, self.screen.camera, threads=self.threads)
            found.update(drawn.timings)

        def march(**changes: Any) -> hrt.Marched:
            changed = dataclasses.replace(self.screen.technique, **changes)
            return hrt.march(self.rays, self.screen.of(changed), threads=self.threads)

        calls: list[Callable[[], None]] = [
            lambda: timed("embree", lambda: self.tracer.intersect(self.rays)),
            lambda: found.update(self.hybrid().timings),
            lambda: timed("scalar", lambda: march(vectors=False)),
            lambda: timed("start", lambda: march(max_steps=1)),
            lambda: timed("raster", raster),
            lambda: timed("primary", lambda: self.primary_tracer.intersect(self.primary)),
        ]
        gc.collect()
        gc.disable()
        try:
            for call in calls[:: -1 if number % 2 else 1]:
                call()
        finally:
            gc.enable()
        kept = (*roofline.STAGES, *roofline.RASTER, "raster", "primary")
        return {stage: found[stage] for stage in kept}


def work_columns(marched: hrt.Marched, screen: hrt.Screen) -> Row:
    """Return what the lanes counted, and what of which structure they gathered for it."""
    work, lists, pyramid = marched.work, screen.data.lists, screen.data.pyramid
    assert work is not None
    # Of the numbers of a plane or a triangle, which lie side by side, one is to be waited for.
    gathered = {
        "pyramid": (work.steps * slots.CELLS_A_STEP, 1),
        "lists": (work.entries * slots.NUMBERS_AN_ENTRY + work.rests * slots.NUMBERS_A_REST, 1),
        "planes": (work.planes * slots.NUMBERS_A_PLANE, slots.NUMBERS_A_PLANE),
        "corners": (work.tests * slots.NUMBERS_A_TEST, slots.NUMBERS_A_TEST),
        "slots": (
            work.refills * slots.ROWS_A_REFILL
            + work.looks * slots.ROWS_A_LOOK
            + work.tests * slots.ROWS_A_TEST,
            1,
        ),
    }
    row_bytes = 4 * (slots.F32_ROWS + slots.I32_ROWS) + 8 * slots.F64_ROWS
    sizes = {
        "pyramid": sum(pyramid.level(k).nbytes for k in range(len(pyramid))),
        "lists": lists.prim_id.nbytes + lists.nearest.nbytes + lists.rest.nbytes,
        "planes": lists.planes.nbytes,
        "corners": screen.scene.corners.nbytes,
        "slots": slots.STRIDE * row_bytes,
    }
    columns: Row = dataclasses.asdict(work)
    columns |= {f"busy_{stage}": share for stage, share in work.busy.items()}
    for name in roofline.STRUCTURES:
        numbers, together = gathered[name]
        columns |= {
            f"{name}_bytes": sizes[name],
            f"{name}_gathered": numbers,
            f"{name}_places": numbers // together,
        }
    gathered_bytes = 4 * sum(numbers for numbers, _ in gathered.values())
    written = sum(array.nbytes for array in marched.arrays)
    columns["touched_bytes"] = gathered_bytes + RAY_BYTES * len(marched) + written
    return columns


def time_columns(samples: list[Row], rays: int) -> Row:
    """Return medians in nanoseconds per ray, of the raster in ms, and of the paired ratios."""
    seconds = {stage: np.array([s[stage] for s in samples]) for stage in roofline.STAGES}
    seconds["budget"] = roofline.budget(seconds)
    row: Row = {}
    for stage, values in seconds.items():
        _put(row, f"{stage}_ns", stats.median(1e9 * values / rays))
    for stage in (*roofline.RASTER, "raster", "primary"):
        seconds[stage] = np.array([s[stage] for s in samples])
        _put(row, f"{stage}_ms", stats.median(1e3 * seconds[stage]))
    _put(row, "raster_speedup", stats.paired_ratio(seconds["primary"], seconds["raster"]))
    _put(row, "vectors_speedup", stats.paired_ratio(seconds["scalar"], seconds["march"]))
    hybrid = sum(seconds[stage] for stage in HYBRID_STAGES)
    _put(row, "speedup", stats.paired_ratio(seconds["embree"], hybrid))
    return row


def _put(row: Row, name: str, estimate: stats.Estimate) -> None:
    row |= {name: estimate.value, f"{name}_low": estimate.low, f"{name}_high": estimate.high}
