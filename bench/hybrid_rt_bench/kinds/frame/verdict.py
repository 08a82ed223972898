"""What a run of kind "frame" comes to."""

from __future__ import annotations

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.kinds.frame.columns import WRONG
from hybrid_rt_bench.report.table import number, rate_words
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return which technique answers most rays of each kind, and how often it is wrong."""
    said = []
    for workload, rows in run.results.groupby("workload", sort=False):
        row = rows.iloc[int(rows.alpha.to_numpy().argmax())]
        kind = str(workload).replace("_", " ")
        words = f"Of {int(row.rays):,} {kind} rays of {run.meta['frame']['file']}"
        if not row.resolved:
            said.append(f"{words} no technique resolves one.")
            continue
        words += f" {row.technique} resolves most, {number(100 * row.alpha)} %"
        if row.judged:
            wrong = Rate.of(int(sum(row[name] for name in WRONG)), int(row.resolved))
            words += f"; of those resolved, it is wrong on {rate_words(wrong)}"
        said.append(words + ".")
    if not run.results.judged.all():
        said.append("Which answers are right cannot be told without a mesh.")
    return " ".join(said)
