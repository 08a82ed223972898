"""The figure of a run of kind "peers"."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from hybrid_rt_bench.kinds.peers import tables
from hybrid_rt_bench.report.looks import BLUE, GREY, ORANGE
from hybrid_rt_bench.report.style import footer, legend, panels, save_all, title, told
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
    columns = min(2, len(scenes))
    lines = -(-len(scenes) // columns)
    figure = Figure(figsize=(2.6 + 4.2 * columns, 1.3 + (0.8 + 0.42 * len(names)) * lines))
    axes = panels(figure, len(scenes), columns, sharey=True, sharex=True)
    for ax, (scene, part) in zip(axes, scenes, strict=True):
        for shift, (workload, colour, marker) in zip((-0.18, 0.18), LOOKS, strict=True):
            for y, name in enumerate(names):
                rows = part[part.technique == name]
                value = tables.rate(tables.ok(rows[rows.workload == workload]))
                if np.isfinite(value):
                    ax.plot(value, y + shift, marker, color=colour, ms=6.5, zorder=3)
                    ax.annotate(
                        number(value), (value, y + shift), xytext=(6, 0), va="center",
                        textcoords="offset points", fontsize=8, color=colour, zorder=4,
                        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4},
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
        title(ax, tables.scene_label(run, scene), 3.9)
        ax.set_xscale("log")
        ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        if ax.get_subplotspec().is_first_col():  # type: ignore[union-attr]
            ax.set_yticks(range(len(names)), [_named(traced, name) for name in names])
        ax.tick_params(axis="y", length=0)
    for ax in axes[-columns:]:
        ax.set_xlabel("Mrays/s")
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    low, high = axes[0].get_xlim()
    axes[0].set_xlim(low, 2.5 * high)  # room for the last number
    handles = [Line2D([], [], color=colour, marker=marker, ls="") for _, colour, marker in LOOKS]
    legend(figure, handles, [f"{workload} rays" for workload, *_ in LOOKS])
    others = [str(name) for name in dict.fromkeys(run.results.technique) if name not in names]
    footer(
        figure,
        f"Dashed: {names[0]}, mirror rays. 1 t, 2 t: threads.",
        f"They trace no rays, see the tables: {', '.join(others)}." if others else "",
        told(run, traced.drop(columns="threads")),
    )
    return figure


def _named(traced: pd.DataFrame, name: str) -> str:
    done = tables.ok(traced[traced.technique == name])
    return f"{name}, {int(done.threads.iloc[0])} t" if len(done) else name
