"""What a run of kind "error" comes to."""

from __future__ import annotations

from hybrid_rt_bench.judged.tables import defaults, shared
from hybrid_rt_bench.judged.verdict import (
    best_words,
    by_technique,
    capital,
    marching,
    paying_words,
    strict_words,
    where,
)
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return which technique is the fastest, which is the least often wrong, and what pays."""
    rows = defaults(marching(shared(run)))
    if rows.empty:
        return f"No cell was timed. {strict_words(run.results)}".strip()
    first, *others = best_words(by_technique(rows), run.samples)
    said = [f"With default parameters, over {where(run, rows)}, {first}", *others]
    return capital([*said, paying_words(run), strict_words(run.results)])
