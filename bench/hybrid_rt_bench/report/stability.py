"""The tables and the figure of a run of kind "stability"."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from hybrid_rt_bench.report.figures import GREEN, GREY, ORANGE, STYLE
from hybrid_rt_bench.report.table import Table, percent
from hybrid_rt_bench.results import RunData

COUNTS = ("false_hit", "false_miss", "wrong_primitive", "imprecise", "false_free")


def tables(run: RunData) -> list[Table]:
    """Return every table of the run, in the order of reading."""
    return [summary(run), verdicts(run), unresolved(run), offenders(run), what_goes_wrong(run)]


def summary(run: RunData) -> Table:
    """Return one row a technique: cases passed, and the sums over all cases."""
    table = Table(
        "The hard set, summed over its cases",
        ["", "cases passed", "no answers", "rays", "resolved", "tie", "false hit", "false miss",
         "wrong primitive", "imprecise t"],
    )  # fmt: skip
    for technique, rows in run.results.groupby("technique", sort=False):
        rays, resolved = rows.rays.sum(), (rows.rays - rows.unresolved).sum()
        table.rows.append(
            [
                f"{technique}, exact" if rows.exact.all() else str(technique),
                f"{(rows.state == 'pass').sum()} of {len(rows)}",
                str((rows.unresolved == rows.rays).sum()),
                f"{rays:,}",
                percent(resolved / rays),
                *(f"{rows[kind].sum():,}" for kind in ("tie", *COUNTS[:4])),
            ]
        )
    table.notes += [
        "A case is passed if none of the rays that a technique answers is a false hit (more than a "
        "pixel from the truth) or a false miss. No answers: cases of which it answers no ray.",
        "Exact: held to the right primitive and to t as float32 can know it as well, and to proven "
        "hand-over distances.",
    ]
    return table


def verdicts(run: RunData) -> Table:
    """Return pass or fail for each case and technique."""
    table = Table("Which cases each technique passes", ["", *_techniques(run)])
    for case, rows in _by_case(run):
        table.rows.append([case, *(_verdict(row) for row in rows)])
    table.notes.append("FAIL: wrong answers / answers given. The first wrong rays are in "
                       "results.csv.")  # fmt: skip
    return table


def unresolved(run: RunData) -> Table:
    """Return the share of rays without an answer for each case and technique that marches."""
    marching = [name for name in _techniques(run) if not name.startswith("embree")]
    table = Table("Share of rays left unresolved", ["", *marching], detail=True)
    for case, rows in _by_case(run):
        shares = {row.technique: row.unresolved / row.rays for row in rows}
        table.rows.append([case, *(f"{100 * shares[name]:.1f} %" for name in marching)])
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
        detail=True,
    )  # fmt: skip
    for cell in run.meta["cells"]:
        if cell["state"] == "measured":
            counts = [f"{cell[k]:,}" for k in ("rays", "triangles", "hits", "ambiguous")]
            table.rows.append([cell["case"], *counts, cell["what_goes_wrong"]])
    return table


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write the figure of the run into `folder`."""
    with mpl.rc_context(STYLE):
        figure = matrix(run)
        path = folder / "stability.png"
        figure.savefig(path)
    return [path]


def matrix(run: RunData) -> Figure:
    """Return the cases over the techniques: the darker, the larger the share of wrong answers."""
    techniques = _techniques(run)
    rows = list(_by_case(run))
    figure = Figure(figsize=(3.2 + 0.95 * len(techniques), 1.6 + 0.21 * len(rows)))
    ax = figure.add_subplot()
    shades = LinearSegmentedColormap.from_list("wrong", ["#FBE3D6", ORANGE, "#5A2200"])
    for y, (_, answers) in enumerate(rows):
        for x, row in enumerate(answers):
            answered = row.rays - row.unresolved
            # From one in a thousand to all, by decades.
            decades = 1 + math.log10(max(row.wrong, 1) / max(answered, 1)) / 3
            share = min(max(decades, 0.0), 1.0)
            colour = "#DDEFE7" if row.state == "pass" else shades(share)
            text, ink = f"{row.wrong}", "white" if share > 0.45 else "black"
            if row.state == "pass":
                text, ink = ("–" if answered == 0 else "pass"), GREY if answered == 0 else GREEN
            if row.state == "error":
                colour, text, ink = "black", "error", "white"
            ax.add_patch(Rectangle((x, y), 1, 1, facecolor=colour, edgecolor="white", lw=1.2))
            ax.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=7.5, color=ink)
    ax.set(xlim=(0, len(techniques)), ylim=(len(rows), 0))
    ax.set_xticks(np.arange(len(techniques)) + 0.5, _wrapped(techniques))
    ax.set_yticks(np.arange(len(rows)) + 0.5, [case for case, _ in rows], fontsize=8)
    ax.xaxis.tick_top()
    ax.tick_params(length=0)
    ax.grid(visible=False)
    for side in ("left", "bottom"):
        ax.spines[side].set_visible(False)
    handles = [Patch(color="#DDEFE7", label="pass (–: no ray answered)")]
    for level, label in ((0.0, "wrong: 1 in 1000"), (0.5, "3 in 100"), (1.0, "all")):
        handles.append(Patch(color=to_hex(shades(level)), label=label))
    figure.legend(
        handles=handles, loc="outside lower center", ncols=4, fontsize=8, handlelength=1.2,
        title="Numbers: wrong answers; colour: their share of the answers given",
        title_fontsize=8,
    )  # fmt: skip
    return figure


def _verdict(row: Any) -> str:
    if row.state == "error":
        return "error"
    answered = row.rays - row.unresolved
    if row.state == "pass":
        return "pass" if answered else "pass (none)"
    return f"FAIL {row.wrong}/{answered}"


def _wrapped(names: list[str]) -> list[str]:
    return [name.replace(" ", "\n") for name in names]


def _techniques(run: RunData) -> list[str]:
    return [str(name) for name in dict.fromkeys(run.results.technique)]


def _by_case(run: RunData) -> list[tuple[str, list[Any]]]:
    """Return the rows of each case, in the order of `_techniques`."""
    names = _techniques(run)
    return [
        (str(case), sorted(rows.itertuples(index=False), key=lambda r: names.index(r.technique)))
        for case, rows in run.results.groupby("case", sort=False)
    ]
