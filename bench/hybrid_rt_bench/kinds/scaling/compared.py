"""What of the results of kind "scaling" is compared between runs.

Two cells are the same if they are one view with as many triangles and threads, whatever the series
and the experiments were called.
"""

from __future__ import annotations

from hybrid_rt_bench.kinds.scaling.stages import STAGES
from hybrid_rt_bench.results.compared import Compared, Timing
from hybrid_rt_bench.results.schema import HYBRID_STAGES

_SHARED = ("build", "raster", "rays", "brute_force")

COMPARED = Compared(
    exact=("rays", "alpha", "steps_per_ray"),
    names=("technique",),
    cell=("axis", "scene", "camera", "width", "height", "triangles", "threads"),
    timings=(
        Timing("hybrid", HYBRID_STAGES, "embree"),
        *(Timing(stage, baseline="embree") for stage in (*HYBRID_STAGES, "prepare")),
        *(Timing(STAGES[stage], (stage,), "embree", of=()) for stage in _SHARED),
        Timing(STAGES["embree"], ("embree",), of=()),
    ),
    stage="stage",
    chosen=("embree_path",),
)
