"""Sentences about runs that judge, for the verdicts of their kinds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import pandas as pd

from hybrid_rt_bench.judged.columns import EMBREE, POINT, STRICT, WRONG
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.judged.tables import common, defaults, timed
from hybrid_rt_bench.judged.text import pays, plain, power
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import interval, number, rate_words
from hybrid_rt_bench.report.words import MOST_NAMED, counted, how_many, listed, named
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData


def marching(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of all techniques but Embree."""
    return rows[rows["technique"] != EMBREE]


def by_technique(rows: pd.DataFrame) -> dict[str, Pooled]:
    """Return rows pooled by technique."""
    return {name: pooled for (name,), pooled in pools(rows, ["technique"]).items()}


def speedups(
    found: Mapping[str, Pooled], samples: pd.DataFrame
) -> dict[str, stats.Estimate]:  # fmt: skip
    """Return the measured speed-ups of what was timed."""
    every = {name: pooled.speedup(samples) for name, pooled in found.items()}
    return {name: speedup for name, speedup in every.items() if speedup is not None}


def where(run: RunData, rows: pd.DataFrame) -> str:
    """Return in words which cells rows are of."""
    scenes = named([scene_name(run, str(s)) for s in dict.fromkeys(rows["scene"])], "scene")
    workloads = [plain(str(w)) for w in dict.fromkeys(rows["workload"])]
    rays = f"{listed(workloads)} rays" if len(workloads) <= MOST_NAMED else "many kinds of rays"
    keys = ["scene", "camera", "width", "height", "workload", "seed"]
    return f"{counted(len(rows[keys].drop_duplicates()), 'cell')} ({scenes}; {rays})"


def speedup_words(speedup: stats.Estimate | None) -> str:
    """Return a speed-up over the strongest Embree with its interval."""
    if speedup is None:
        return "no measured speed-up"
    return f"a measured speed-up of {interval(speedup.value, speedup.low, speedup.high)}"


def resolves_words(pooled: Pooled) -> str:
    """Return how many of the rays are resolved."""
    return f"resolves {number(100 * pooled.alpha)} % of the rays"


def wrong_words(pooled: Pooled) -> str:
    """Return on how many of all rays answers are wrong, with the interval."""
    return f"is wrong on {rate_words(pooled.rate(WRONG, of_all=True))}"


def budget_words(nanoseconds: float) -> str:
    """Return a break-even march time."""
    if nanoseconds > 0:
        return f"{number(nanoseconds)} ns"
    return "below 0, so that no march is fast enough"


def strict_words(rows: pd.DataFrame, technique: str = "certified") -> str:
    """Return a sentence about all resolved rays of a technique, wrong in any sense or not."""
    mine = Pooled(rows[rows["technique"] == technique])
    if not mine.rays:
        return ""
    rate = mine.rate(STRICT)
    if not rate.total:
        return f"Technique {technique} resolves none of {mine.rays:,} rays."
    wrong = "none is" if not rate.count else "1 is" if rate.count == 1 else f"{rate.count:,} are"
    return (
        f"Of {rate.total:,} resolved rays of technique {technique}, over all cells and parameters, "
        f"{wrong} wrong [at most {power(rate.high)} of them]."
    )


def best_words(found: Mapping[str, Pooled], samples: pd.DataFrame) -> list[str]:
    """Return sentences about the fastest technique and about the one least often wrong."""
    every = speedups(found, samples)
    silent = [name for name, pooled in found.items() if not pooled.resolved]
    judged = [name for name, pooled in found.items() if pooled.resolved]
    fastest = max(every, key=lambda name: every[name].value) if every else None
    right = min(
        judged, key=lambda name: (found[name].rate(WRONG, of_all=True).value, -found[name].alpha),
        default=None,
    )  # fmt: skip
    said = []
    for name in dict.fromkeys(name for name in (fastest, right) if name is not None):
        is_what = [
            what
            for what, best in (("the fastest", fastest), ("the least often wrong", right))
            if name == best and len(found) > 1
        ]
        lead = f"technique {name} is {listed(is_what)}: it" if is_what else f"technique {name}"
        said.append(
            f"{lead} has {speedup_words(every.get(name))} over the strongest Embree, "
            f"{resolves_words(found[name])} and {wrong_words(found[name])}."
        )
    if silent:
        said.append(f"no ray is resolved by {listed(silent)}.")
    return said


def paying_words(run: RunData) -> str:
    """Return a sentence about which techniques pay for which rays."""
    rows = marching(defaults(timed(run)))
    said: dict[str, list[str]] = {}
    for (workload,), part in pools(rows, ["workload"]).items():
        found = speedups(by_technique(common(part.rows)), run.samples)
        if found:
            paying = [name for name, speedup in found.items() if pays(speedup) == "yes"]
            text = how_many(paying, len(found), "technique")
            said.setdefault(text, []).append(plain(workload))
    if not said:
        return ""
    parts = [f"{text} with {listed(workloads)} rays" for text, workloads in said.items()]
    return (
        f"A march in front of the strongest Embree pays (interval above 1) for {'; '.join(parts)}."
    )


def capital(sentences: Iterable[str]) -> str:
    """Return sentences as a paragraph, each with a capital letter; empty ones are left out."""
    return " ".join(text[0].upper() + text[1:] for text in sentences if text)


def quoted(name: str) -> str:
    """Return the name of a point as a sentence quotes it."""
    return f"'{name}'"


def by_point(rows: pd.DataFrame) -> dict[str, Pooled]:
    """Return rows pooled by technique and point, by what a sentence calls them."""
    return {f"{name} ({point})": pooled for (name, point), pooled in pools(rows, POINT).items()}
