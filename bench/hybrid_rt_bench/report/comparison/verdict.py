"""The words of a comparison: what a row is called, and one paragraph that says what changed."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable
from typing import Any

from hybrid_rt_bench.report.comparison.compare import Change, Comparison
from hybrid_rt_bench.report.table import number
from hybrid_rt_bench.results.effects import LEVEL

MOST = 6
"""So many changes are told in the paragraph; the tables have all."""

HINT = "several runs a side (A1 A2 A3 --to B1 B2 B3) measure it and show smaller changes"


def verdict(comparison: Comparison) -> str:
    """Return what changed, in one paragraph without a line break."""
    said = [_changed(comparison) if comparison.changed else _unchanged(comparison)]
    if comparison.foreign and comparison.groups:
        said.append("The machines are not the same, so that a change of times may be theirs.")
    if any(change.judged for change in comparison.groups):
        runs = len(comparison.before), len(comparison.after)
        timing, least = _detectable(comparison)
        unseen = f"a change of {timing} below about {number(100 * least, 2)} % would not be seen"
        if sum(runs) == 2:
            said.append(
                "One run a side: how far runs of one program lie apart is assumed and not "
                f"measured, single cells are not judged, and {unseen}; {HINT}."
            )
        else:
            said.append(f"With {runs[0]} and {runs[1]} runs {unseen}.")
    far = [change for change in comparison.baselines if _far(change)]
    if far:
        said.append(
            f"{' and '.join(map(_baseline, far))}, by the machine or by Embree: times are divided "
            "by that of the same round, and by as much as it differs less is believed of them."
        )
    return " ".join(said)


def name_of(names: dict[str, Any], *parts: str) -> str:
    """Return whose a row is, and what of it, in words."""
    words = [f"{v} thread{'s' * (v != 1)}" if k == "threads" else v for k, v in names.items() if v]
    return ", ".join([*map(str, words), *parts])


def cell_namer(cells: Iterable[dict[str, Any]]) -> Callable[[dict[str, Any]], str]:
    """Return what names a cell by what tells it apart from the others, its scene always."""
    every = list(cells)
    kept = ("scene", "case", "technique", "timing")
    keys = dict.fromkeys(key for cell in every for key in cell)
    same = {key for key in keys if len({cell.get(key) for cell in every}) == 1}

    def name(cell: dict[str, Any]) -> str:
        left = {k: v for k, v in cell.items() if k in kept or k not in same}
        words = []
        for key, value in left.items():
            if key == "height" and "width" in left:
                continue
            if key == "width":
                words.append(f"{value}x{cell['height']}")
            elif key in ("triangles", "threads"):
                words.append(f"{value} {key}")
            elif key in ("height", "seed", "x"):
                words.append(f"{key} {value}")
            elif value != "":
                words.append(str(value))
        return ", ".join(words)

    return name


def percent(ratio: float) -> str:
    """Return a ratio of times as a signed change in per cent."""
    change = 100 * (ratio - 1)
    return f"{'+' if change >= 0 else '-'}{abs(change):.{0 if abs(change) >= 99.5 else 1}f} %"


def change_text(change: Change) -> str:
    """Return a change with its interval."""
    effect = change.effect
    low, high = (percent(end).removesuffix(" %") for end in (effect.low, effect.high))
    return f"{percent(effect.ratio)} ({low} to {high})"


def _changed(comparison: Comparison) -> str:
    changes = comparison.changes
    cell = cell_namer(change.cell for change in comparison.cells)
    said = [_sentence(change, cell(change.cell)) for change in changes[:MOST]]
    if len(changes) > MOST:
        said.append(f"{len(changes) - MOST} more")
    if comparison.differences:
        rows = {str(difference.row) for difference in comparison.differences}
        columns = dict.fromkeys(difference.column for difference in comparison.differences)
        named = ", ".join(list(columns)[:MOST]) + (" and more" if len(columns) > MOST else "")
        said.append(f"{len(rows)} of {comparison.counted} rows differ in what is counted ({named})")
    return "Changed: " + "; ".join(said) + "."


def _sentence(change: Change, cell: str) -> str:
    effect = change.effect
    ends = sorted(_size(end, change.verdict) for end in (effect.low, effect.high))
    where = f"on {cell}" if change.cell else f"over {_count(effect.cells, 'cell')}"
    technique = "technique " * bool(change.names.get("technique"))
    return (
        f"{technique}{name_of(change.names, change.timing)} {change.verdict} by "
        f"{number(_size(effect.ratio, change.verdict), 2)} % ({number(ends[0], 2)} to "
        f"{number(ends[1], 2)} %) {where}"
    )


def _size(ratio: float, word: str) -> float:
    return 100 * (ratio - 1 if word == "slower" else 1 - ratio)


def _unchanged(comparison: Comparison) -> str:
    counted = f"the counts of {_count(comparison.counted, 'row')} are the same"
    tested = [change for change in comparison.groups if change.judged]
    if not tested:
        return f"No change: {counted}; no times were compared."
    cells = len({str(change.cell) for change in comparison.cells})
    return (
        f"No change: none of {_count(len(tested), 'time')} over {_count(cells, 'cell')} differs by "
        f"{100 * comparison.smallest:g} % or more beyond what runs of one program do, and "
        f"{counted}."
    )


def _detectable(comparison: Comparison) -> tuple[str, float]:
    """Return the first time that is judged, and the mean change from which on it is called one."""
    tested = [change for change in comparison.groups if change.judged]
    first = [change for change in tested if change.timing == tested[0].timing]
    needed = [change.effect.needed(LEVEL / 2 / len(tested)) for change in first]
    return first[0].timing, max(comparison.smallest, statistics.median(needed))


def _far(change: Change) -> bool:
    return abs(math.log(change.effect.ratio)) >= math.log(1.1)


def _baseline(change: Change) -> str:
    ratio = number(change.effect.ratio, 2)
    return f"{name_of(change.names, change.timing)} took {ratio} times as long after"


def _count(count: int, word: str) -> str:
    return f"{count} {word}{'s' if count != 1 else ''}"
