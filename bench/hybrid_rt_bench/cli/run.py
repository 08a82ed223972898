"""``hybrid-rt run``: its options are those of the kinds that are registered."""

from __future__ import annotations

import inspect
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.cli import terminal
from hybrid_rt_bench.cli.common import OutDir, Threads, names, rendered
from hybrid_rt_bench.options import Option
from hybrid_rt_bench.registry import Kind, kinds

if TYPE_CHECKING:
    from hybrid_rt_bench.measure.experiment import AnyExperiment
    from hybrid_rt_bench.measure.lifecycle import Outcome
    from hybrid_rt_bench.results.folder import RunData


def run(
    experiment: Annotated[
        str, typer.Argument(help="Name of an experiment (see `list`), or path of a TOML file.")
    ],
    quick: Annotated[
        bool, typer.Option("--quick", help="Minutes: built-in scenes, small pictures, few rounds.")
    ] = False,
    threads: Threads = None,
    out_dir: OutDir = Path("reports"),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a summary as JSON, and nothing else, on stdout.")
    ] = False,
    **given: str | float | None,
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

    * `hybrid-rt run error --techniques paper,slope` - only some of the techniques

    * `hybrid-rt run error --depth dump.npz --scene hall.glb` - a depth buffer of your own

    * `hybrid-rt run stability` - the hard set: which technique answers wrongly on which case

    * `hybrid-rt run scaling --series triangles --triangles 2^10..2^20` - growth over one axis

    * `hybrid-rt run peers --quick` - the same rays and pictures through other programs

    * `hybrid-rt run roofline --quick` - what the certified march takes, and its break-even
    """
    from hybrid_rt_bench.experiments import load_experiment

    spec = load_experiment(experiment, quick=quick)
    kind = kinds[spec.kind]
    if given.get("depth") is not None and kind.frames:
        spec = load_experiment(kind.frames, quick=quick)
        kind = kinds[spec.kind]
    values = _values(kind, given)
    changes = {o.parameter: values[o.parameter] for o in _options(kind, values) if o.changes}
    picked = {o.parameter: values[o.parameter] for o in _options(kind, values) if not o.changes}
    if changes:
        spec = spec.overridden(**changes)
    outcome = _measured(kind, spec, threads, out_dir, picked)
    summary: dict[str, Any] = {
        "run": outcome.folder.name,
        "folder": str(outcome.folder),
        "measured": outcome.measured,
        "failed": outcome.failed,
        "interrupted": outcome.interrupted,
        "broken": list(outcome.broken),
    }
    if outcome.measured:
        from hybrid_rt_bench.runs import read_run, verdict_of

        data = read_run(outcome.folder, out_dir)
        written = rendered(data, show=not as_json)
        summary |= {
            "verdict": verdict_of(data),
            "notes": data.meta["notes"],
            "warnings": data.meta["warnings"],
            "results": _records(data),
            "files": [str(path) for path in written],
        }
    if as_json:
        print(json.dumps(summary, indent=1, allow_nan=False))
    raise typer.Exit(_said(outcome))


def add_to(app: typer.Typer) -> None:
    """Add the command to an application, with the options of all kinds."""
    every = {option.name: option for kind in kinds.values() for option in kind.options}
    known = inspect.signature(run, eval_str=True)
    plain = [p for p in known.parameters.values() if p.kind is not p.VAR_KEYWORD]
    added = [
        inspect.Parameter(
            option.parameter,
            inspect.Parameter.KEYWORD_ONLY,
            default=None,
            annotation=Annotated[
                (str if option.type is list else option.type) | None,
                typer.Option(f"--{option.name}", help=_help(option)),
            ],
        )
        for option in every.values()
    ]

    def command(**arguments: Any) -> None:
        run(**arguments)

    parameters = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in (*plain, *added)]
    command.__signature__ = known.replace(parameters=parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    command.__doc__ = run.__doc__
    app.command("run")(command)


def _help(option: Option) -> str:
    having = [name for name, kind in kinds.items() if option in kind.options]
    return option.help if len(having) > 2 else f"{option.help} (kind {', '.join(having)})"


def _options(kind: Kind, values: dict[str, Any]) -> list[Option]:
    return [option for option in kind.options if option.parameter in values]


def _values(kind: Kind, given: dict[str, str | float | None]) -> dict[str, Any]:
    """Return the values of the options that were given.

    Raises
    ------
    ArgumentError
        An option that the kind does not have, or a value that it cannot be.
    """
    from hybrid_rt_bench.measure.experiment import Resolution

    known = {option.parameter: option for option in kind.options}
    found: dict[str, Any] = {}
    for name, value in given.items():
        if value is None:
            continue
        if name not in known:
            flag = f"--{name.replace('_', '-')}"
            names_of = [f"--{option.name}" for option in kind.options]
            has = ", ".join(names_of + ["--depth"] * bool(kind.frames)) or "none of them"
            raise ArgumentError(flag, f"an option that kind {kind.name!r} has ({has})", flag)
        flag = f"--{known[name].name}"
        if known[name].type is list:
            found[name] = names(flag, str(value))
            if name == "resolutions":
                found[name] = [Resolution.parse(flag, text) for text in found[name]]
        else:
            found[name] = value
    return found


def _measured(
    kind: Kind, spec: AnyExperiment, threads: int | None, out: Path, picks: dict[str, Any]
) -> Outcome:
    from hybrid_rt_bench.measure.progress import Reporter

    reporter = Reporter(terminal.err())
    with reporter:
        reporter.begin(f"{spec.name}: loading the compiler and Embree")
        from hybrid_rt_bench.measure.lifecycle import Request

        return kind.runner()(spec, Request(reporter, threads, out, sys.argv[1:], picks))


def _said(outcome: Outcome) -> int:
    """Say what became of a run, and return its exit code."""
    err, kept = terminal.err(), f"{_cells(outcome.measured)} kept in {outcome.folder}"
    if outcome.interrupted:
        err.print(f"stopped: {kept}", style="yellow", soft_wrap=True)
        return terminal.stop_code()
    if outcome.failed:
        err.print(f"{outcome.failed} failed, {kept}", style="bold red", soft_wrap=True)
    for promise in outcome.broken:
        err.print(promise, style="bold red", soft_wrap=True)
    return terminal.FAILED if outcome.failed or outcome.broken else 0


def _cells(count: int) -> str:
    return f"{count} finished cell{'s' if count != 1 else ''}"


def _records(data: RunData) -> list[dict[str, Any]]:
    rows = data.results.to_dict("records")
    return [
        {str(k): None if isinstance(v, float) and not math.isfinite(v) else v for k, v in r.items()}
        for r in rows
    ]
