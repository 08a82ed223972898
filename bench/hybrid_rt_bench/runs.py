"""Runs, shown as their kinds show them: read again, rendered, compared."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from hybrid_rt.errors import ArgumentError, HybridRTError
from hybrid_rt_bench.measure.errors import reason_of
from hybrid_rt_bench.registry import kinds
from hybrid_rt_bench.report import render
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.report.verdict import paragraph
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


def compare_runs(a: RunData, b: RunData) -> list[Table]:
    """Return the tables of how run `b` differs from run `a`.

    Raises
    ------
    ArgumentError
        Runs of different kinds, of one that has no times, or without a cell in common.
    ReportsError
        What a folder holds cannot be compared.
    """
    comparer = kinds[a.kind].comparer()
    if comparer is None or a.kind != b.kind:
        able = [f"two of kind {name!r}" for name, kind in kinds.items() if kind.compare is not None]
        other = a if comparer is None else b
        raise ArgumentError("runs", " or ".join(able), f"{other.name}, of kind {other.kind!r}")
    made = comparer
    return _whole(a, lambda: made(a, b))


def _whole(run: RunData, call: Callable[[], Made]) -> Made:
    """Return what `call` makes of a run; what it stumbles over is told of the run's folder."""
    try:
        return call()
    except (HybridRTError, MemoryError):
        raise
    except Exception as error:
        raise ReportsError(f"{run.folder}: cannot be shown ({reason_of(error)})") from error
