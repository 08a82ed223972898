"""What of the results of kind "stability" is compared between runs: it has no times."""

from __future__ import annotations

from hybrid_rt_bench.kinds.stability.columns import SCHEMA
from hybrid_rt_bench.results.compared import Compared

COMPARED = Compared(
    exact=tuple(c.name for c in SCHEMA.results if c.name not in ("technique", "first", "error"))
)
