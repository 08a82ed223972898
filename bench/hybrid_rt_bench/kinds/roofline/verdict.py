"""What a run of kind "roofline" comes to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from hybrid_rt_bench.kinds.roofline.reckon import near_gathers_ns
from hybrid_rt_bench.kinds.roofline.tables import view
from hybrid_rt_bench.report.table import interval, number, threads_text
from hybrid_rt_bench.report.words import counted, how_many
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return in how many views the march stays below its break-even time, and what stops it."""
    said = []
    for threads, rows in run.results.groupby("threads"):
        said += _of(run, threads_text(int(str(threads))), rows)
    return " ".join(said)


def _of(run: RunData, threads: str, rows: pd.DataFrame) -> list[str]:
    names = [view(run, row) for _, row in rows.iterrows()]
    below = rows.march_ns < rows.budget_ns
    wins = [name for name, won in zip(names, below, strict=True) if won]
    said = [
        f"With {threads}, the certified march takes {_range(rows.march_ns)} ns per ray over "
        f"{counted(len(rows), 'view')} and its break-even march time is {_range(rows.budget_ns)} "
        f"ns: the march is below it in {how_many(wins, len(names), 'view')}."
    ]
    some = rows[rows.budget_ns > 0]
    if len(some) < len(rows):
        said.append(
            f"In {counted(len(rows) - len(some), 'view')} no march is fast enough: Embree takes as "
            "long for the unresolved rays as for all of them."
        )
    if len(some):
        each: list[Any] = [row for _, row in some.iterrows()]
        near = np.array([near_gathers_ns(run.meta["rates"], row) for row in each])
        budget = some.budget_ns.to_numpy()
        said.append(
            f"Its set-up alone takes {_range(some.start_ns / budget)} times the break-even time, "
            "and its gathers, at the machine's fastest rate, "
            f"{_range(pd.Series(near / budget))} times."
        )
    if rows.speedup.isna().all():
        return said
    best: Any = rows.sort_values("speedup", kind="stable", na_position="first").iloc[-1]
    said.append(
        "The largest measured speed-up over the strongest Embree is "
        f"{interval(best.speedup, best.speedup_low, best.speedup_high)}, in {view(run, best)}."
    )
    return said


def _range(values: pd.Series) -> str:
    low, high = number(float(values.min())), number(float(values.max()))
    return low if low == high else f"{low} to {high}"
