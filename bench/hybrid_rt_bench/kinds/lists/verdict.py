"""What a run of kind "lists" comes to."""

from __future__ import annotations

import numpy as np

from hybrid_rt_bench.judged.pooling import Pooled
from hybrid_rt_bench.judged.tables import shared
from hybrid_rt_bench.judged.verdict import (
    by_point,
    capital,
    marching,
    speedup_words,
    speedups,
    strict_words,
    where,
)
from hybrid_rt_bench.report.table import number
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return what longer lists answer, what they take, and which length is the fastest."""
    rows = marching(shared(run))
    found = by_point(rows)
    if not found:
        return f"No cell was timed. {strict_words(run.results)}".strip()
    order = sorted(found, key=lambda name: np.nan_to_num(found[name].mean("lists_mib")))
    first, last = order[0], order[-1]
    said = [f"Over {where(run, rows)}, {first} resolves {_what(found[first])}"]
    if first != last:
        said[0] += f", {last} resolves {_what(found[last])}."
    else:
        said[0] += "."
    every = speedups(found, run.samples)
    if every:
        fastest = max(every, key=lambda name: every[name].value)
        of = f"The fastest of {len(every)} is {fastest}" if len(every) > 1 else fastest
        said.append(f"{of}: {speedup_words(every[fastest])} over the strongest Embree.")
    said.append(strict_words(run.results))
    return capital(said)


def _what(pooled: Pooled) -> str:
    text = f"{number(100 * pooled.alpha)} % of the rays"
    size = pooled.mean("lists_mib")
    if size > 0:
        text += f" with lists of {number(size)} MiB per view"
    return f"{text}, {number(pooled.mean('prepare_ms'))} ms per view to prepare"
