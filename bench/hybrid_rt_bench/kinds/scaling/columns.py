"""The columns of the results of kind "scaling"."""

from __future__ import annotations

from hybrid_rt_bench.results.schema import VIEW, Column, Schema, count, estimate, text

PLACE = (
    *VIEW,
    count("triangles", "Triangles of the scene"),
    count("threads", "Threads of all stages"),
    text("label", "Where the cell stands on its axis, in words"),
    text("axis", "One of triangles, pixels and threads"),
    count("rays", "Mirror rays"),
)
MEMORY = (
    count("peak_bytes", "Most memory of the cell's process; 0 if not known", unit="bytes",
          better="lower"),
    count("program_bytes", "Memory of the program alone", unit="bytes"),
    count("scene_bytes", "Memory of the scene as loaded", unit="bytes"),
)  # fmt: skip
_WHAT = (
    text("technique", "Name of the technique; empty for a stage that belongs to all"),
    text("stage", "Which stage"),
)

SCHEMA = Schema(
    keys=(
        text("series", "Name of the series"),
        count("x", "Where the cell stands on its axis"),
    ),
    results=(
        *PLACE,
        *_WHAT,
        *estimate("ms", "Median time", "ms", "lower"),
        Column("ns_per_ray", "Median time per ray", "ns", "lower"),
        count("timed_rays", "Rays that this is of; 0 for a stage that has none"),
        count("rounds", "Measured rounds"),
        *MEMORY,
        Column("alpha", "Share of rays that the screen answers", better="higher"),
        Column("steps_per_ray", "Samples of the screen per ray", better="lower"),
        text("embree_path", "Embree's strongest path"),
    ),
    samples=(
        *_WHAT,
        count("round", "Number of the round"),
        Column("seconds", "Time of the stage", "s", "lower"),
        text("phase", "Either warmup or measured"),
    ),
    cell=(
        *PLACE,
        *MEMORY,
        Column("peak_is_of_rounds", "Whether the peak is of the rounds alone", type=bool),
        text("embree_path", "Embree's strongest path"),
        Column(
            "compile_seconds", "Time of compiling, or of loading what was compiled", "s", "lower"
        ),
    ),
)
