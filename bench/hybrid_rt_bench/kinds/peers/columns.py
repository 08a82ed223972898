"""The columns of the results of kind "peers"."""

from __future__ import annotations

from hybrid_rt_bench.results.schema import VIEW, Column, Schema, count, estimate, flag, text

TIMES = (
    *estimate("ms", "Median time", "ms", "lower"),
    Column("cores", "Cores that were busy, median", "cores"),
    *estimate("ratio", "Time per ray over that of the strongest Embree beside it", "", "lower"),
)
"""For the timings of a peer; NaN where it was not timed."""

AGREEMENT = (
    Column("same", "Share with the same primitive as ours, or none in both", better="higher"),
    count("different", "Rays or pixels that are not the same", better="lower"),
    Column("same_place", "Share with another primitive at the same distance"),
    Column("early", "Share with a hit before the ray's t_near"),
    *(
        Column(f"t_{end}", f"Relative difference of t, {end}", better="lower")
        for end in ("p99", "max")
    ),
    Column("only_here", "Share of pixels that only the peer covers", better="lower"),
    Column("only_ours", "Share of pixels that only our raster covers", better="lower"),
    *(
        Column(f"depth_{end}", f"Relative difference of depth, {end}", better="lower")
        for end in ("p50", "p99", "max")
    ),
)

_WHAT = (
    text("technique", "Name of the peer"),
    text("workload", "One of mirror, primary and raster"),
)

SCHEMA = Schema(
    keys=VIEW,
    results=(
        *_WHAT,
        text("state", "One of ok, absent and error"),
        text("reason", "Why it did not run; empty if it did"),
        count("threads", "Threads that it runs on; 0 if it does not"),
        Column(
            "build_seconds", "Time from the scene's arrays to the first answered ray", "s", "lower"
        ),
        Column("peak_mib", "Largest memory of its process less the scene's", "MiB", "lower"),
        flag("sampled", "Whether it is so slow that it gets only some of the rays"),
        text("label", "Which of its ways was taken"),
        count("rays", "Rays, or pixels"),
        Column("convert_ms", "Time of making its own arrays", "ms", "lower"),
        Column("first_ms", "Time of its first call", "ms", "lower"),
        Column("read_ms", "Time of reading a picture back", "ms", "lower"),
        *TIMES,
        *(Column(c.name, c.meaning, c.unit, c.better, optional=True) for c in AGREEMENT),
    ),
    samples=(
        *_WHAT,
        count("round", "Number of the round"),
        Column("seconds", "Time of the peer", "s", "lower"),
        Column("cpu_seconds", "Processor time of all its threads", "s"),
        Column("read_seconds", "Time of reading a picture back", "s", "lower"),
        Column("beside", "Time of the strongest Embree, or of our raster, beside it", "s"),
        count("beside_rays", "Rays, or pixels, of that"),
    ),
    meta=(
        Column("scenes", "The scenes that were loaded", type=list),
        Column("peers", "What each peer is, and its version", type=list),
    ),
)
