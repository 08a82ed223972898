"""What of the results of kind "frame" is compared between runs: it times nothing."""

from __future__ import annotations

from hybrid_rt_bench.kinds.frame.columns import WRONG
from hybrid_rt_bench.results.compared import Compared

COMPARED = Compared(
    exact=("rays", "resolved", "hits", *WRONG, "wrong_primitive", "steps"),
    names=("technique",),
)
