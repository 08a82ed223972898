"""The tables of a run of kind "frame"."""

from __future__ import annotations

from typing import Any

import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.kinds.frame.columns import WRONG
from hybrid_rt_bench.report.table import DASH, Table, number, rate_text
from hybrid_rt_bench.results.folder import RunData


def tables(run: RunData) -> list[Table]:
    """Return the tables of the run, in the order of reading."""
    return [*(answers(run, str(name)) for name in dict.fromkeys(run.results.workload)), ended(run)]


def answers(run: RunData, workload: str) -> Table:
    """Return what each technique answers of one kind of rays and what of it is wrong."""
    rows = run.results[run.results.workload == workload]
    judged = bool(rows.judged.all())
    title = f"What the screen answers of {workload.replace('_', ' ')} rays"
    columns = ["", "alpha", "hits, % of rays", "misses, % of rays", "steps per ray"]
    if judged:
        columns += ["wrong, % of resolved rays", "wrong primitive, % of resolved rays"]
    table = Table(title, columns)
    for _, row in rows.iterrows():
        misses = row.resolved - row.hits
        cells = [
            str(row.technique),
            f"{row.alpha:.3f}",
            number(100 * row.hits / row.rays),
            number(100 * misses / row.rays),
            number(row.steps / row.rays),
        ]
        if judged:
            cells += [
                rate_text(Rate.of(int(sum(row[name] for name in WRONG)), int(row.resolved))),
                rate_text(Rate.of(int(row.wrong_primitive), int(row.resolved))),
            ]
        table.rows.append(cells)
    table.notes += [
        f"{int(rows.rays.iloc[0]):,} rays. Alpha: the share of rays that the screen answers.",
        _frame_words(run.meta["frame"]),
    ]
    if judged:
        table.notes.append(
            "Wrong: a false hit or a false miss, more than a pixel from what the mesh has. "
            "Wrong primitive: another triangle than the true one, within a pixel. [95 % interval, "
            "Clopper-Pearson; none seen among N rays: at most 3 / N]."
        )
    else:
        table.notes.append(
            "Without a mesh nobody can tell which answers are right: give --scene for that."
        )
    return table


def ended(run: RunData) -> Table:
    """Return how the marches of each technique ended, in per cent of its rays."""
    names = [str(name) for name in dict.fromkeys(run.verdicts.technique)]
    table = Table("How the marches ended, % of rays", ["", *names])
    for workload, part in run.verdicts.groupby("workload", sort=False):
        if run.results.workload.nunique() > 1:
            table.rows.append([str(workload)])
        counts: Any = part.pivot_table("count", "status", "technique", "sum", fill_value=0)
        shares = 100 * counts / counts.sum()
        for status, row in shares.iterrows():
            table.rows.append([str(status).lower(), *(_share(row, name) for name in names)])
    return table


def _share(row: pd.Series[Any], name: str) -> str:
    return number(float(row[name])) if name in row else DASH


def _frame_words(frame: dict[str, Any]) -> str:
    """Say what the depth buffer is and how sure it is."""
    read = ", ".join(f"{key} {value}" for key, value in frame["reading"].items())
    words = f"{frame['file']} ({frame['dtype']}{', ' if read else ''}{read}): "
    words += f"{100 * frame['covered']:.1f} % of the pixels covered"
    if frame["mesh"] is not None:
        words += f"; the mesh is {frame['mesh']}, and {frame['unmatched']} pixels are not as in it"
    elif frame["uncertain"]:
        words += f"; depth is within {frame['uncertainty']:.1g} of itself (median)"
    return words + "."
