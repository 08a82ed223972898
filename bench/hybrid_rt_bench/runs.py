"""Runs, shown as their kinds show them: read again, rendered, compared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from hybrid_rt.errors import ArgumentError, HybridRTError
from hybrid_rt_bench.measure.errors import reason_of
from hybrid_rt_bench.registry import kinds
from hybrid_rt_bench.report import render
from hybrid_rt_bench.report.comparison.compare import Comparison, compare
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.report.verdict import paragraph
from hybrid_rt_bench.results.effects import SMALLEST
from hybrid_rt_bench.results.files import ReportsError
from hybrid_rt_bench.results.folder import RunData, load_run

Made = TypeVar("Made")


def read_run(run: str | Path, out: Path = Path("reports")) -> RunData:
    """Return a run by its folder, or by its id inside `out`.

    Raises
    ------
    UnknownNameError
        No such folder; with the nearest run in `out`.
    ReportsError
        A folder without a finished cell, damaged, or of a kind that is not known.
    """
    return load_run(run, out, schema_of=lambda kind: kinds[kind].columns())


def render_run(run: RunData) -> tuple[list[Table], list[Path]]:
    """Write the tables and figures of a run, and return the tables and the paths of all files.

    Raises
    ------
    ReportsError
        The folder cannot be written to, or what it holds cannot be shown.
    """
    kind = kinds[run.kind]
    return _whole(
        run,
        lambda: render.render_run(
            run, kind.table_maker(), kind.verdict_maker(), kind.figure_makers()
        ),
    )


def verdict_of(run: RunData) -> str:
    """Return the paragraph that says what a run comes to.

    Raises
    ------
    ReportsError
        What the folder holds cannot be shown.
    """
    return _whole(run, lambda: paragraph(run, kinds[run.kind].verdict_maker()))


def compare_runs(
    before: Sequence[RunData], after: Sequence[RunData], smallest: float = SMALLEST
) -> Comparison:
    """Return how the runs of one side differ from those of the other.

    Parameters
    ----------
    before, after : sequence of RunData
        Several runs a side say how far runs of one program lie apart.
    smallest : float
        As a share: no smaller change is reported.

    Raises
    ------
    ArgumentError
        No run, one run twice on a side, runs of different kinds, of a kind that does not say what
        of it is compared, or without a row in common.
    ReportsError
        What a folder holds cannot be compared.
    """
    for side, runs in (("before", before), ("after", after)):
        if not runs:
            raise ArgumentError(side, "at least one run", "none")
        folders = [run.folder.resolve() for run in runs]
        for run in runs:
            if folders.count(run.folder.resolve()) > 1:
                raise ArgumentError(side, "runs that differ", f"{run.name} twice")
    if not 0 <= smallest < 10:
        raise ArgumentError("smallest", "a share, 0 or more", str(smallest))
    kind = before[0].kind
    for run in (*before, *after):
        if run.kind != kind:
            expected = f"runs of one kind ({before[0].name} is of kind {kind!r})"
            raise ArgumentError("runs", expected, f"{run.name}, of kind {run.kind!r}")
    compared = kinds[kind].compared()
    if compared is None:
        raise ArgumentError("runs", "a kind that says what of it is compared", repr(kind))
    known, schema = compared, kinds[kind].columns()
    return _whole(before[0], lambda: compare(before, after, known, schema, smallest))


def _whole(run: RunData, call: Callable[[], Made]) -> Made:
    """Return what `call` makes of a run; what it stumbles over is told of the run's folder."""
    try:
        return call()
    except (HybridRTError, MemoryError):
        raise
    except Exception as error:
        raise ReportsError(f"{run.folder}: cannot be shown ({reason_of(error)})") from error
