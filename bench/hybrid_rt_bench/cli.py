"""The command line ``hybrid-rt``."""

from __future__ import annotations

import json
import math
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table as RichTable

import hybrid_rt as hrt
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.results import ReportsError, RunData, load_run
from hybrid_rt_bench.spec import AnyExperiment, Resolution, experiment_names, load_experiment

USAGE, FAILED, INTERRUPTED = 2, 3, 130

app = typer.Typer(
    name="hybrid-rt",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    help="""Measure screen-space ray marching in front of an exact tracer.

Every mirror ray of a view is marched through the depth buffer first; what the screen cannot answer
is traced with Embree. This program measures what that saves against tracing every ray with the
strongest Embree, and what it gets wrong.

Begin with `hybrid-rt run paper --quick`, then `hybrid-rt list`.""",
    epilog="""Exit codes: 0 all well, 2 wrong usage, 3 some cells failed, nothing could be run or
a promise is broken, 130 stopped by Ctrl-C. What was finished is always kept.""",
)
out = Console(width=None if sys.stdout.isatty() else 160)
err = Console(stderr=True)

OutDir = Annotated[Path, typer.Option("--out", help="Directory that holds the runs.")]
Threads = Annotated[
    int | None,
    typer.Option("--threads", help="Threads for every stage alike; default: all cores."),
]


class What(StrEnum):
    """What `render` can show."""

    shaded = "shaded"
    depth = "depth"
    normals = "normals"
    status = "status"
    all = "all"


@app.command()
def run(
    experiment: Annotated[
        str, typer.Argument(help="Name of an experiment (see `list`), or path of a TOML file.")
    ],
    quick: Annotated[
        bool, typer.Option("--quick", help="Minutes: built-in scenes, small pictures, few rounds.")
    ] = False,
    scenes: Annotated[
        str | None,
        typer.Option("--scenes", help="Scenes by name, or paths of mesh files: sponza,my/hall.glb"),
    ] = None,
    cameras: Annotated[
        str | None,
        typer.Option("--cameras", help="Cameras by name; every scene takes those that it has."),
    ] = None,
    resolutions: Annotated[
        str | None, typer.Option("--resolutions", help="Picture sizes: 1280x720,1920x1080")
    ] = None,
    rounds: Annotated[
        int | None, typer.Option("--rounds", help="Measured rounds of each cell.")
    ] = None,
    cases: Annotated[
        str | None, typer.Option("--cases", help="Hard cases by name, for `run stability`.")
    ] = None,
    series: Annotated[
        str | None,
        typer.Option("--series", help="Series by name or axis, for `run scaling`: triangles"),
    ] = None,
    triangles: Annotated[
        str | None,
        typer.Option("--triangles", help="Sizes, for `run scaling`: 4096,2^14 or 2^10..2^18"),
    ] = None,
    threads: Threads = None,
    out_dir: OutDir = Path("reports"),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a summary as JSON, and nothing else, on stdout.")
    ] = False,
) -> None:
    """Measure an experiment and write its tables and figures.

    Every cell (scene x camera x resolution, and what else the experiment says) is measured in
    interleaved rounds and kept as soon as it is finished: Ctrl-C, or a cell that fails, costs only
    itself. The run's folder is `reports/<date>-<time>-<experiment>`; `hybrid-rt report` renders it
    again at any time.

    Examples
    --------
    * `hybrid-rt run paper --quick` - a few minutes, nothing to download

    * `hybrid-rt run paper` - the whole experiment, on real scenes where they are found

    * `hybrid-rt run error --quick` - speed against error of every technique

    * `hybrid-rt run ablation --quick` - each switch of the certified march by itself

    * `hybrid-rt run hybrid --quick` - the hybrid's speed-up over Embree, by scene and size

    * `hybrid-rt run paper --scenes sponza --cameras nave --resolutions 1920x1080 --rounds 15`

    * `hybrid-rt run paper --scenes hall.glb --json > hall.json` - a mesh file of your own

    * `hybrid-rt run stability` - the hard set: which technique answers wrongly on which case

    * `hybrid-rt run scaling --series triangles --triangles 2^10..2^20` - growth over one axis

    * `hybrid-rt run peers --quick` - the same rays and pictures through other programs

    * `hybrid-rt run roofline --quick` - what the certified march reads, takes and may take
    """
    from hybrid_rt_bench.kinds import RUNNERS
    from hybrid_rt_bench.progress import Reporter

    spec = load_experiment(experiment, quick=quick)
    picks = {
        "scenes": scenes, "cameras": cameras, "cases": cases, "series": series,
        "triangles": triangles,
    }  # fmt: skip
    given = {**picks, "resolutions": resolutions, "rounds": rounds}
    _check_options(spec, [name for name, value in given.items() if value is not None])
    spec = _overridden(spec, resolutions, rounds)
    picked = {
        name: _names(f"--{name}", value) for name, value in picks.items() if value is not None
    }
    reporter = Reporter(err)
    with reporter:
        outcome = RUNNERS[spec.kind](
            spec, reporter=reporter, threads=threads, out=out_dir, command=sys.argv[1:], **picked
        )
    summary: dict[str, Any] = {
        "run": outcome.folder.name,
        "folder": str(outcome.folder),
        "measured": outcome.measured,
        "failed": outcome.failed,
        "interrupted": outcome.interrupted,
        "broken": list(outcome.broken),
    }
    if outcome.measured:
        data = load_run(outcome.folder)
        written = _render(data, show=not as_json)
        summary |= {
            "notes": data.meta["notes"],
            "warnings": data.meta["warnings"],
            "results": _records(data),
            "files": [str(path) for path in written],
        }
    if as_json:
        print(json.dumps(summary, indent=1, allow_nan=False))
    if outcome.interrupted:
        err.print(
            f"stopped: {_cells(outcome.measured)} kept in {outcome.folder}",
            style="yellow", soft_wrap=True,
        )  # fmt: skip
        raise typer.Exit(INTERRUPTED)
    if outcome.failed:
        err.print(
            f"{outcome.failed} failed, {_cells(outcome.measured)} kept in {outcome.folder}",
            style="bold red", soft_wrap=True,
        )  # fmt: skip
    for promise in outcome.broken:
        err.print(promise, style="bold red", soft_wrap=True, markup=False, highlight=False)
    if outcome.failed or outcome.broken:
        raise typer.Exit(FAILED)


