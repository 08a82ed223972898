"""``hybrid-rt compare``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.cli import terminal
from hybrid_rt_bench.cli.common import OutDir

if TYPE_CHECKING:
    from hybrid_rt_bench.report.comparison.compare import Comparison

WIDTH = 100
"""Nothing is printed wider than this."""

CHANGED = 1
"""The exit code of ``--fail-on-change``."""


class ManyRuns(TyperCommand):
    """A command whose option ``--to`` takes all the words that follow it, up to the next option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the command line with ``--to B1 B2`` as ``--to B1 --to B2``."""
        words: list[str] = []
        taking = False
        for word in args:
            if word.startswith("-") and len(word) > 1:
                taking = word == "--to" or word.startswith("--to=")
                if word == "--to":
                    continue
            elif taking:
                words.append("--to")
            words.append(word)
        return super().parse_args(ctx, words)


def compare(
    runs: Annotated[
        list[str],
        typer.Argument(metavar="RUNS...", help="BEFORE AFTER, or with --to all runs before."),
    ],
    to: Annotated[
        list[str] | None, typer.Option("--to", metavar="RUNS...", help="All runs after.")
    ] = None,
    smallest: Annotated[
        float, typer.Option("--smallest", metavar="PERCENT", help="Report no smaller change.")
    ] = 5.0,
    every: Annotated[bool, typer.Option("--all", help="Show every cell.")] = False,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Write it, with every cell, as FILE.md or FILE.json."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print it as JSON, and nothing else, on stdout.")
    ] = False,
    fail_on_change: Annotated[
        bool, typer.Option("--fail-on-change", help="Exit with code 1 if anything changed.")
    ] = False,
    out_dir: OutDir = Path("reports"),
) -> None:
    """Tell whether runs after a change differ from runs before it, and in what.

    Counts (alpha, wrong answers, steps) are compared exactly. A time is divided by that of the
    strongest tracer in the same round, and is called changed only if it is beyond what runs of one
    program differ by. How much that is, repeated runs say: give some on each side, best made in
    turn. With one run a side it is assumed, cautiously. Runs are named by id, or by folder.

    Examples
    --------
    * `hybrid-rt compare 20250101-120000-paper 20250102-120000-paper`

    * `hybrid-rt compare A1 A2 A3 --to B1 B2 B3` - three runs before, three after

    * `hybrid-rt compare main/* --to branch/* --fail-on-change` - in a continuous integration

    * `hybrid-rt compare A B --all --output change.md` - every cell, and a file of it
    """
    from hybrid_rt_bench.runs import compare_runs, read_run

    before, after = _sides(runs, to)
    if output is not None and output.suffix not in (".md", ".json"):
        raise ArgumentError("--output", "a file that ends in .md or .json", repr(str(output)))
    read = [[read_run(run, out_dir) for run in side] for side in (before, after)]
    comparison = compare_runs(read[0], read[1], smallest / 100)
    if output is not None:
        _write(comparison, output)
    if as_json:
        print(_json(comparison))
    else:
        _show(comparison, every)
    if output is not None:
        terminal.err().print(f"wrote {output}", soft_wrap=True)
    raise typer.Exit(CHANGED if fail_on_change and comparison.changed else 0)


def _sides(runs: list[str], to: list[str] | None) -> tuple[list[str], list[str]]:
    if to:
        return runs, to
    if len(runs) != 2:
        expected = "BEFORE AFTER, or several as A1 A2 --to B1 B2"
        raise ArgumentError("runs", expected, f"{len(runs)} and no --to")
    return runs[:1], runs[1:]


def _json(comparison: Comparison) -> str:
    from hybrid_rt_bench.report.comparison import shown

    return json.dumps(shown.data(comparison), indent=1, allow_nan=False)


def _write(comparison: Comparison, path: Path) -> None:
    from hybrid_rt_bench.report.comparison import shown
    from hybrid_rt_bench.results.files import write_bytes

    whole = _json(comparison) + "\n" if path.suffix == ".json" else shown.document(comparison)
    write_bytes(path, whole.encode())


def _show(comparison: Comparison, every: bool) -> None:
    from hybrid_rt_bench.report.comparison import shown
    from hybrid_rt_bench.report.comparison.verdict import verdict

    out = terminal.out()
    out.width = min(out.width, WIDTH)
    out.print(shown.title(comparison), style="dim", highlight=False)
    style = "bold yellow" if comparison.changed else "bold green"
    out.print(verdict(comparison), style=style, highlight=False)
    for text in shown.warnings(comparison):
        out.print(f"warning: {text}", style="yellow", highlight=False)
    for table in shown.tables(comparison, every=every):
        out.print()
        out.print(table.rich())
