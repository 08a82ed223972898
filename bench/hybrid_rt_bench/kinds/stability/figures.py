"""The figure of a run of kind "stability"."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from hybrid_rt_bench.kinds.stability.tables import by_case, entrants
from hybrid_rt_bench.report.looks import BLACK, GREY, ORANGE, YELLOW
from hybrid_rt_bench.report.style import columns_of, footer, save_all, wrapped
from hybrid_rt_bench.report.table import threads_text
from hybrid_rt_bench.results.folder import RunData

PASS = "#E4F1FA"
SHADES = LinearSegmentedColormap.from_list("wrong", [YELLOW, ORANGE, "#4A1500"])
"""From one wrong answer in a thousand to all: lighter to darker, whatever the colour vision."""


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write the figure of the run into `folder`."""
    return save_all(run, folder, [("stability", matrix)])


def matrix(run: RunData) -> Figure:
    """Return the cases over the techniques: the darker, the larger the share of wrong answers."""
    techniques = entrants(run)
    rows = list(by_case(run))
    figure = Figure(figsize=(max(6.4, 3.4 + 0.95 * len(techniques)), 2.2 + 0.21 * len(rows)))
    ax = figure.add_subplot()
    for y, (_, answers) in enumerate(rows):
        of = {str(row.technique): row for row in answers}
        for x, technique in enumerate(techniques):
            colour, text, ink, hatch = _shown(of.get(technique))
            edge = "#BBBBBB" if hatch else "white"
            ax.add_patch(Rectangle((x + 0.02, y + 0.06), 0.96, 0.88, facecolor=colour,
                                   edgecolor=edge, lw=0.6, hatch=hatch))  # fmt: skip
            ax.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=7.5, color=ink)
    ax.set(xlim=(0, len(techniques)), ylim=(len(rows), 0))
    ax.set_xticks(
        np.arange(len(techniques)) + 0.5, [wrapped(name, 0.9, 9) for name in techniques], fontsize=9
    )
    ax.set_yticks(np.arange(len(rows)) + 0.5, [case for case, _ in rows], fontsize=8)
    ax.xaxis.tick_top()
    ax.tick_params(length=0)
    ax.grid(visible=False)
    for side in ("left", "bottom"):
        ax.spines[side].set_visible(False)
    handles = [Patch(color=PASS, label="pass (–: no ray answered)")]
    for level, label in ((0.0, "wrong: 1 in 1000"), (0.5, "3 in 100"), (1.0, "all")):
        handles.append(Patch(color=to_hex(SHADES(level)), label=label))
    handles.append(Patch(color=BLACK, label="raised an error"))
    handles.append(Patch(fc="white", ec="#BBBBBB", hatch="////", lw=0.6, label="not measured"))
    labels = [str(handle.get_label()) for handle in handles]
    figure.legend(
        handles=handles, loc="outside upper center", fontsize=8, handlelength=1.2,
        ncols=columns_of(labels, figure.get_figwidth(), 8),
        title="Numbers: wrong answers; colour: their share of the answers given", title_fontsize=8,
    )  # fmt: skip
    machine = run.meta["environment"]
    cases = f"{len(rows)} case{'s' if len(rows) != 1 else ''}"
    footer(
        figure,
        f"{cases}, {int(sum(answers[0].rays for _, answers in rows)):,} rays for each technique; "
        f"{threads_text(machine['threads'])}; {machine['cpu']}.",
    )
    return figure


def _shown(row: Any) -> tuple[str, str, str, str]:
    """Return the colour, the text, its colour and the hatch of a cell; None is not measured."""
    if row is None:
        return "white", "", GREY, "////"
    if row.state == "error":
        return BLACK, "error", "white", ""
    answered = row.rays - row.unresolved
    if row.state == "pass":
        return PASS, "pass" if answered else "–", "#00527F" if answered else GREY, ""
    # From one in a thousand to all, by decades.
    decades = 1 + math.log10(max(row.wrong, 1) / max(answered, 1)) / 3
    share = min(max(decades, 0.0), 1.0)
    return to_hex(SHADES(share)), f"{row.wrong}", "white" if share > 0.45 else "black", ""