@app.command()
def report(
    run_id: Annotated[str, typer.Argument(metavar="RUN", help="Id of a run, or its folder.")],
    out_dir: OutDir = Path("reports"),
) -> None:
    """Render the tables and figures of a run again, from its files alone.

    Example: `hybrid-rt report reports/20250101-120000-paper`
    """
    _render(load_run(run_id, out_dir), show=True)


@app.command()
def compare(
    first: Annotated[str, typer.Argument(metavar="A", help="The run before.")],
    second: Annotated[str, typer.Argument(metavar="B", help="The run after.")],
    out_dir: OutDir = Path("reports"),
) -> None:
    """Compare the times of two runs over the cells that both measured.

    Ratios are B / A with a 95 % interval; an interval that holds 1 shows no difference.

    Example: `hybrid-rt compare 20250101-120000-paper 20250102-120000-paper`
    """
    from hybrid_rt_bench import compare as comparing

    a, b = load_run(first, out_dir), load_run(second, out_dir)
    for table in comparing.compared(a, b):
        _show(table)


@app.command("list")
def list_() -> None:
    """List scenes with their cameras, experiments, techniques, workloads and peers."""
    import hybrid_rt_scenes as hrs
    from hybrid_rt_bench.peers import PEERS
    from hybrid_rt_bench.techniques import TECHNIQUES
    from hybrid_rt_bench.workloads import WORKLOADS

    table = RichTable("scene", "cameras", "what it is", title="Scenes", title_justify="left")
    missing = []
    for name in hrs.scene_names():
        spec = hrs.get_scene(name)
        absent = spec.missing()
        state = "built in" if spec.builtin else "missing" if absent else "found"
        if absent:
            missing.append(absent)
        cameras = "\n".join(spec.cameras)
        table.add_row(f"{name}\n[dim]{state}[/dim]", cameras, spec.description)
    out.print(table)
    out.print(f"Real scenes are looked for in {hrs.data_directory()}", soft_wrap=True)
    for text in missing:
        out.print(text, style="yellow", soft_wrap=True, markup=False, highlight=False)
    table = RichTable("experiment", "what it measures", title="Experiments", title_justify="left")
    for name in experiment_names():
        table.add_row(name, load_experiment(name).title)
    out.print(table)
    table = RichTable(
        "technique", "what it does", "default parameters", title="Techniques", title_justify="left"
    )
    for technique in TECHNIQUES.values():
        what = f"{technique.description}\n[dim]{technique.reference}[/dim]"
        table.add_row(
            technique.name, what, ", ".join(f"{k} {v}" for k, v in technique.parameters.items())
        )
    out.print(table)
    table = RichTable("workload", "which rays", title="Workloads", title_justify="left")
    for workload in WORKLOADS.values():
        table.add_row(workload.name, workload.description)
    out.print(table)
    table = RichTable(
        "peer", "version", "what is called", title="Programs for `run peers`", title_justify="left"
    )
    for peer in PEERS.values():
        table.add_row(peer.name, peer.version, peer.description)
    out.print(table)
    out.print("Thickness is a share of the diagonal of the scene's bounding box.")


@app.command()
def info() -> None:
    """Show versions, CPU, what Embree chose, and problems that would spoil measurements."""
    import numba
    import numpy as np

    from hybrid_rt_bench import env

    load = env.load_average()
    triangle = hrt.Scene.from_arrays(np.eye(3), [[0, 1, 2]])
    hrt.rasterize(triangle, hrt.Camera.look_at((0, 0, 2), (0, 0, 0), width=8, height=8))
    found = {**env.describe(numba.get_num_threads()), "load_average": load}
    table = RichTable(show_header=False, box=None)
    for key, value in found.items():
        if isinstance(value, dict):
            value = ", ".join(f"{k} {v}" for k, v in value.items())
        elif key == "memory_bytes":
            key, value = "memory", f"{value / 2**30:.1f} GiB"
        table.add_row(key.replace("_", " "), str(value))
    out.print(table)
    problems = env.problems(found)
    if not problems:
        out.print("no problems found", style="green")
    for problem in problems:
        out.print(f"problem: {problem}", style="yellow", soft_wrap=True, highlight=False)


