"""What of the results of kinds that judge is compared between runs."""

from __future__ import annotations

from hybrid_rt_bench.judged.columns import EMBREE, POINT, T_ERRORS, VERDICTS
from hybrid_rt_bench.results.compared import Compared, Timing
from hybrid_rt_bench.results.schema import HYBRID_STAGES

COMPARED = Compared(
    exact=(
        "rays", "resolved", *VERDICTS, *(f"all_{name}" for name in VERDICTS), "alpha", *T_ERRORS,
        "steps", "prepare_mib", "lists_mib", "tests", "flip", "rmse",
    ),
    names=POINT,
    timings=(
        Timing("hybrid", baseline="embree"),
        *(Timing(stage, baseline="embree") for stage in HYBRID_STAGES),
        Timing("Embree", ("embree",), of=()),
    ),
    chosen=("embree_path",),
    loose=(("technique", EMBREE),),
)  # fmt: skip
