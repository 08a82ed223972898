"""Run an experiment of kind "paper": scenes, cameras and resolutions in turn, each kept."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numba

import hybrid_rt as hrt
from hybrid_rt_bench import env, measure, memory, stats
from hybrid_rt_bench.plan import Plan, PlannedScene, make_plan
from hybrid_rt_bench.progress import Reporter
from hybrid_rt_bench.results import CELL_KEYS, ReportsError, RunWriter, create_run
from hybrid_rt_bench.spec import Experiment, Resolution
from hybrid_rt_bench.spec_base import AnyExperiment
from hybrid_rt_bench.techniques import Technique, get_technique


@dataclass(frozen=True)
class Outcome:
    """What became of a run.

    Attributes
    ----------
    folder : Path
    measured, failed : int
        Cells.
    interrupted : bool
    broken : tuple of str
        Sentences: what was promised and does not hold. A run with any is a failure.
    """

    folder: Path
    measured: int
    failed: int
    interrupted: bool
    broken: tuple[str, ...] = ()


def run_experiment(
    experiment: Experiment,
    *,
    reporter: Reporter,
    scenes: Sequence[str] | None = None,
    cameras: Sequence[str] | None = None,
    threads: int | None = None,
    out: Path = Path("reports"),
    command: Sequence[str] = (),
) -> Outcome:
    """Measure an experiment and write its folder.

    Parameters
    ----------
    experiment : Experiment
    reporter : Reporter
    scenes, cameras : sequence of str, optional
        See `hybrid_rt_bench.plan.make_plan`.
    threads : int, optional
        For every stage alike. Default: all that Numba has.
    out : Path
        Directory of the run's folder.
    command : sequence of str
        The command line, to be kept.

    Returns
    -------
    Outcome
        Ctrl-C is no exception: finished cells are kept, and the outcome says `interrupted`.

    Raises
    ------
    UnknownNameError, ArgumentError, MeshFileError, NothingToRunError
        Before anything is measured.
    ReportsError
        The folder can no longer be written to.
    """
    workers = env.checked_threads(threads)
    techniques = [get_technique(name) for name in experiment.techniques]
    reporter.doing("reading scenes")
    plan = make_plan(experiment, scenes, cameras)

    def measure_all(writer: RunWriter) -> None:
        _measure_all(plan, experiment, techniques, workers, writer, reporter)
        _warn_of_scatter(writer, reporter)

    return carry_out(
        experiment,
        plan,
        reporter=reporter,
        threads=workers,
        out=out,
        command=command,
        compile_all=lambda: measure.compile_seconds(experiment, techniques, workers),
        measure_all=measure_all,
    )


def carry_out(
    experiment: AnyExperiment,
    plan: Plan,
    *,
    reporter: Reporter,
    threads: int,
    out: Path,
    command: Sequence[str],
    compile_all: Callable[[], dict[str, float]],
    measure_all: Callable[[RunWriter], None],
    keys: tuple[str, ...] = CELL_KEYS,
) -> Outcome:
    """Make the folder of a run, describe the machine in it, compile, measure, finish.

    Parameters
    ----------
    experiment : AnyExperiment
    plan : Plan
    reporter, threads, out, command
        As in `run_experiment`.
    compile_all : callable
        Has everything compiled that is to be timed, and returns the seconds of it by name.
    measure_all : callable
        Measures all cells and gives them to the writer.
    keys : tuple of str
        What tells the cells apart.
    """
    for note in plan.notes:
        reporter.say(note, "yellow")
    writer = create_run(
        out,
        experiment.name,
        {
            "kind": experiment.kind,
            "command": list(command),
            "spec": experiment.model_dump(mode="json", by_alias=True),
            "notes": plan.notes,
            "warnings": [],
            "scenes": [],
        },
        keys,
    )
    numba.set_num_threads(threads)
    kept = memory.keep_freed()
    try:
        reporter.doing("compiling")
        load = env.load_average()  # before this program adds to it
        writer.meta["compile_seconds"] = compile_all()
        environment = {
            **env.describe(threads),
            "load_average": load,
            "keeps_freed_memory": kept,
        }
        writer.meta["environment"] = environment
        for problem in env.problems(environment):
            warn(writer, reporter, problem)
        measure_all(writer)
    except KeyboardInterrupt:
        writer.finish(interrupted=True)
        return Outcome(writer.folder, writer.measured, len(writer.failed), interrupted=True)
    writer.finish()
    return Outcome(writer.folder, writer.measured, len(writer.failed), interrupted=False)


def _measure_all(
    plan: Plan,
    experiment: Experiment,
    techniques: list[Technique],
    threads: int,
    writer: RunWriter,
    reporter: Reporter,
) -> None:
    a_cell = experiment.warmup + experiment.rounds
    cells = sum(len(scene.cameras) for scene in plan.scenes) * len(experiment.resolutions)
    reporter.total(cells * a_cell)
    for path, reason in plan.unreadable:
        fail(writer, reporter, Path(path).stem, "", None, reason)
    for planned in plan.scenes:
        reporter.doing(f"loading {planned.name}")
        try:
            loaded = load_planned(planned, threads, writer)
        except (hrt.HybridRTError, MemoryError) as error:
            fail(writer, reporter, planned.name, "", None, reason_of(error))
            reporter.advance(len(planned.cameras) * len(experiment.resolutions) * a_cell)
            continue
        for camera in planned.cameras:
            for resolution in experiment.resolutions:
                _measure_one(
                    planned, loaded, camera, resolution, experiment, techniques, threads, writer,
                    reporter,
                )  # fmt: skip


def _measure_one(
    planned: PlannedScene,
    loaded: measure.LoadedScene,
    camera: str,
    resolution: Resolution,
    experiment: Experiment,
    techniques: list[Technique],
    threads: int,
    writer: RunWriter,
    reporter: Reporter,
) -> None:
    name = f"{planned.name}, {camera}, {resolution}"
    reporter.doing(name)
    record = measured(
        lambda on_round: measure.measure_cell(
            loaded,
            planned.spec.camera(camera, resolution.width, resolution.height),
            name,
            experiment,
            techniques,
            threads,
            on_round,
        ),
        experiment.warmup + experiment.rounds,
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
        record.verdicts,
        record.picture,
    )
    if not reporter.console.is_terminal:
        row = record.results[0]
        reporter.say(
            f"{name}: alpha {row['alpha']:.3f}, Embree {row['embree_ms']:.1f} ms, "
            f"hybrid {row['hybrid_ms']:.1f} ms, measured speed-up {row['measured']:.3f}"
        )


Record = TypeVar("Record")


def measured(
    measure: Callable[[Callable[[], None]], Record],
    rounds: int,
    where: tuple[str, str, Resolution],
    writer: RunWriter,
    reporter: Reporter,
) -> Record | None:
    """Return what `measure` returns, which is given what to call after each of its rounds.

    A cell that raises must not cost the others: it is kept as failed, its scene, camera and
    resolution being `where`, its rounds count as done, and None is returned.
    """
    done = 0

    def on_round() -> None:
        nonlocal done
        done += 1
        reporter.advance()

    try:
        return measure(on_round)
    except ReportsError:
        raise
    except Exception as error:
        reporter.advance(rounds - done)
        fail(writer, reporter, *where, reason_of(error))
        return None


def load_planned(planned: PlannedScene, threads: int, writer: RunWriter) -> measure.LoadedScene:
    """Load a scene, build its tracers and note it in the run."""
    scene = planned.spec.load(size=planned.size)
    loaded = measure.prepare(scene, threads)
    note_scene(planned, scene, loaded.build_seconds, writer)
    return loaded


def note_scene(
    planned: PlannedScene, scene: hrt.Scene, build_seconds: dict[str, float], writer: RunWriter
) -> None:
    """Note in the run a scene that was loaded, and what each of its structures took to build."""
    writer.meta["scenes"].append(
        {
            "name": planned.name,
            "title": planned.spec.title,
            "row": planned.row,
            "builtin": planned.spec.builtin,
            "triangles": len(scene),
            "zero_area": scene.zero_area,
            "build_seconds": build_seconds,
        }
    )


def fail(
    writer: RunWriter,
    reporter: Reporter,
    scene: str,
    camera: str,
    resolution: Resolution | None,
    reason: str,
    **more: Any,
) -> None:
    """Say and keep that a cell failed; `more` are its further keys."""
    where = ", ".join(str(part) for part in (scene, camera, resolution, *more.values()) if part)
    reporter.say(f"failed: {where}: {reason}", "bold red")
    writer.fail_cell({**cell_keys(scene, camera, resolution), **more}, reason)


def cell_keys(scene: str, camera: str, resolution: Resolution | None) -> dict[str, Any]:
    """Return what says which view a cell is of."""
    width, height = (resolution.width, resolution.height) if resolution else (0, 0)
    return {"scene": scene, "camera": camera, "width": width, "height": height}


def warn(writer: RunWriter, reporter: Reporter, text: str) -> None:
    """Say and keep a warning."""
    writer.meta["warnings"].append(text)
    reporter.say(f"warning: {text}", "yellow")


def _warn_of_scatter(writer: RunWriter, reporter: Reporter) -> None:
    """Say once, with advice, how many cells scattered and which one the most."""
    cells = [cell for cell in writer.meta["cells"] if cell.get("unstable")]
    if cells:
        worst = max(cells, key=lambda cell: max(cell["unstable"].values()))
        stage = max(worst["unstable"], key=worst["unstable"].__getitem__)
        warn(
            writer,
            reporter,
            f"in {len(cells)} of {writer.measured} cells a stage's rounds scatter by more than "
            f"{100 * stats.UNSTABLE:.0f} % (most: {worst['scene']}, {worst['camera']}, "
            f"{worst['width']}x{worst['height']}, {stage}: the middle half spans "
            f"{100 * worst['unstable'][stage]:.0f} % of the median); close other programs, or take "
            "more --rounds",
        )


def reason_of(error: BaseException) -> str:
    """Return what an exception says, on one line, with its place if it was not made on purpose."""
    if isinstance(error, hrt.HybridRTError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"not enough memory ({error})" if str(error) else "not enough memory"
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} (in {where.name}, {Path(where.filename).name})"
