"""The tables of a run of kind "stability"."""

from __future__ import annotations

import json
from typing import Any

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.report.table import ABSENT, Table, number, rate_text
from hybrid_rt_bench.results.folder import RunData

COUNTS = ("false_hit", "false_miss", "wrong_primitive", "imprecise", "false_free")


def tables(run: RunData) -> list[Table]:
    """Return every table of the run, in the order of reading."""
    made = [summary(run), verdicts(run), unresolved(run), offenders(run), what_goes_wrong(run)]
    return [table for table in made if table.rows]


def summary(run: RunData) -> Table:
    """Return one row a technique: cases passed, and the sums over all cases."""
    table = Table(
        "The hard set, summed over its cases",
        ["", "cases passed", "no answers, cases", "rays", "resolved, % of rays",
         "false hits and misses, % of resolved rays", "false hit", "false miss", "wrong primitive",
         "imprecise t", "tie"],
    )  # fmt: skip
    for technique, rows in run.results.groupby("technique", sort=False):
        rays, resolved = rows.rays.sum(), (rows.rays - rows.unresolved).sum()
        table.rows.append(
            [
                f"{technique}, exact" if rows.exact.all() else str(technique),
                f"{(rows.state == 'pass').sum()} of {len(rows)}",
                str((rows.unresolved == rows.rays).sum()),
                f"{rays:,}",
                number(100 * resolved / rays),
                rate_text(Rate.of(int((rows.false_hit + rows.false_miss).sum()), int(resolved))),
                *(f"{rows[kind].sum():,}" for kind in (*COUNTS[:4], "tie")),
            ]
        )
    table.notes += [
        "A case is passed if none of the rays that a technique answers is a false hit (more than a "
        "pixel from the truth) or a false miss. No answers: cases of which it answers no ray. "
        "[95 % interval; none seen among N rays: at most 3 / N].",
        "Exact: held to the right primitive and to t as float32 can know it as well, and to proven "
        "hand-over distances.",
    ]
    return table


def verdicts(run: RunData) -> Table:
    """Return pass or fail for each case and technique."""
    table = Table("Which cases each technique passes", ["", *entrants(run)])
    for case, rows in by_case(run):
        verdicts = {row.technique: _verdict(row) for row in rows}
        table.rows.append([case, *(verdicts.get(name, ABSENT) for name in entrants(run))])
    table.notes.append(
        "FAIL: wrong answers / resolved rays. Pass (none): no ray was resolved. The first wrong "
        "rays are in results.csv."
    )
    return table


def unresolved(run: RunData) -> Table:
    """Return the share of rays without an answer for each case and technique that marches."""
    marching = [name for name in entrants(run) if not name.startswith("embree")]
    table = Table("Unresolved rays, % of the rays of a case", ["", *marching], detail=True)
    for case, rows in by_case(run):
        shares = {row.technique: f"{100 * row.unresolved / row.rays:.1f}" for row in rows}
        table.rows.append([case, *(shares.get(name, ABSENT) for name in marching)])
    return table


def offenders(run: RunData) -> Table:
    """Return the first wrong rays of those that are held to exact answers."""
    table = Table(
        "First wrong rays of what is held to exact answers",
        ["", "by", "error", "rays"],
        detail=True,
    )
    for row in run.results[run.results.exact & (run.results.state != "pass")].itertuples():
        for kind, rays in json.loads(str(row.first)).items():
            named = ", ".join(str(ray) for ray in rays)
            table.rows.append([str(row.case), str(row.technique), kind.replace("_", " "), named])
    table.notes.append(
        "Of case.rays, with case = hybrid_rt_scenes.hard_cases.get_hard_case(name).build()."
    )
    return table


def what_goes_wrong(run: RunData) -> Table:
    """Return what each case is about."""
    table = Table(
        "The cases", ["", "rays", "triangles", "hits", "ambiguous in float32", "what goes wrong"],
        detail=True, sentences=True,
    )  # fmt: skip
    for cell in run.meta["cells"]:
        if cell["state"] == "measured":
            counts = [f"{cell[k]:,}" for k in ("rays", "triangles", "hits", "ambiguous")]
            table.rows.append([cell["case"], *counts, cell["what_goes_wrong"]])
    return table


def _verdict(row: Any) -> str:
    if row.state == "error":
        return "error"
    answered = row.rays - row.unresolved
    if row.state == "pass":
        return "pass" if answered else "pass (none)"
    return f"FAIL {row.wrong}/{answered}"


def entrants(run: RunData) -> list[str]:
    """Return the names of the techniques and tracers, in the order of their rows."""
    return [str(name) for name in dict.fromkeys(run.results.technique)]


def by_case(run: RunData) -> list[tuple[str, list[Any]]]:
    """Return the rows of each case, in the order of `entrants`."""
    names = entrants(run)
    return [
        (str(case), sorted(rows.itertuples(index=False), key=lambda r: names.index(r.technique)))
        for case, rows in run.results.groupby("case", sort=False)
    ]
