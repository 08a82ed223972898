"""What a run of kind "paper" comes to."""

from __future__ import annotations

import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.paper.tables import VIEWS, common, of_technique, samples_of
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.style import ordered
from hybrid_rt_bench.report.table import interval, number, rate_words
from hybrid_rt_bench.report.words import MOST_NAMED, counted, how_many, listed, named
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return what each technique answers, how often it is wrong, and what it is worth."""
    rows = common(run.results)
    every = ordered(rows.technique)
    measured = {technique: _mean(run, rows, technique) for technique in every}
    which = named([scene_name(run, scene) for scene in ordered(rows.scene)], "scene")
    views = counted(len(rows[VIEWS].drop_duplicates()), "view")
    shown, lead = every, ""
    if len(every) > MOST_NAMED:
        rates = {technique: _wrong(rows, technique) for technique in every}
        rated = [technique for technique in every if rates[technique].total]
        right = min(rated, key=lambda technique: rates[technique].value, default=every[0])
        fast = max(every, key=lambda technique: measured[technique].value)
        shown = list(dict.fromkeys([fast, right]))
        lead = f" {fast} is the fastest of {len(every)} techniques, {right} the least often wrong."
    parts = [_of(run, rows, technique, measured[technique]) for technique in shown]
    paying = [technique for technique in every if measured[technique].low > 1]
    losing = [technique for technique in every if measured[technique].high < 1]
    said = [
        f"Measured are the mirror rays of {views} of {which}.{lead}",
        *parts,
        "Over all views, marching before tracing pays (interval above 1) for "
        f"{how_many(paying, len(every), 'technique')} and costs time (interval below 1) for "
        f"{how_many(losing, len(every), 'technique')}.",
        _scenes(run, rows),
    ]
    return " ".join(text for text in said if text)


def _of(run: RunData, every: pd.DataFrame, technique: str, measured: stats.Estimate) -> str:
    rows = of_technique(every, technique)
    rays, resolved = int(rows.rays.sum()), int(rows.resolved.sum())
    estimated = _mean(run, every, technique, estimated=True)
    return (
        f"Technique {technique} answers {number(100 * resolved / max(1, rays))} % of them and is "
        f"wrong on {rate_words(_wrong(every, technique))}; its speed-up over tracing every ray "
        f"with the strongest Embree is {_text(measured)} as measured, and {_text(estimated)} as "
        "the paper's formula estimates it."
    )


def _wrong(every: pd.DataFrame, technique: str) -> Rate:
    rows = of_technique(every, technique)
    return Rate.of(int(rows.wrong_count.sum()), int(rows.rays.sum()))


def _mean(
    run: RunData, rows: pd.DataFrame, technique: str, *, estimated: bool = False
) -> stats.Estimate:
    """Return the mean speed-up of a technique over the views of some rows."""
    ratios = [
        summary.estimated_speedup(samples, row.alpha)
        if estimated
        else summary.measured_speedup(samples)
        for row, samples in samples_of(run, technique, rows)
    ]
    return stats.geometric_mean_of_medians(ratios)


def _scenes(run: RunData, rows: pd.DataFrame) -> str:
    """Return between which scenes the measured speed-ups lie, of each technique."""
    names = ordered(rows.scene)
    if len(names) < 2:
        return ""
    parts = []
    for technique in ordered(rows.technique)[:MOST_NAMED]:
        found = {
            scene: _mean(run, rows[rows.scene == scene], technique).value
            for scene in ordered(of_technique(rows, technique).scene)
        }
        low, high = (of(found, key=found.__getitem__) for of in (min, max))
        parts.append(
            f"of {technique} from {number(found[low])} on {scene_name(run, low)} to "
            f"{number(found[high])} on {scene_name(run, high)}"
        )
    return f"By scene the measured speed-ups go {listed(parts)}."


def _text(estimate: stats.Estimate) -> str:
    return interval(estimate.value, estimate.low, estimate.high)
