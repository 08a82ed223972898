"""Compare two runs of kind "scaling", cell by cell and stage by stage."""

from __future__ import annotations

import numpy as np
import pandas as pd

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.kinds.scaling.stages import name_of
from hybrid_rt_bench.kinds.scaling.tables import of_series, series_names, stages_of
from hybrid_rt_bench.report.differences import differences
from hybrid_rt_bench.report.table import Table, interval
from hybrid_rt_bench.results import exponents
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_bench.results.schema import HYBRID_STAGES

CELL = [
    "series", "x", "axis", "scene", "camera", "width", "height", "triangles", "threads",
]  # fmt: skip
"""What two cells must share to be the same cell, whatever the experiments were called."""

Ratios = dict[tuple[str, str], dict[tuple[str, int], stats.Estimate]]


def ratios(a: RunData, b: RunData) -> Ratios:
    """Return B / A by technique and stage, and then by series and place, with its interval.

    Raises
    ------
    ArgumentError
        No cell in common.
    """
    both = a.results[CELL].drop_duplicates().merge(b.results[CELL].drop_duplicates(), on=CELL)
    if both.empty:
        raise ArgumentError("runs", f"a cell that {a.name} and {b.name} share", "none in common")
    cells = [(str(s), int(x)) for s, x in zip(both.series, both.x, strict=True)]
    before, after = _seconds(a), _seconds(b)
    found: Ratios = {}
    for key in stages_of(a.results):
        for cell in cells:
            pair = (after.get((*cell, *key)), before.get((*cell, *key)))
            if pair[0] is not None and pair[1] is not None:
                found.setdefault(key, {})[cell] = stats.ratio_of_medians(pair[0], pair[1])
    return found


def tables(a: RunData, b: RunData) -> list[Table]:
    """Return the comparison as tables: ratios a series, and exponents before and after.

    Raises
    ------
    ArgumentError
        No cell in common.
    """
    found = ratios(a, b)
    shared = {cell for cells in found.values() for cell in cells}
    overall = Table(
        f"{b.name} over {a.name}: ratio of times, {len(shared)} cells in common",
        ["", "cells", "ratio [95 %]", "least", "most", "exponent before", "after"],
        notes=[
            "Below 1: the second run is faster. Geometric mean over the cells of a series; "
            "bootstrap over rounds. Least and most: of the cells. Exponents: over the cells in "
            "common.",
            *differences(a, b),
        ],
    )
    for series in series_names(a):
        rows = []
        for key, cells in found.items():
            mine = {x: estimate for (name, x), estimate in cells.items() if name == series}
            if not mine:
                continue
            mean = stats.geometric_mean_of_estimates(list(mine.values()))
            values = [estimate.value for estimate in mine.values()]
            rows.append(
                [
                    name_of(*key),
                    str(len(mine)),
                    interval(mean.value, mean.low, mean.high),
                    f"{min(values):.3f}",
                    f"{max(values):.3f}",
                    *(_exponent(run, series, key, list(mine)) for run in (a, b)),
                ]
            )
        if rows:
            overall.rows += [[series], *rows]
    return [overall]


def _exponent(run: RunData, series: str, key: tuple[str, str], places: list[int]) -> str:
    part = of_series(run, series)
    rows = part[(part.technique == key[0]) & (part.stage == key[1]) & part.x.isin(places)]
    value = exponents.fit(rows.x, rows.ms).value
    return "–" if np.isnan(value) else f"{value:.2f}"


def _seconds(run: RunData) -> dict[tuple[str, int, str, str], np.ndarray]:
    """Return the measured seconds by series, place, technique and stage, the hybrid's summed."""
    measured = run.samples[run.samples.phase == "measured"]
    hybrid = (
        measured[measured.stage.isin(HYBRID_STAGES)]
        .groupby(["series", "x", "technique", "round"], as_index=False)
        .seconds.sum()
        .assign(stage="hybrid")
    )
    rows = pd.concat([measured, hybrid])
    return {
        (str(s), int(x), str(technique), str(stage)): part.seconds.to_numpy()
        for (s, x, technique, stage), part in rows.groupby(["series", "x", "technique", "stage"])
    }
