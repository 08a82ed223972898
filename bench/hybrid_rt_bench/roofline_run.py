"""Run an experiment of kind "roofline": the rates of the machine, then view after view."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench import env, rates, roofline_cell
from hybrid_rt_bench.measure import LoadedScene, prepare
from hybrid_rt_bench.plan import Plan, PlannedScene, make_plan
from hybrid_rt_bench.progress import Reporter
from hybrid_rt_bench.results import RunWriter
from hybrid_rt_bench.run import (
    Outcome,
    carry_out,
    cell_keys,
    fail,
    load_planned,
    measured,
    reason_of,
)
from hybrid_rt_bench.spec_base import Resolution
from hybrid_rt_bench.spec_roofline import RooflineExperiment


def run_roofline(
    experiment: RooflineExperiment,
    *,
    reporter: Reporter,
    scenes: Sequence[str] | None = None,
    cameras: Sequence[str] | None = None,
    threads: int | None = None,
    out: Path = Path("reports"),
    command: Sequence[str] = (),
) -> Outcome:
    """Measure an experiment of kind "roofline" and write its folder.

    Parameters, returns and raises: see `hybrid_rt_bench.run.run_experiment`.
    """
    workers = env.checked_threads(threads)
    reporter.doing("reading scenes")
    plan = make_plan(experiment, scenes, cameras)
    return carry_out(
        experiment,
        plan,
        reporter=reporter,
        threads=workers,
        out=out,
        command=command,
        compile_all=lambda: _compile(experiment, workers),
        measure_all=lambda writer: _measure_all(experiment, plan, workers, writer, reporter),
    )


def _measure_all(
    experiment: RooflineExperiment,
    plan: Plan,
    threads: int,
    writer: RunWriter,
    reporter: Reporter,
) -> None:
    views = sum(len(planned.cameras) for planned in plan.scenes) * len(experiment.resolutions)
    reporter.total(len(experiment.table_kib) + views * experiment.rounds)
    reporter.doing("rates of the machine")
    writer.meta["caches"] = rates.caches()
    writer.meta["rates"] = rates.measure(
        [1024 * kib for kib in experiment.table_kib],
        roofline_cell.thread_counts(threads),
        experiment.repeats,
        experiment.repeat_seconds,
        on_size=reporter.advance,
    )
    for path, reason in plan.unreadable:
        fail(writer, reporter, Path(path).stem, "", None, reason)
    for planned in plan.scenes:
        _measure_scene(experiment, planned, threads, writer, reporter)


def _measure_scene(
    experiment: RooflineExperiment,
    planned: PlannedScene,
    threads: int,
    writer: RunWriter,
    reporter: Reporter,
) -> None:
    name, views = planned.name, len(planned.cameras) * len(experiment.resolutions)
    reporter.doing(f"loading {name}")
    try:
        loaded = load_planned(planned, threads, writer)
    except (hrt.HybridRTError, MemoryError) as error:
        fail(writer, reporter, name, "", None, reason_of(error))
        reporter.advance(views * experiment.rounds)
        return
    for camera in planned.cameras:
        for resolution in experiment.resolutions:
            _measure_view(
                experiment, planned, loaded, camera, resolution, threads, writer, reporter
            )


def _measure_view(
    experiment: RooflineExperiment,
    planned: PlannedScene,
    loaded: LoadedScene,
    camera: str,
    resolution: Resolution,
    threads: int,
    writer: RunWriter,
    reporter: Reporter,
) -> None:
    name = f"{planned.name}, {camera}, {resolution}"
    reporter.doing(name)
    record = measured(
        lambda on_round: roofline_cell.measure_cell(
            loaded,
            planned.spec.camera(camera, resolution.width, resolution.height),
            name,
            experiment,
            threads,
            on_round,
        ),
        experiment.rounds,
        (planned.name, camera, resolution),
        writer,
        reporter,
    )
    if record is None:
        return
    writer.add_cell(
        {**cell_keys(planned.name, camera, resolution), **record.details},
        record.samples,
        record.results,
        [],
    )
    if not reporter.console.is_terminal:
        row = record.results[-1]
        reporter.say(
            f"{name}: march {row['march_ns']:.0f} ns a ray, may take {row['budget_ns']:.0f} ns, "
            f"Embree {row['embree_ns']:.0f} ns; measured speed-up {row['speedup']:.3f}"
        )


def _compile(experiment: RooflineExperiment, threads: int) -> dict[str, float]:
    """Have everything compiled that is timed, on a tiny view, and return the seconds of it."""
    start = time.perf_counter()
    spec = hrs.get_scene("cornell")
    loaded = prepare(spec.load(), threads)
    once = experiment.model_copy(update={"rounds": 1, "selection_rays": 1024})
    camera = spec.camera(next(iter(spec.cameras)), 64, 48)
    roofline_cell.measure_cell(loaded, camera, "compiling", once, threads)
    marched = time.perf_counter()
    rates.measure([16384], roofline_cell.thread_counts(threads), 1, 1e-6)
    return {"march": marched - start, "rates": time.perf_counter() - marched}
