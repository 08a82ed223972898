"""What of the results of kind "paper" is compared between runs."""

from __future__ import annotations

from hybrid_rt_bench.kinds.paper.columns import RATES
from hybrid_rt_bench.results.compared import Compared, Timing
from hybrid_rt_bench.results.schema import HYBRID_STAGES

COMPARED = Compared(
    exact=(
        "rays", "resolved", "alpha", *(f"{name}_count" for name in RATES), "error_t_p50",
        "error_t_p99", "error_px_p50", "error_px_p99", "steps_per_ray",
    ),
    timings=(
        Timing("hybrid", HYBRID_STAGES, "embree"),
        *(Timing(stage, baseline="embree") for stage in (*HYBRID_STAGES, "pyramid")),
        Timing("raster", baseline="embree_primary", of=()),
        Timing("mirror rays", ("rays",), "embree", of=()),
        Timing("Embree, mirror rays", ("embree",), of=()),
        Timing("Embree, primary rays", ("embree_primary",), of=()),
    ),
    stage="stage",
    chosen=("embree_path", "embree_primary_path"),
)  # fmt: skip
