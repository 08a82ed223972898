"""Say what is being compiled, and how much is left.

The first picture of a fresh installation compiles for a while. A program that shows its own
progress calls `on_compile`; else a line for each stage goes to the standard error. A warm cache is
silent.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

SWITCH = "HYBRID_RT_COMPILE_NOTES"
"""The environment variable that, set to 0, keeps the library from writing lines of its own."""

# Seconds that the functions of a stage take to compile, on one core of a server of 2023.
STAGES: dict[str, dict[str, float]] = {
    "the raster": {
        "raster.clip.transform_vertices": 0.3,
        "raster.cull.cull_and_count": 3.0,
        "raster.bins.prefix_sums": 0.3,
        "raster.records.fill_bins": 1.7,
        "raster.tiles.draw_tiles": 2.6,
    },
    "the depth pyramid": {"raster.pyramid.build": 0.4, "raster.pyramid.finish": 0.2},
    "the slope pyramid": {"raster.slope_pyramid.copy": 0.3, "raster.slope_pyramid.bound": 0.6},
    "secondary rays": {
        "secondary.surface.count_covered": 0.3,
        "secondary.surface.surface_rays": 1.5,
    },
    "the march of a technique": {"techniques.driver.march": 2.2},
    "the calls of Embree": {"trace.embree.intersect": 1.9, "trace.embree.occluded": 1.5},
    "the merge of answers": {
        "hybrid.count_unresolved": 0.3,
        "hybrid.list_unresolved": 0.3,
        "hybrid.hand_over": 0.3,
        "hybrid.answer_hits": 0.4,
        "hybrid.answer_occlusion": 0.2,
    },
    "lists of primitives": {
        "raster.lists_bins.box_vertices": 0.3,
        "raster.lists_bins.cull_and_count": 0.7,
        "raster.lists_bins.fill_bins": 0.3,
        "raster.lists.fill_lists": 3.0,
    },
    "the certified march": {"techniques.certified.lanes.march": 4.7},
    "the certified march, ray by ray": {"techniques.certified.scalar.march": 3.0},
    "the judge": {
        "judging.truth.nearest": 2.0,
        "judging.truth.touch": 1.0,
        "judging.truth.area": 0.3,
        "judging.truth.reach": 0.3,
        "judging.bvh.build": 0.8,
        "judging.bvh.corners": 0.2,
    },
}
_STAGE_OF = {name: stage for stage, names in STAGES.items() for name in names}
_SMALL = 1.0


@dataclass(frozen=True)
class Compiling:
    """What is being compiled.

    Attributes
    ----------
    function : str
        The kernel, such as "raster.tiles.draw_tiles".
    stage : str
        What it belongs to, such as "the raster".
    done, total : int
        How many functions of the stage are compiled, and how many it has.
    seconds_left : float
        About how long the rest of the stage takes, this function included.
    """

    function: str
    stage: str
    done: int
    total: int
    seconds_left: float


_done: set[str] = set()
_announced: set[str] = set()
_callback: Callable[[Compiling], Any] | None = None


def on_compile(callback: Callable[[Compiling], Any] | None) -> None:
    """Do what `hybrid_rt.compiling.on_compile` says."""
    global _callback
    _callback = callback


def begin(function: str) -> None:
    """Say that a function is about to be compiled."""
    stage = _STAGE_OF.get(function, function)
    costs = STAGES.get(stage, {function: 0.0})
    left = {name: cost for name, cost in costs.items() if name not in _done}
    now = Compiling(function, stage, len(costs) - len(left), len(costs), sum(left.values()))
    if _callback is not None:
        _callback(now)
    elif now.seconds_left > _SMALL and stage not in _announced and os.environ.get(SWITCH) != "0":
        _announced.add(stage)
        print(
            f"hybrid_rt: compiling {stage}: {len(left)} of {now.total} functions, "
            f"about {now.seconds_left:.0f} s, once on this machine",
            file=sys.stderr,
            flush=True,
        )


def end(function: str) -> None:
    """Say that a function has been compiled."""
    _done.add(function)
