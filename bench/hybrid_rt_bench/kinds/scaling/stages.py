"""The timed stages of experiments of kind "scaling", and what is made of their samples."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.schema import HYBRID_STAGES

SHARED = ""
"""The technique of a stage that belongs to none."""

STAGES: dict[str, str] = {
    "build": "Embree build",
    "raster": "raster",
    "rays": "mirror rays",
    "embree": "strongest Embree, every ray",
    "brute_force": "brute force, a sample",
    "prepare": "what the march reads",
    "march": "march",
    "compaction": "compaction",
    "fallback": "fallback",
    "merge": "merge",
    "hybrid": "hybrid: march to merge",
    "frame": "hybrid, raster and what it reads",
}
"""Every stage, those that are sums last, and what reports call it."""

A_RAY = ("rays", "embree", "brute_force", *HYBRID_STAGES, "hybrid", "frame")
"""The stages whose time is also told per ray."""

Key = tuple[str, str]
"""Technique and stage."""


def name_of(technique: str, stage: str) -> str:
    """Return what reports call a stage of a technique."""
    label = STAGES.get(stage, stage)
    return label if technique == SHARED else f"{label} ({technique})"


def ordered(keys: Iterable[Key]) -> list[Key]:
    """Return techniques in the order in which they come, and their stages in that of `STAGES`."""
    keys = list(dict.fromkeys(keys))
    techniques, stages = list(dict.fromkeys(key[0] for key in keys)), list(STAGES)
    return sorted(keys, key=lambda key: (techniques.index(key[0]), stages.index(key[1])))


def with_sums(
    seconds: dict[Key, NDArray[np.float64]], techniques: Iterable[str]
) -> dict[Key, NDArray[np.float64]]:
    """Return the seconds of each round with those of the hybrid and of the frame added.

    Parameters
    ----------
    seconds : dict of array
        For each measured round, by technique and stage.
    techniques : iterable of str
    """
    sums: dict[Key, NDArray[np.float64]] = {}
    for technique in techniques:
        hybrid = np.sum([seconds[technique, stage] for stage in HYBRID_STAGES], axis=0)
        made = seconds[SHARED, "raster"] + seconds[technique, "prepare"]
        sums[technique, "hybrid"], sums[technique, "frame"] = hybrid, hybrid + made
    return {**seconds, **sums}


def rows_of(
    seconds: dict[Key, NDArray[np.float64]], rays: dict[str, int], default_rays: int
) -> list[dict[str, Any]]:
    """Return a row of results for each stage: its median in milliseconds, and per ray.

    Parameters
    ----------
    seconds : dict of array
        As `with_sums` returns it.
    rays : dict of int
        For stages that have another number of rays than `default_rays`.
    default_rays : int
    """
    rows = []
    for technique, stage in ordered(seconds):
        ms = stats.median(1e3 * seconds[technique, stage])
        count = rays.get(stage, default_rays)
        rows.append(
            {
                "technique": technique,
                "stage": stage,
                "ms": ms.value,
                "ms_low": ms.low,
                "ms_high": ms.high,
                "ns_per_ray": 1e6 * ms.value / count if stage in A_RAY else float("nan"),
                "timed_rays": count if stage in A_RAY else 0,
                "rounds": ms.count,
            }
        )
    return rows


def unstable(seconds: dict[Key, NDArray[np.float64]]) -> dict[str, float]:
    """Return by how much those stages scatter that scatter too much and weigh in the whole."""
    whole = max(
        (float(np.median(x)) for (_, stage), x in seconds.items() if stage in ("hybrid", "embree")),
        default=0.0,
    )
    return {
        name_of(*key): stats.spread(x)
        for key, x in seconds.items()
        if stats.unstable(x) and float(np.median(x)) > 0.02 * whole
    }
