"""The life of a run: its folder, the machine, compilation, cell after cell, its end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numba

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench.measure import compiling, memory
from hybrid_rt_bench.measure import environment as env
from hybrid_rt_bench.measure.errors import reason_of
from hybrid_rt_bench.measure.experiment import AnyExperiment, Resolution, SceneExperiment
from hybrid_rt_bench.measure.loaded import LoadedScene, prepare
from hybrid_rt_bench.measure.plan import Plan, PlannedScene, make_plan
from hybrid_rt_bench.measure.progress import Reporter
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.files import ReportsError
from hybrid_rt_bench.results.folder import RunWriter, create_run
from hybrid_rt_bench.results.schema import Schema

Record = TypeVar("Record")
Loaded = TypeVar("Loaded")


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


@dataclass(frozen=True, eq=False)
class Session:
    """A run that is going on.

    Attributes
    ----------
    plan : Plan
    threads : int
        For every stage alike.
    writer : RunWriter
    reporter : Reporter
    """

    plan: Plan
    threads: int
    writer: RunWriter
    reporter: Reporter

    def each_scene(
        self,
        load: Callable[[PlannedScene], Loaded],
        measure: Callable[[PlannedScene, Loaded], None],
        advance: Callable[[PlannedScene], None],
    ) -> None:
        """Load and measure scene after scene; one that cannot be loaded costs only itself.

        Parameters
        ----------
        load : callable
            Returns the scene made ready. It ends with the call of `measure`: two together may be
            more than there is memory for.
        measure : callable
            Measures its cells.
        advance : callable
            Counts the work of a scene that could not be loaded as done.
        """
        for path, reason in self.plan.unreadable:
            self.fail(Path(path).stem, "", None, reason)
        for planned in self.plan.scenes:
            self.reporter.doing(f"loading {planned.name}")
            try:
                loaded = load(planned)
            except (hrt.HybridRTError, MemoryError) as error:
                self.fail(planned.name, "", None, reason_of(error))
                advance(planned)
                continue
            measure(planned, loaded)
            del loaded

    def load(self, planned: PlannedScene) -> LoadedScene:
        """Load a scene, build its tracers and note it in the run."""
        scene = planned.spec.load(size=planned.size)
        loaded = prepare(scene, self.threads)
        self.note_scene(planned, scene, loaded.build_seconds)
        return loaded

    def note_scene(
        self, planned: PlannedScene, scene: hrt.Scene, build_seconds: dict[str, float]
    ) -> None:
        """Note in the run a scene that was loaded, and what its structures took to build."""
        self.writer.meta["scenes"].append(
            {
                **described(planned.spec, planned.name),
                "row": planned.row,
                "triangles": len(scene),
                "zero_area": scene.zero_area,
                "build_seconds": build_seconds,
            }
        )

    def measured(
        self, keys: dict[str, Any], measure: Callable[[], Record], undone: Callable[[], None]
    ) -> Record | None:
        """Return what `measure` returns.

        A cell that raises must not cost the others: it is kept as failed under its `keys`, what is
        `undone` of it counts as done, and None is returned.
        """
        try:
            return measure()
        except ReportsError:
            raise
        except Exception as error:
            undone()
            self.failed(keys, reason_of(error))
            return None

    def fail(
        self, scene: str, camera: str, resolution: Resolution | None, reason: str, **more: Any
    ) -> None:
        """Say and keep that a cell failed; `more` are its further keys."""
        self.failed({**cell_keys(scene, camera, resolution), **more}, reason)

    def failed(self, keys: dict[str, Any], reason: str) -> None:
        """Say and keep that the cell of these keys failed."""
        parts = {k: v for k, v in keys.items() if isinstance(v, str) and v}
        if keys.get("width"):
            parts["camera"] = f"{keys['camera']}, {keys['width']}x{keys['height']}"
        self.reporter.say(f"failed: {', '.join(parts.values())}: {reason}", "bold red")
        self.writer.fail_cell(keys, reason)

    def warn(self, text: str) -> None:
        """Say and keep a warning."""
        self.writer.meta["warnings"].append(text)
        self.reporter.say(f"warning: {text}", "yellow")

    def say_off_terminal(self, text: str) -> None:
        """Say what a bar would show, where there is none."""
        if not self.reporter.console.is_terminal:
            self.reporter.say(text)

    def warn_of_scatter(self, name: Callable[[dict[str, Any]], str]) -> None:
        """Say once, with advice, how many cells scattered and which one, by its name, the most."""
        cells = [cell for cell in self.writer.meta["cells"] if cell.get("unstable")]
        if not cells:
            return
        worst = max(cells, key=lambda cell: max(cell["unstable"].values()))
        stage = max(worst["unstable"], key=worst["unstable"].__getitem__)
        self.warn(
            f"in {len(cells)} of {self.writer.measured} cells a stage's rounds scatter by more "
            f"than {100 * stats.UNSTABLE:.0f} % (most: {name(worst)}, {stage}: the middle half "
            f"spans {100 * worst['unstable'][stage]:.0f} % of the median); close other programs, "
            "or take more --rounds"
        )


@dataclass(frozen=True)
class Request:
    """What is asked of a run besides its experiment.

    Attributes
    ----------
    reporter : Reporter
    threads : int, optional
        For every stage alike. Default: all that Numba has.
    out : Path
        Directory of the run's folder.
    command : sequence of str
        The command line, to be kept.
    picks : mapping of str to value
        What stands in place of the experiment's, by option: names for "scenes", "cameras", "cases",
        the path of "depth".
    """

    reporter: Reporter
    threads: int | None = None
    out: Path = Path("reports")
    command: Sequence[str] = ()
    picks: Mapping[str, Any] = field(default_factory=dict)

    @property
    def workers(self) -> int:
        """The number of threads, found to be possible."""
        return env.checked_threads(self.threads)

    def plan(self, experiment: SceneExperiment) -> Plan:
        """Return which scenes and cameras to measure; see `hybrid_rt_bench.measure.plan`."""
        self.reporter.doing("reading scenes")
        return make_plan(experiment, self.picks.get("scenes"), self.picks.get("cameras"))


def carry_out(
    experiment: AnyExperiment,
    request: Request,
    plan: Plan,
    schema: Schema,
    *,
    stages: Callable[[], compiling.Stages],
    measure_all: Callable[[Session], None],
) -> Outcome:
    """Make the folder of a run, describe the machine in it, compile, measure, finish.

    Parameters
    ----------
    experiment : AnyExperiment
    request : Request
    plan : Plan
    schema : Schema
        The columns of the run's results.
    stages : callable
        Returns what is to be compiled before anything is timed.
    measure_all : callable
        Measures all cells and gives them to the writer.

    Returns
    -------
    Outcome
        Ctrl-C is no exception: finished cells are kept, and the outcome says `interrupted`.

    Raises
    ------
    ArgumentError
        The directory of runs cannot be written to.
    ReportsError
        The folder can no longer be written to.
    """
    reporter, threads = request.reporter, request.workers
    for note in plan.notes:
        reporter.say(note, "yellow")
    writer = create_run(
        request.out,
        experiment.name,
        schema,
        {
            "kind": experiment.kind,
            "command": list(request.command),
            "spec": experiment.model_dump(mode="json", by_alias=True),
            "notes": plan.notes,
            "warnings": [],
            "scenes": [],
        },
    )
    session = Session(plan, threads, writer, reporter)
    with writer:
        numba.set_num_threads(threads)
        kept = memory.keep_freed()
        try:
            load = env.load_average()  # before this program adds to it
            with compiling.told(reporter.kernel):
                writer.meta["compile_seconds"] = compiling.first_calls(stages(), reporter.stage)
            writer.meta["environment"] = environment = {
                **env.describe(threads),
                "load_average": load,
                "keeps_freed_memory": kept,
            }
            for problem in env.problems(environment):
                session.warn(problem)
            measure_all(session)
        except KeyboardInterrupt:
            writer.finish(interrupted=True)
        else:
            writer.finish()
    interrupted = bool(writer.meta["interrupted"])
    return Outcome(writer.folder, writer.measured, len(writer.failed), interrupted)


def described(spec: hrs.SceneSpec, name: str) -> dict[str, Any]:
    """Return what a run says of a scene, called `name` in its results, before it is loaded."""
    return {
        "name": name,
        "title": spec.title,
        "builtin": spec.builtin,
        "mark": spec.mark,
        "note": spec.note,
    }


def cell_keys(scene: str, camera: str, resolution: Resolution | None) -> dict[str, Any]:
    """Return what says which view a cell is of."""
    width, height = (resolution.width, resolution.height) if resolution else (0, 0)
    return {"scene": scene, "camera": camera, "width": width, "height": height}
