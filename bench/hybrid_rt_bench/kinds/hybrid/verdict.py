"""What a run of kind "hybrid" comes to."""

from __future__ import annotations

import pandas as pd

from hybrid_rt_bench.judged.columns import POINT
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.judged.text import pays
from hybrid_rt_bench.judged.verdict import (
    best_words,
    budget_words,
    by_technique,
    capital,
    marching,
    resolves_words,
    speedup_words,
    strict_words,
    where,
)
from hybrid_rt_bench.kinds.hybrid import tables
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import interval, number
from hybrid_rt_bench.report.words import how_many
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return the speed-up of the certified hybrid, where it pays, and what would be the most."""
    rows = tables.certified(run)
    if rows.empty:
        return _others(run)
    found = {tables.name_of(*key): pooled for key, pooled in pools(rows, POINT).items()}
    parts = [_speedup(name, pooled, run) for name, pooled in found.items()]
    said = [f"Over {where(run, rows)}, {'; '.join(parts)}."]
    best = max(found.items(), key=lambda item: _value(item[1], run.samples))
    said.append(_scenes(run, *best))
    free = best[1].free_march(run.samples)
    if free is not None:
        march, budget = best[1].nanoseconds("march_ms"), best[1].break_even_ns(run.samples)
        said.append(
            f"Its march takes {number(march)} ns per ray and its break-even march time is "
            f"{budget_words(budget)}; with a march that took no time the speed-up would be "
            f"{interval(free.value, free.low, free.high)}."
        )
    return capital([*said, strict_words(run.results)])


def _speedup(name: str, pooled: Pooled, run: RunData) -> str:
    speedup = pooled.speedup(run.samples)
    if speedup is None:
        return f"{name} was not timed"
    worth = f"{speedup_words(speedup)} over the strongest Embree"
    return f"{name} has {worth} and {resolves_words(pooled)}"


def _scenes(run: RunData, name: str, pooled: Pooled) -> str:
    parts = {scene: part.speedup(run.samples) for (scene,), part in
             pools(pooled.rows, ["scene"]).items()}  # fmt: skip
    known = {scene: speedup for scene, speedup in parts.items() if speedup is not None}
    if not known:
        return ""
    paying = [scene_name(run, s) for s, speedup in known.items() if pays(speedup) == "yes"]
    text = f"It pays (interval above 1) on {how_many(paying, len(known), 'scene')}"
    if len(known) > 1:
        low, high = (of(known, key=lambda s: known[s].value) for of in (min, max))
        text += f", from {number(known[low].value)} on {scene_name(run, low)}"
        text += f" to {number(known[high].value)} on {scene_name(run, high)}"
    return f"{text}, as {name}." if len(tables.certified(run)["point"].unique()) > 1 else f"{text}."


def _value(pooled: Pooled, samples: pd.DataFrame) -> float:
    speedup = pooled.speedup(samples)
    return -1.0 if speedup is None else speedup.value


def _others(run: RunData) -> str:
    """Return what is to be said of a run without the certified march."""
    rows = marching(run.results[run.results.timed])
    if rows.empty:
        return "No cell was timed with technique certified."
    first, *others = best_words(by_technique(rows), run.samples)
    said = ["Technique certified was not timed.", f"Over {where(run, rows)}, {first}", *others]
    return capital(said)
