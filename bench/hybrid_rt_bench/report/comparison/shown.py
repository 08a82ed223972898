"""A comparison as tables, as a document and as plain data."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from hybrid_rt_bench.report.comparison.compare import Change, Comparison
from hybrid_rt_bench.report.comparison.verdict import (
    cell_namer,
    change_text,
    name_of,
    percent,
    verdict,
)
from hybrid_rt_bench.report.table import Table, number

ROWS = 20
"""So many rows of a table are shown where not all are asked for."""


def tables(comparison: Comparison, *, every: bool = False) -> list[Table]:
    """Return a comparison as tables; `every` row of them, or those that changed."""
    found = [
        _means(comparison),
        _cells(comparison, every),
        _counts(comparison),
        _alone(comparison),
        _baselines(comparison),
    ]
    return [table if every else _cut(table) for table in found if table.rows]


def document(comparison: Comparison) -> str:
    """Return a comparison as markdown, with every row."""
    lines = [f"# {title(comparison)}", "", verdict(comparison)]
    if texts := warnings(comparison):
        lines += ["", "Warnings:", "", *[f"- {text}" for text in texts]]
    parts = [table.markdown() for table in tables(comparison, every=True)]
    return "\n".join(lines) + "\n\n" + "\n".join(parts)


def title(comparison: Comparison) -> str:
    """Return which runs are compared."""
    before, after = ", ".join(comparison.before), ", ".join(comparison.after)
    return f"{before} (before) and {after} (after), kind {comparison.kind}"


def warnings(comparison: Comparison) -> list[str]:
    """Return all that is to be known before it is believed."""
    return [*comparison.foreign, *comparison.warnings]


def data(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as plain data for JSON."""
    found = {
        "verdict": verdict(comparison),
        "changed": comparison.changed,
        **dataclasses.asdict(comparison),
    }
    found["changes"] = [dataclasses.asdict(change) for change in comparison.changes]
    plain: dict[str, Any] = _plain(found)
    return plain


def _means(comparison: Comparison) -> Table:
    table = Table(
        "Times over their baseline, mean of all cells",
        ["time", "cells", "before, ms", "after, ms", "change (95 %)", ""],
    )
    for change in comparison.groups:
        row = [name_of(change.names, change.timing), str(change.effect.cells), *_times(change)]
        table.rows.append([*row, _said(change)])
    table.notes.append(
        "Change of the time over that of the strongest tracer in the same rounds; above 0 the "
        "second side is slower. Milliseconds are as measured."
    )
    return table


def _cells(comparison: Comparison, every: bool) -> Table:
    name = cell_namer(change.cell for change in comparison.cells)
    shown = [change for change in comparison.cells if every or change.verdict]
    table = Table(
        "Cell by cell" if every else "Cells that changed by themselves",
        ["time", "cell", "before, ms", "after, ms", "change (95 %)", ""],
    )
    for change in shown:
        row = [name_of(change.names, change.timing), name(change.cell), *_times(change)]
        table.rows.append([*row, _said(change)])
    return table


def _counts(comparison: Comparison) -> Table:
    table = Table("Counts that are not the same", ["row", "what", "before", "after"])
    names = cell_namer(difference.row for difference in comparison.differences)
    for difference in comparison.differences:
        sides = (
            " or ".join(_value(value) for value in side) or "–"
            for side in (difference.before, difference.after)
        )
        table.rows.append([names(difference.row), difference.column, *sides])
    return table


def _alone(comparison: Comparison) -> Table:
    table = Table("Rows that only one side has", ["row", "side"])
    name = cell_namer(row for side in comparison.alone for row in side)
    for word, side in zip(("before", "after"), comparison.alone, strict=True):
        table.rows += [[name(row), word] for row in side]
    return table


def _baselines(comparison: Comparison) -> Table:
    table = Table(
        "The baselines themselves, which have nothing beside them",
        ["time", "cells", "before, ms", "after, ms", "raw change"],
    )
    for change in comparison.baselines:
        row = [name_of(change.names, change.timing), str(change.effect.cells)]
        table.rows.append([*row, *_times(change)[:2], percent(change.effect.ratio)])
    table.notes.append(
        "Raw times hold the machine's state as well: never called a change here. By as much as "
        "these differ, less is believed of the times beside them."
    )
    return table


def _times(change: Change) -> list[str]:
    return [number(change.before_ms), number(change.after_ms), change_text(change)]


def _said(change: Change) -> str:
    return change.verdict or ("" if change.judged else "too short")


def _value(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _cut(table: Table) -> Table:
    more = len(table.rows) - ROWS
    if more <= 0:
        return table
    note = f"{more} more rows: --all shows them, and --output FILE.md keeps them."
    return dataclasses.replace(table, rows=table.rows[:ROWS], notes=[*table.notes, note])


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
