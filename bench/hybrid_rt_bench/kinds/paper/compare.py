"""Compare two runs, cell by cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.kinds.paper.columns import STAGES
from hybrid_rt_bench.report.differences import differences
from hybrid_rt_bench.report.table import Table, interval, number
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_bench.results.schema import HYBRID_STAGES

KEYS = ["scene", "camera", "width", "height", "technique"]


@dataclass(frozen=True)
class Comparison:
    """Ratios of the times of two runs over the cells that both measured.

    Attributes
    ----------
    stages : dict of Estimate
        B / A by stage: geometric mean over cells, with its interval.
    cells : DataFrame
        One row a cell: its keys, ``ratio`` of the hybrid's time with ``low`` and ``high``, and the
        two alphas.
    warnings : list of str
    """

    stages: dict[str, stats.Estimate]
    cells: pd.DataFrame
    warnings: list[str]


def compare(a: RunData, b: RunData) -> Comparison:
    """Return how run `b` differs from run `a`.

    Runs are paired by cell. Their rounds are not paired, since they ran at different times, so each
    cell's interval is a bootstrap over the rounds of both.

    Raises
    ------
    ArgumentError
        No cell in common.
    """
    both = a.results.merge(b.results, on=KEYS, suffixes=("_a", "_b"))
    if both.empty:
        raise ArgumentError("runs", f"a cell that {a.name} and {b.name} share", "none in common")
    times_a, times_b = _times(a), _times(b)
    stages: dict[str, list[stats.Estimate]] = {}
    rows = []
    for row in both.itertuples(index=False):
        key = tuple(getattr(row, k) for k in KEYS)
        ratios = {
            stage: stats.ratio_of_medians(times_b[key][stage], times_a[key][stage])
            for stage in times_a[key]
        }
        for stage, r in ratios.items():
            stages.setdefault(stage, []).append(r)
        hybrid = ratios["hybrid"]
        rows.append(
            {
                **dict(zip(KEYS, key, strict=True)),
                "ratio": hybrid.value,
                "low": hybrid.low,
                "high": hybrid.high,
                "alpha_a": row.alpha_a,
                "alpha_b": row.alpha_b,
            }
        )
    means = {stage: stats.geometric_mean_of_estimates(values) for stage, values in stages.items()}
    return Comparison(means, pd.DataFrame(rows), _warnings(a, b, len(both)))


def tables(a: RunData, b: RunData) -> list[Table]:
    """Return the tables of how run `b` differs from run `a`."""
    return shown(compare(a, b), a, b)


def shown(comparison: Comparison, a: RunData, b: RunData) -> list[Table]:
    """Return the comparison as tables."""
    names = {**STAGES, "hybrid": "hybrid, all its stages"}
    overall = Table(
        f"{b.name} over {a.name}: ratio of times, {len(comparison.cells)} cells in common",
        ["stage", "ratio [95 %]", "verdict"],
        [
            [names[stage], interval(r.value, r.low, r.high), _verdict(r.low, r.high)]
            for stage, r in comparison.stages.items()
        ],
        ["Below 1: the second run is faster. Geometric mean over cells; bootstrap over rounds."],
    )
    cells = Table(
        "The hybrid, cell by cell",
        ["cell", "ratio [95 %]", "alpha before", "alpha after"],
        [
            [
                f"{r.scene}, {r.camera}, {r.width}x{r.height}",
                interval(float(r.ratio), float(r.low), float(r.high)),
                f"{r.alpha_a:.3f}",
                f"{r.alpha_b:.3f}",
            ]
            for _, r in comparison.cells.iterrows()
        ],
        comparison.warnings,
    )
    return [overall, cells]


def _times(run: RunData) -> dict[tuple[object, ...], dict[str, np.ndarray]]:
    """Return the seconds of each round, by cell and technique and then by stage."""
    out: dict[tuple[object, ...], dict[str, np.ndarray]] = {}
    measured = run.samples[run.samples.phase == "measured"].sort_values("round")
    for row in run.results[KEYS].itertuples(index=False):
        mine = measured[
            (measured.scene == row.scene)
            & (measured.camera == row.camera)
            & (measured.width == row.width)
            & (measured.height == row.height)
            & measured.technique.isin(["", row.technique])
        ]
        by_stage = {s: mine.loc[mine.stage == s, "seconds"].to_numpy() for s in STAGES}
        by_stage["hybrid"] = np.sum([by_stage[s] for s in HYBRID_STAGES], axis=0)
        out[tuple(row)] = by_stage
    return out


def _verdict(low: float, high: float) -> str:
    if high < 1:
        return f"faster by {number(100 * (1 - high), 2)} % or more"
    if low > 1:
        return f"slower by {number(100 * (low - 1), 2)} % or more"
    return "no difference shown"


def _warnings(a: RunData, b: RunData, common: int) -> list[str]:
    found = []
    for run in (a, b):
        if len(run.results) > common:
            found.append(f"{len(run.results) - common} cells of {run.name} are in that run alone.")
    return found + differences(a, b)
