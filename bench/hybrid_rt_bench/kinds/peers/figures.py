"""The figure of a run of kind "peers"."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from hybrid_rt_bench.kinds.peers import tables
from hybrid_rt_bench.report.style import BLUE, GREY, ORANGE, footer, save_all
from hybrid_rt_bench.report.table import number
from hybrid_rt_bench.results.folder import RunData

LOOKS = (("mirror", BLUE, "o"), ("primary", ORANGE, "s"))
"""The workloads of rays, with their colour and marker."""


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write the figure of the run into `folder`."""
    if tables.ok(tables.traced(run)).empty:
        return []
    return save_all(run, folder, [("rays-by-program", rates)])


def rates(run: RunData) -> Figure:
    """Return Mrays/s of every peer, a panel a scene."""
    traced = tables.traced(run)
    names = [str(name) for name in dict.fromkeys(traced.technique)]
    scenes = list(tables.by_scene(traced))
    figure = Figure(figsize=(2.2 + 4.2 * len(scenes), 1.5 + 0.42 * len(names)))
    first = None
    for k, (scene, part) in enumerate(scenes):
        ax = figure.add_subplot(1, len(scenes), k + 1, sharey=first, sharex=first)
        first = first or ax
        for shift, (workload, colour, marker) in zip((-0.16, 0.16), LOOKS, strict=True):
            for y, name in enumerate(names):
                rows = part[part.technique == name]
                value = tables.rate(tables.ok(rows[rows.workload == workload]))
                if np.isfinite(value):
                    ax.plot(value, y + shift, marker, color=colour, ms=6.5, zorder=3)
                    ax.annotate(
                        number(value), (value, y + shift), xytext=(6, 0), va="center",
                        textcoords="offset points", fontsize=8, color=colour, zorder=4,
                        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
                    )  # fmt: skip
        for y, name in enumerate(names):
            if tables.ok(part[part.technique == name]).empty:
                ax.text(
                    0.02, y, "not run", color=GREY, fontsize=8, va="center",
                    transform=ax.get_yaxis_transform(),
                )  # fmt: skip
        strongest = tables.rate(
            tables.ok(part[(part.technique == names[0]) & (part.workload == "mirror")])
        )
        if np.isfinite(strongest):
            ax.axvline(strongest, color=BLUE, lw=0.9, ls="--", zorder=1)
        ax.set(title=tables.scene_label(run, scene), xscale="log", xlabel="Mrays/s")
        ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_yticks(range(len(names)), [_named(run, traced, name) for name in names])
        ax.tick_params(axis="y", length=0, labelleft=k == 0)
    assert first is not None
    first.set_ylim(len(names) - 0.5, -0.5)
    low, high = first.get_xlim()
    first.set_xlim(low, 2.5 * high)  # room for the last number
    handles = [
        mpl.lines.Line2D([], [], color=colour, marker=marker, ls="", label=f"{workload} rays")
        for workload, colour, marker in LOOKS
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=2)
    footer(figure, f"Dashed: {names[0]}, mirror rays. {tables.views_text(run)}; 1 t, 2 t: threads.")
    return figure


def _named(run: RunData, traced: pd.DataFrame, name: str) -> str:
    done = tables.ok(traced[traced.technique == name])
    return f"{name}, {int(done.threads.iloc[0])} t" if len(done) else name
