"""What of the results of kind "peers" is compared between runs."""

from __future__ import annotations

from hybrid_rt_bench.kinds.peers.columns import AGREEMENT
from hybrid_rt_bench.results.compared import Compared, Timing

_TIME, _READ = (
    Timing(name, (part,), "beside", amount="rays", baseline_amount="beside_rays")
    for name, part in (("time", "seconds"), ("reading the picture", "read_seconds"))
)

COMPARED = Compared(
    exact=("state", "rays", *(column.name for column in AGREEMENT)),
    names=("technique", "workload"),
    timings=(_TIME, _READ, Timing("the baseline", ("beside",), of=("workload",))),
    chosen=("mirror_path", "primary_path"),
    loose=(("technique", "embree"), ("sampled", True)),
)
