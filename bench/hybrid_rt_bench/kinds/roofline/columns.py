"""The columns of the results of kind "roofline"."""

from __future__ import annotations

from hybrid_rt_bench.kinds.roofline.reckon import RASTER, STAGES, STRUCTURES
from hybrid_rt_bench.results.schema import VIEW, Column, Schema, count, estimate, text

WORK = {
    "lanes": "Lanes of a vector",
    "step_vectors": "Vectors of steps",
    "steps": "Steps, which read the pyramid",
    "passes": "Pixels left after they were looked at",
    "refills": "Lanes that were given another ray to walk",
    "look_vectors": "Vectors of looks",
    "looks": "Pixels whose lists were looked at",
    "entry_vectors": "Vectors of entries",
    "entries": "Entries of lists that were read",
    "rests": "Lists that were gone through to their end",
    "plane_vectors": "Vectors of planes",
    "planes": "Planes of triangles that were read",
    "test_vectors": "Vectors of exact tests",
    "tests": "Exact tests",
}
BUSY = ("step", "look", "entry", "plane", "test")
"""The stages of the lanes."""

STAGE_WORDS = {
    "embree": "the strongest Embree, all rays",
    "march": "the march",
    "compaction": "the list of unresolved rays",
    "fallback": "the strongest Embree, unresolved rays",
    "merge": "the hits of the resolved rays",
    "scalar": "the march without vectors",
    "start": "a march of one step",
    "budget": "the break-even march time; below 0, no march is fast enough",
}
"""What is told in nanoseconds per ray."""

TIMED_MS = (*RASTER, "raster", "primary")

SCHEMA = Schema(
    keys=VIEW,
    results=(
        text("technique", "Name of the technique"),
        count("rays", "Mirror rays"),
        Column("alpha", "Share of rays that the screen answers", better="higher"),
        *(count(name, f"{meaning}, of all rays") for name, meaning in WORK.items()),
        *(
            Column(f"busy_{name}", f"Share of lanes at work in {name}s", "", "higher")
            for name in BUSY
        ),
        *(
            count(f"{name}_{end}", f"{name.capitalize()}: {meaning}", unit=unit)
            for name in STRUCTURES
            for end, meaning, unit in (
                ("bytes", "size of the working set", "bytes"),
                ("gathered", "32-bit elements gathered, of all rays", ""),
                ("places", "places gathered from, of all rays", ""),
            )
        ),
        count("touched_bytes", "Bytes read and written, of all rays", unit="bytes"),
        count("threads", "Threads of all stages"),
        *(
            column
            for name in STAGE_WORDS
            for column in estimate(
                f"{name}_ns",
                f"Median time per ray: {STAGE_WORDS[name]}",
                "ns",
                "higher" if name == "budget" else "lower",
            )
        ),
        *(
            column
            for name in TIMED_MS
            for column in estimate(f"{name}_ms", f"Median time: {name}", "ms", "lower")
        ),
        *estimate(
            "raster_speedup", "Time of Embree's primary rays over that of the raster", "", "higher"
        ),
        *estimate(
            "vectors_speedup",
            "Time of the march without vectors over that of the march",
            "",
            "higher",
        ),
        *estimate("speedup", "Time of Embree for all rays over that of the hybrid", "", "higher"),
    ),
    samples=(
        count("threads", "Threads of all stages"),
        count("round", "Number of the round"),
        *(Column(name, f"Time of {name}", "s", "lower") for name in (*STAGES, *TIMED_MS)),
    ),
    meta=(
        Column("scenes", "The scenes that were loaded", type=list),
        Column("rates", "How fast the machine gathers, by size and threads", type=list),
        Column("caches", "The caches of its first core", type=list),
    ),
)
