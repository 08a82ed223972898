"""How tables and verdicts of runs that judge write what they have pooled."""

from __future__ import annotations

from typing import Any

import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.judged.columns import CELL, EMBREE, POINT
from hybrid_rt_bench.judged.pooling import Pooled
from hybrid_rt_bench.report.table import DASH, interval, number
from hybrid_rt_bench.results import statistics as stats

STRICT_NOTE = (
    "Wrong: false hits, false misses and wrong primitives together, a number of resolved rays "
    "[95 % upper bound of their share of the resolved rays; 3 / N if none of N was seen]."
)
BOUND_NOTES = (
    "If the march took no time: the speed-up without T(march) in it, the most that any march "
    "which resolves the same rays could reach.",
    "Break-even march time: the march at which the hybrid is as fast as Embree alone, (T(strongest "
    "Embree, every ray) - T(compaction) - T(fallback) - T(merge)) / rays, of the same runs. Below "
    "0, Embree takes longer for the unresolved rays than for all of them: no march is fast enough.",
)
"""What `Pooled.free_march` and `Pooled.break_even_ns` are, under the tables that show them."""

SPEEDUP_NOTE = (
    "Speed-up: T(strongest Embree, every ray) / T(march + compaction + fallback + merge), run side "
    "by side; geometric mean over cells of the median over rounds [95 % bootstrap interval over "
    "rounds]."
)


def point_name(technique: str, point: str) -> str:
    """Return what one of the defaults is called; Embree has two."""
    return f"{technique}, {point}" if technique == EMBREE else technique


def full_name(technique: str, point: str, pooled: Pooled) -> str:
    """Return what a point is called among all the points of its technique."""
    if technique == EMBREE:
        return f"{technique}, {point}"
    chosen = bool(pooled.rows.default.iloc[0])
    return f"{technique}, {point}" + (" (default)" if chosen and point != "default" else "")


def share(pooled: Pooled) -> str:
    """Return alpha."""
    return f"{pooled.alpha:.3f}" if pooled.rays else DASH


def count_text(rate: Rate) -> str:
    """Return how many rays were counted, and the upper end of the interval of their rate."""
    return f"{rate.count:,} [at most {power(rate.high)}]" if rate.total else DASH


def speedup_text(speedup: stats.Estimate | None) -> str:
    """Return a speed-up with its interval."""
    return DASH if speedup is None else interval(speedup.value, speedup.low, speedup.high)


def pays(speedup: stats.Estimate | None) -> str:
    """Return on which side of 1 the interval of a speed-up lies."""
    if speedup is None:
        return DASH
    return "yes" if speedup.low > 1 else "no" if speedup.high < 1 else "break-even"


def power(value: float) -> str:
    """Return a small number with two digits and an exponent; zero and one as they are."""
    if value != value:
        return DASH
    return f"{value:.1e}" if 0 < value < 0.01 else number(value, 2)


def plain(name: str) -> str:
    """Return the name of a column or a workload in words."""
    return name.replace("_", " ")


def cells_text(rows: pd.DataFrame) -> str:
    """Return which cells rows are of, in words."""

    def listed(column: str) -> str:
        return ", ".join(str(value) for value in dict.fromkeys(rows[column]))

    cells: Any = rows[[*CELL]].drop_duplicates()
    sizes = dict.fromkeys(f"{w}x{h}" for w, h in zip(cells.width, cells.height, strict=True))
    count = f"{len(cells)} cell" + ("s" if len(cells) != 1 else "")
    text = f"{count}: {listed('scene')}; {listed('workload')} rays; {', '.join(sizes)}"
    if rows.groupby([*POINT]).size().nunique() > 1:
        text += "; not every row of the table is of all of them"
    return text
