"""The paragraph that a run begins with: what a reader takes home."""

from __future__ import annotations

from collections.abc import Callable

from hybrid_rt_bench.report.scenes import scene_notes
from hybrid_rt_bench.report.words import counted
from hybrid_rt_bench.results.folder import RunData

Verdict = Callable[[RunData], str]


def paragraph(run: RunData, verdict: Verdict) -> str:
    """Return what a kind says of a run, and what is to be known of any run.

    Parameters
    ----------
    run : RunData
    verdict : callable
        Returns the sentences of the run's kind.
    """
    said = [verdict(run)]
    failed = sum(cell["state"] == "failed" for cell in run.meta["cells"])
    if failed:
        cells = counted(len(run.meta["cells"]), "cell")
        said.append(f"{failed} of {cells} failed and are not in this.")
    if not run.meta["finished"]:
        said.append("The run did not finish: this is of the cells that it reached.")
    said += scene_notes(run)
    return " ".join(part for part in said if part)
