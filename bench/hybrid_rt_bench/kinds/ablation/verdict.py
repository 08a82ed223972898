"""What a run of kind "ablation" comes to."""

from __future__ import annotations

from hybrid_rt_bench.judged.columns import POINT
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.judged.tables import shared
from hybrid_rt_bench.judged.verdict import (
    budget_words,
    capital,
    marching,
    quoted,
    resolves_words,
    speedup_words,
    strict_words,
    where,
)
from hybrid_rt_bench.kinds.ablation.tables import name_of
from hybrid_rt_bench.report.table import number
from hybrid_rt_bench.report.words import counted
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return what the default march takes, against its break-even, and which switch weighs most."""
    rows = marching(shared(run))
    found = {name_of(*key): pooled for key, pooled in pools(rows, POINT).items()}
    if not found:
        return f"No cell was timed. {strict_words(run.results)}".strip()
    (base, default), *others = found.items()
    said = [f"Over {where(run, rows)}, {_march(base, default, run)}"]
    times = {name: pooled.nanoseconds("march_ms") for name, pooled in others}
    factors = {
        name: time / default.nanoseconds("march_ms") for name, time in times.items() if time > 0
    }
    if factors:
        slow, fast = max(factors, key=factors.__getitem__), min(factors, key=factors.__getitem__)
        text = f"Of {counted(len(factors), 'other row')}, {quoted(slow)} marches the longest, "
        text += f"{number(factors[slow])} times as long"
        if fast != slow:
            text += f", and {quoted(fast)} the shortest, {number(factors[fast])} times"
        said.append(f"{text}.")
    return capital([*said, strict_words(run.results)])


def _march(name: str, pooled: Pooled, run: RunData) -> str:
    march, budget = pooled.nanoseconds("march_ms"), pooled.break_even_ns(run.samples)
    if march != march:
        return f"{quoted(name)}, the first row, was not timed."
    return (
        f"the march of {quoted(name)}, the first row, takes {number(march)} ns per ray and its "
        f"break-even march time is {budget_words(budget)}: it has "
        f"{speedup_words(pooled.speedup(run.samples))} over the strongest Embree and "
        f"{resolves_words(pooled)}."
    )
