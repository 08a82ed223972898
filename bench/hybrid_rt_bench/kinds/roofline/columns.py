"""The columns of the results of kind "roofline"."""

from __future__ import annotations

from hybrid_rt_bench.kinds.roofline.reckon import RASTER, STAGES, STRUCTURES
from hybrid_rt_bench.results.schema import VIEW, Column, Schema, count, estimate, text

WORK = {
    "lanes": "Lanes of a vector",
    "step_vectors": "Vectors of steps",
    "steps": "Steps, which read the pyramid",
    "passes": "Pixels left after they were looked at",
    "refills": "Lanes that were given a ray to walk",
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
                ("gathered", "numbers gathered, of all rays", ""),
                ("places", "places gathered from, of all rays", ""),
            )
        ),
        count("touched_bytes", "Bytes read and written, of all rays", unit="bytes"),
        count("threads", "Threads of all stages"),
        *(
            column
            for name in (*STAGES, "budget")
            for column in estimate(f"{name}_ns", f"Median time a ray: {name}", "ns", "lower")
        ),
        *(
            column
            for name in TIMED_MS
            for column in estimate(f"{name}_ms", f"Median time: {name}", "ms", "lower")
        ),
        *estimate("raster_speedup", "Embree's primary rays over the raster", "", "higher"),
        *estimate("vectors_speedup", "March without vectors over the march", "", "higher"),
        *estimate("speedup", "Embree for all rays over the hybrid", "", "higher"),
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
