"""What is counted, and is the same in every run of one program: compared exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from hybrid_rt_bench.report.comparison.rounds import identity
from hybrid_rt_bench.results.compared import Compared
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_bench.results.schema import Schema

Row = dict[str, Any]
Key = tuple[Any, ...]


@dataclass(frozen=True)
class Difference:
    """A column of a row that is not the same in all runs.

    Attributes
    ----------
    row : dict
        Cell, technique and what else names the row.
    column : str
    before, after : list
        The values of each side, each once.
    """

    row: Row
    column: str
    before: list[Any]
    after: list[Any]


@dataclass(frozen=True)
class Counted:
    """What is counted by two sides.

    Attributes
    ----------
    common : list of tuple
        The rows that both have.
    alone : tuple of two lists of dict
        Those that only one has.
    differences : list of Difference
    """

    common: list[Key]
    alone: tuple[list[Row], list[Row]]
    differences: list[Difference]


def counted(
    before: Sequence[RunData], after: Sequence[RunData], compared: Compared, schema: Schema
) -> Counted:
    """Return what is counted by the runs of two sides, held against each other."""
    place = [*identity(compared, schema), *compared.names]
    sides = [[_rows(run, place, compared, schema) for run in side] for side in (before, after)]
    keys = [dict.fromkeys(key for rows in side for key in rows) for side in sides]
    common = [key for key in keys[0] if key in keys[1]]
    differences = []
    for key in common:
        found = [[rows[key] for rows in side if key in rows] for side in sides]
        columns = dict.fromkeys(c for side in found for row in side for c in row)
        for column in columns:
            # Rays that end in a way that no ray of the other run ends in are none there.
            absent = {} if column in compared.exact else {column: 0}
            values = [
                _once(known[column] for row in side if column in (known := absent | row))
                for side in found
            ]
            if len(_once([*values[0], *values[1]])) > 1:
                row = dict(zip(place, key, strict=True))
                differences.append(Difference(row, column, *values))
    alone = [
        [dict(zip(place, key, strict=True)) for key in mine if key not in other]
        for mine, other in ((keys[0], keys[1]), (keys[1], keys[0]))
    ]
    return Counted(common, (alone[0], alone[1]), differences)


def _rows(
    run: RunData, place: list[str], compared: Compared, schema: Schema
) -> dict[Key, dict[str, Any]]:
    """Return what a run counted, by row; nothing for a row that depends on what was chosen."""
    results = run.results
    columns = [name for name in compared.exact if name in results]
    found: dict[Key, dict[str, Any]] = {}
    for row in results[list(dict.fromkeys([*place, *columns]))].to_dict("records"):
        loose = any(row.get(name) == value for name, value in compared.loose)
        values = {} if loose else {column: row[column] for column in columns}
        # A cell's counts stand in the row of each of its stages, where these are rows.
        known = found.setdefault(tuple(row[name] for name in place), {})
        known |= {k: v for k, v in values.items() if not _nothing(v) or k not in known}
    if not run.verdicts.empty:
        _add_verdicts(found, run, place, compared, schema)
    return found


def _add_verdicts(
    found: dict[Key, dict[str, Any]],
    run: RunData,
    place: list[str],
    compared: Compared,
    schema: Schema,
) -> None:
    """Add how many rays ended in each way, and what the judge said of them."""
    named = set(schema.tables["verdicts"]) - {*schema.key_names, *compared.names, "count"}
    ways = [name for name in schema.tables["verdicts"] if name in named]
    counts = run.verdicts.groupby([*place, *ways])["count"].sum()
    every = dict.fromkeys(key[len(place) :] for key in counts.index)
    for key, values in found.items():
        if values:
            words = {way: ", ".join(way).lower() for way in every}
            values |= {words[way]: int(counts.get((*key, *way), 0)) for way in every}


def _once(values: Any) -> list[Any]:
    """Return values, each once; NaN is one value."""
    found: list[Any] = []
    for value in values:
        if not any(value == other or (_nothing(value) and _nothing(other)) for other in found):
            found.append(value)
    return found


def _nothing(value: Any) -> bool:
    return bool(pd.isna(value))
