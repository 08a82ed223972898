"""From the raw samples of a cell to one row of results."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt_bench.kinds.paper.columns import STAGES
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.schema import HYBRID_STAGES

Samples = dict[str, NDArray[np.float64]]
"""Seconds for each measured round, by stage."""


def hybrid_seconds(samples: Samples) -> NDArray[np.float64]:
    """Return T_march + T_compaction + T_fallback + T_merge of each round."""
    return np.asarray(sum(samples[stage] for stage in HYBRID_STAGES))


def estimated_speedup(samples: Samples, alpha: float) -> NDArray[np.float64]:
    """Return T_rt / (T_ssrm + (1 - alpha) T_rt) of each round: the paper's formula."""
    rt, ssrm = samples["embree"], samples["march"]
    return rt / (ssrm + (1.0 - alpha) * rt)


def measured_speedup(samples: Samples, *, with_pyramid: bool = False) -> NDArray[np.float64]:
    """Return T_rt / T_hybrid of each round, the pyramid's time added to the hybrid or not."""
    hybrid = hybrid_seconds(samples)
    if with_pyramid:
        hybrid = hybrid + samples["pyramid"]
    return samples["embree"] / hybrid


def timing_columns(samples: Samples, alpha: float) -> dict[str, Any]:
    """Return the columns of a results row that come from timings.

    Times are medians in milliseconds with their interval, ratios are medians of the paired ratios.
    """
    row: dict[str, Any] = {}
    for stage in STAGES:
        _put(row, f"{stage}_ms", stats.median(1e3 * samples[stage]))
    _put(row, "hybrid_ms", stats.median(1e3 * hybrid_seconds(samples)))
    ratios = {
        "estimated": estimated_speedup(samples, alpha),
        "measured": measured_speedup(samples),
        "measured_with_pyramid": measured_speedup(samples, with_pyramid=True),
        "raster_over_embree": samples["raster"] / samples["embree_primary"],
        "pyramid_over_march": samples["pyramid"] / samples["march"],
    }
    for name, values in ratios.items():
        _put(row, name, stats.median(values))
    row["rounds"] = len(samples["march"])
    row["coverage_of_intervals"] = stats.median(samples["march"]).coverage
    return row


def unstable(samples: Samples) -> dict[str, float]:
    """Return, for every stage whose rounds scatter too much to be trusted, by how much.

    A stage that is less than a fiftieth of what it is a part of is left alone: its scatter is the
    clock's and the scheduler's, and it weighs nothing in a sum.
    """
    whole = float(np.median(hybrid_seconds(samples)))
    return {
        label: stats.spread(samples[stage])
        for stage, label in STAGES.items()
        if stats.unstable(samples[stage]) and float(np.median(samples[stage])) > 0.02 * whole
    }


def _put(row: dict[str, Any], name: str, estimate: stats.Estimate) -> None:
    row[name] = estimate.value
    row[f"{name}_low"] = estimate.low
    row[f"{name}_high"] = estimate.high
