"""What a run of kind "paper" comes to."""

from __future__ import annotations

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.paper.tables import of_technique, samples_of, scenes, techniques
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import interval, number, rate_words
from hybrid_rt_bench.report.words import MOST_NAMED, counted, how_many, listed, named
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return what each technique answers, how often it is wrong, and what it is worth."""
    every = techniques(run)
    measured = {technique: _mean(run, technique) for technique in every}
    views = run.results[["scene", "camera", "width", "height"]].drop_duplicates()
    which = named([scene_name(run, scene) for scene in scenes(run)], "scene")
    said = [f"Of the mirror rays of {counted(len(views), 'view')} of {which}:"]
    shown = every
    if len(every) > MOST_NAMED:
        rated = [technique for technique in every if _wrong(run, technique).total]
        right = min(rated, key=lambda technique: _wrong(run, technique).value, default=every[0])
        fast = max(every, key=lambda technique: measured[technique].value)
        shown = list(dict.fromkeys([fast, right]))
        best = f"{fast} is the fastest of {len(every)} techniques"
        said.append(f"{best}, {right} the least often wrong;")
    said.append("; ".join(_of(run, technique, measured[technique]) for technique in shown) + ".")
    paying = [technique for technique in every if measured[technique].low > 1]
    losing = [technique for technique in every if measured[technique].high < 1]
    said.append(
        f"Over all views, marching before tracing pays (interval above 1) for "
        f"{how_many(paying, len(every), 'technique')} and costs time (interval below 1) for "
        f"{how_many(losing, len(every), 'technique')}."
    )
    return " ".join([*said, *_scenes(run)])


def _of(run: RunData, technique: str, measured: stats.Estimate) -> str:
    rows = of_technique(run.results, technique)
    rays, resolved = int(rows.rays.sum()), int(rows.resolved.sum())
    estimated = _mean(run, technique, estimated=True)
    return (
        f"technique {technique} answers {number(100 * resolved / max(1, rays))} % and is wrong on "
        f"{rate_words(_wrong(run, technique))}; where the paper's formula estimates a speed-up of "
        f"{_text(estimated)} over tracing every ray with the strongest Embree, the measured one is "
        f"{_text(measured)}"
    )


def _wrong(run: RunData, technique: str) -> Rate:
    rows = of_technique(run.results, technique)
    return Rate.of(int(rows.wrong_count.sum()), int(rows.rays.sum()))


def _mean(
    run: RunData, technique: str, *, estimated: bool = False, scene: str | None = None
) -> stats.Estimate:
    """Return the mean speed-up of a technique, over all views or those of a scene."""
    ratios = [
        summary.estimated_speedup(samples, row.alpha)
        if estimated
        else summary.measured_speedup(samples)
        for row, samples in samples_of(run, technique)
        if scene in (None, row.scene)
    ]
    return stats.geometric_mean_of_medians(ratios)


def _scenes(run: RunData) -> list[str]:
    """Return between which scenes the measured speed-ups lie, of each technique."""
    if len(scenes(run)) < 2:
        return []
    parts = []
    for technique in techniques(run)[:MOST_NAMED]:
        found = {
            scene: _mean(run, technique, scene=scene).value
            for scene in dict.fromkeys(of_technique(run.results, technique).scene)
        }
        if len(found) > 1:
            low, high = (of(found, key=found.__getitem__) for of in (min, max))
            parts.append(
                f"of {technique} from {number(found[low])} ({scene_name(run, low)}) to "
                f"{number(found[high])} ({scene_name(run, high)})"
            )
    return [f"By scene the measured speed-up lies, {listed(parts)}."] if parts else []


def _text(estimate: stats.Estimate) -> str:
    return interval(estimate.value, estimate.low, estimate.high)
