"""The figure of a run of kind "stability"."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from hybrid_rt_bench.kinds.stability.tables import by_case, entrants
from hybrid_rt_bench.report.style import GREEN, GREY, ORANGE, save_all
from hybrid_rt_bench.results.folder import RunData


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write the figure of the run into `folder`."""
    return save_all(run, folder, [("stability", matrix)])


def matrix(run: RunData) -> Figure:
    """Return the cases over the techniques: the darker, the larger the share of wrong answers."""
    techniques = entrants(run)
    rows = list(by_case(run))
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


def _wrapped(names: list[str]) -> list[str]:
    return [name.replace(" ", "\n") for name in names]
