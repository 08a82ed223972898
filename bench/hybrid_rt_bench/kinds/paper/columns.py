"""The columns of the results of kind "paper"."""

from __future__ import annotations

from hybrid_rt_bench.results.schema import (
    VIEW,
    Column,
    Schema,
    count,
    estimate,
    rate,
    text,
)

SHARED = ""
"""The technique of a sample that belongs to all."""

STAGES: dict[str, str] = {
    "raster": "raster",
    "pyramid": "depth pyramid",
    "rays": "mirror rays",
    "embree_primary": "Embree, primary rays",
    "embree": "Embree, mirror rays",
    "march": "march",
    "compaction": "compaction",
    "fallback": "fallback",
    "merge": "merge",
}
"""Every timed stage in the order of the pipeline, and what reports call it."""

PIXEL_CLASSES = {"background": 0, "right": 1, "unresolved": 2, "wrong": 3}
"""What the pixels of a stored picture say."""

RATES = {
    "wrong": "false hits and false misses, of all rays",
    "tie": "another primitive as near as the true one, of the resolved rays",
    "false_hit": "more than a pixel from the truth, or none there, of the resolved rays",
    "false_miss": "said to hit nothing and do, of the resolved rays",
    "wrong_primitive": "another triangle within a pixel of the truth, of the resolved rays",
    "reference_wrong": "robust Embree looked at and wrong, of the resolved rays",
    "pixel_error": "a hit claimed more than a pixel from the truth, of the resolved rays",
}

NO_FAULT = ("tie", "reference_wrong")
"""Rates that are no fault of a technique."""

RATIOS = {
    "estimated": "Speed-up by the paper's formula, T_rt / (T_march + (1 - alpha) T_rt)",
    "measured": "Speed-up measured, T_rt / T_hybrid",
    "measured_with_pyramid": "Speed-up measured, the pyramid's time added to the hybrid",
    "raster_over_embree": "Time of the raster over that of Embree's primary rays",
    "pyramid_over_march": "Time of the pyramid over that of the march",
}

SCHEMA = Schema(
    keys=VIEW,
    results=(
        text("technique", "Name of the technique"),
        count("rays", "Mirror rays"),
        count("resolved", "Rays that the screen answers", better="higher"),
        *estimate("alpha", "Share of rays that the screen answers", better="higher"),
        *(
            column
            for name, meaning in RATES.items()
            for column in rate(name, meaning, "" if name in NO_FAULT else "lower")
        ),
        *(
            Column(f"error_{of}_{end}", f"Error of {words} of claimed hits, {end}", unit, "lower")
            for of, words, unit in (("t", "t over the true t", ""), ("px", "the pixel", "pixels"))
            for end in ("p50", "p99")
        ),
        Column("steps_per_ray", "Samples of the screen per ray", better="lower"),
        *(
            column
            for stage, label in {**STAGES, "hybrid": "hybrid, its four stages"}.items()
            for column in estimate(f"{stage}_ms", f"Median time: {label}", "ms", "lower")
        ),
        *(
            column
            for name, meaning in RATIOS.items()
            for column in estimate(
                name, meaning, better="higher" if name.startswith(("est", "meas")) else "lower"
            )
        ),
        count("rounds", "Measured rounds"),
        Column("coverage_of_intervals", "Confidence that the intervals of times have, a share"),
        text("embree_path", "Embree's strongest path for the mirror rays"),
        text("embree_primary_path", "Embree's strongest path for the primary rays"),
    ),
    samples=(
        text("technique", "Name of the technique; empty for a stage that belongs to all"),
        text("stage", f"One of {', '.join(STAGES)}"),
        count("round", "Number of the round; below 0 for warm-up"),
        Column("seconds", "Time of the stage", "s", "lower"),
        text("phase", "Either warmup or measured"),
    ),
    verdicts=(
        text("technique", "Name of the technique"),
        text("status", "How the march ended"),
        text("verdict", "What the judge says"),
        count("count", "Rays"),
    ),
    meta=(Column("scenes", "The scenes that were loaded", type=list),),
)
