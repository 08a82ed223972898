"""What a run of kind "scaling" comes to."""

from __future__ import annotations

from typing import Any

import pandas as pd

from hybrid_rt_bench.kinds.scaling.stages import SHARED, Key
from hybrid_rt_bench.kinds.scaling.tables import (
    FROM,
    GOAL,
    MIB,
    TO,
    ends,
    exponent_text,
    goal_said,
    growths,
    labels,
    of_series,
    ratio_text,
    series_names,
    stages_of,
)
from hybrid_rt_bench.report.table import number
from hybrid_rt_bench.report.words import MOST_NAMED, counted, few
from hybrid_rt_bench.results import exponents
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return how march, hybrid and Embree grow in each series, and the largest peak of memory."""
    said = []
    every = series_names(run)
    for name in every[:MOST_NAMED]:
        axis = str(of_series(run, name).axis.iloc[0])
        say = {"triangles": _triangles, "pixels": _pixels, "threads": _threads}[axis]
        said.append(say(run, name))
    if len(every) > MOST_NAMED:
        said.append(f"{counted(len(every) - MOST_NAMED, 'further series')} in the tables.")
    peaks = run.results[run.results.peak_bytes > 0]
    if len(peaks):
        most: Any = peaks.sort_values("peak_bytes", kind="stable").iloc[-1]
        said.append(
            f"The most memory of any cell is {most.peak_bytes / MIB:,.0f} MiB ({most.series}, "
            f"{most.label})."
        )
    return " ".join(said)


def _triangles(run: RunData, name: str) -> str:
    part = of_series(run, name)
    first, last = ends(part)
    names = labels(part)
    if first == last:
        return _one(part, name)
    found = [growth for growth in growths(run, name) if growth.key[1] != "hybrid"]
    goal = ""
    if (first, last) == (FROM, TO):
        marches = [growth for growth in found if growth.key[1] == "march"]
        parts = [f"{goal_said(growth.ratio)} by {growth.key[0]}" for growth in marches]
        goal = f" (the goal, below {GOAL} for a march, is {few(parts)})" if parts else ""
    grown = [f"{ratio_text(growth.ratio)} for {_name(growth.key)}" for growth in found]
    return (
        f"From {names[first]} to {names[last]} triangles at a fixed view (series {name}) the time "
        f"grows by a factor of {few(grown)}{goal}. {_beside(part, last)}"
    )


def _pixels(run: RunData, name: str) -> str:
    part = of_series(run, name)
    names = labels(part)
    parts = []
    for key, rows in _lines(part):
        found = exponents.fit(rows.x, rows.ms)
        if found.points > 1:
            parts.append(f"{exponent_text(found)} for {_name(key)}")
    if not parts:
        return _one(part, name)
    first, last = min(names), max(names)
    return (
        f"From {names[first]} to {names[last]} (series {name}) the time goes with the number of "
        f"pixels to the power of {few(parts)}. {_beside(part, last)}"
    )


def _threads(run: RunData, name: str) -> str:
    part = of_series(run, name)
    names = labels(part)
    first, last = min(names), max(names)
    if first == last:
        return _one(part, name)
    parts = []
    for key, rows in _lines(part):
        by = rows.set_index("x").ms
        if first in by.index and last in by.index:
            parts.append(f"{_name(key)} is {number(by[first] / by[last])}")
    return (
        f"With {last} threads in place of {first} (series {name}) {few(parts)} times as fast. "
        f"{_beside(part, last)}"
    )


def _one(part: pd.DataFrame, name: str) -> str:
    return f"Series {name} has one place only. {_beside(part, int(part.x.iloc[0]))}"


def _beside(part: pd.DataFrame, x: int) -> str:
    """Return the time of each hybrid over that of Embree at one place, by their medians."""
    here = part[part.x == x]
    embree = here[(here.stage == "embree") & (here.technique == SHARED)].ms
    hybrids = here[here.stage == "hybrid"]
    if embree.empty or hybrids.empty:
        return ""
    parts = [
        f"{number(float(ms) / float(embree.iloc[0]))} times (technique {technique})"
        for technique, ms in zip(hybrids.technique, hybrids.ms, strict=True)
    ]
    axis = str(part.axis.iloc[0])
    place = labels(part)[x]
    if axis != "pixels":
        place += f" {axis}" if x != 1 else f" {axis.removesuffix('s')}"
    return (
        f"At {place} the hybrid takes {few(parts)} the time of the strongest Embree for "
        "every ray (ratios of medians)."
    )


def _lines(part: pd.DataFrame) -> list[tuple[Key, Any]]:
    """Return the rows of Embree and of each hybrid."""
    keys = [key for key in stages_of(part) if key[1] in ("embree", "hybrid")]
    return [
        (key, part[(part.technique == key[0]) & (part.stage == key[1])]) for key in keys
    ]  # fmt: skip


def _name(key: Key) -> str:
    technique, stage = key
    if technique == SHARED:
        return "the strongest Embree"
    return f"the {'hybrid' if stage == 'hybrid' else stage} with {technique}"
