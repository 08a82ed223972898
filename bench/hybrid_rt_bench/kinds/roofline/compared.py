"""What of the results of kind "roofline" is compared between runs."""

from __future__ import annotations

from hybrid_rt_bench.kinds.roofline.columns import WORK
from hybrid_rt_bench.kinds.roofline.reckon import RASTER, STRUCTURES
from hybrid_rt_bench.results.compared import Compared, Timing
from hybrid_rt_bench.results.schema import HYBRID_STAGES

COMPARED = Compared(
    exact=("rays", "alpha", *WORK, *(f"{name}_bytes" for name in STRUCTURES), "touched_bytes"),
    names=("threads",),
    timings=(
        Timing("certified hybrid", HYBRID_STAGES, "embree"),
        *(Timing(f"certified {stage}", (stage,), "embree") for stage in HYBRID_STAGES),
        Timing("certified march without vectors", ("scalar",), "embree"),
        Timing("certified march of one step", ("start",), "embree"),
        Timing("raster", baseline="primary"),
        *(Timing(f"raster, {stage}", (stage,), "primary") for stage in RASTER),
        Timing("Embree, mirror rays", ("embree",)),
        Timing("Embree, primary rays", ("primary",)),
    ),
    chosen=("path",),
)