@app.command()
def render(
    scene: Annotated[str, typer.Argument(help="Name of a scene, or path of a mesh file.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="PNG to write.")],
    camera: Annotated[
        str | None, typer.Option("--camera", help="Name of a camera; default: the first.")
    ] = None,
    size: Annotated[str, typer.Option("--size", help="WIDTHxHEIGHT in pixels.")] = "1280x720",
    what: Annotated[What, typer.Option("--what", help="What to show.")] = What.shaded,
    threads: Threads = None,
) -> None:
    """Write one picture of a scene.

    * `shaded` - sun, sky and shadows on bare geometry

    * `depth` - distance on a logarithmic scale

    * `normals` - turned to the viewer

    * `status` - how the march of every mirror ray ended, with a legend

    * `all` - a contact sheet of the four

    Examples
    --------
    * `hybrid-rt render atrium -o atrium.png`

    * `hybrid-rt render sponza --camera nave --what all --size 1920x1080 -o sponza.png`
    """
    from hybrid_rt_bench import render as rendering
    from hybrid_rt_bench.plan import find_scene

    pixels = Resolution.parse("--size", size)
    spec = find_scene(scene)
    view = spec.camera(camera or next(iter(spec.cameras)), pixels.width, pixels.height)
    rendering.check_output(output)
    rendering.write_png(output, rendering.render(spec.load(), view, what.value, threads))
    err.print(f"wrote {output}", soft_wrap=True, highlight=False)


def main() -> None:
    """Run the command line; errors made on purpose become one line on stderr."""
    try:
        app(prog_name="hybrid-rt")
    except ReportsError as error:
        _complain(error, FAILED)
    except hrt.HybridRTError as error:
        from hybrid_rt_bench.plan import NothingToRunError
        from hybrid_rt_scenes import MissingDataError

        nothing = isinstance(error, NothingToRunError | MissingDataError)
        _complain(error, FAILED if nothing else USAGE)
    except KeyboardInterrupt:
        err.print("stopped", style="yellow")
        sys.exit(INTERRUPTED)


def _complain(error: Exception, code: int) -> None:
    err.print(f"error: {error}", style="bold red", soft_wrap=True, markup=False, highlight=False)
    sys.exit(code)


def _render(data: RunData, *, show: bool) -> list[Path]:
    from hybrid_rt_bench.report import render_run

    with err.status("writing tables and figures"):
        tables, written = render_run(data)
    if show:
        for table in tables:
            _show(table, written[0])
        for path in written:
            out.print(f"wrote {path}", soft_wrap=True, highlight=False)
    return written


def _show(table: Table, document: Path | None = None) -> None:
    """Print a table; a terminal too narrow for a detailed one is told where it stands."""
    rich = table.rich()
    natural = Measurement.get(out, out.options.update(width=10_000), rich).maximum
    if document is not None and table.detail and natural > out.width:
        text = f"{table.title}: too wide for this terminal, see {document}"
        out.print(text, soft_wrap=True, highlight=False)
    else:
        out.print(rich)
    out.print()


def _check_options(spec: AnyExperiment, given: list[str]) -> None:
    """Refuse options that an experiment of this kind has no use for."""
    for name in given:
        if name not in spec.options:
            known = ", ".join(f"--{option}" for option in sorted(spec.options)) or "none of them"
            raise hrt.ArgumentError(
                f"--{name}", f"an option that kind {spec.kind!r} has ({known})", f"--{name}"
            )


def _overridden(spec: AnyExperiment, resolutions: str | None, rounds: int | None) -> AnyExperiment:
    """Return the experiment with what the command line changes."""
    if rounds is not None and rounds < 1:
        raise hrt.ArgumentError("--rounds", "an integer >= 1", str(rounds))
    names = _names("--resolutions", resolutions)
    sizes = None if names is None else [Resolution.parse("--resolutions", n) for n in names]
    return spec.overridden(sizes, rounds)


def _cells(count: int) -> str:
    return f"{count} finished cell{'s' if count != 1 else ''}"


def _names(option: str, text: str | None) -> list[str] | None:
    if text is None:
        return None
    names = [part.strip() for part in text.split(",") if part.strip()]
    if not names:
        raise hrt.ArgumentError(option, "at least one name", repr(text))
    return list(dict.fromkeys(names))


def _records(data: RunData) -> list[dict[str, Any]]:
    rows = data.results.to_dict("records")
    return [
        {str(k): None if isinstance(v, float) and not math.isfinite(v) else v for k, v in r.items()}
        for r in rows
    ]
