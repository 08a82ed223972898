"""The figures of a run of kind "roofline"."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from hybrid_rt_bench.kinds.roofline.reckon import STRUCTURES, far_gathers_ns, near_gathers_ns
from hybrid_rt_bench.kinds.roofline.tables import view
from hybrid_rt_bench.report.looks import AMBER, BLACK, BLUE, GREY, ORANGE, PURPLE, SKY, Look
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.style import (
    footer,
    legend,
    ordered,
    panels,
    save_all,
    title,
    told,
    wrapped,
)
from hybrid_rt_bench.report.table import number, threads_text
from hybrid_rt_bench.results.folder import RunData

LINES = (("gather", "-", "o"), ("chain", "--", "s"))
NAMES = {"gather": "independent", "chain": "each waits for the last"}
PARTS = (
    ("set-up, one step, write", Look(AMBER, "", "")),
    ("near gathers", Look(BLUE, "", "//")),
    ("more of far gathers", Look(SKY, "", "..")),
    ("all else", Look(GREY, "", "")),
)


def plots(run: RunData, folder: Path) -> list[Path]:
    """Write the figures of the run into `folder`."""
    return save_all(run, folder, [("gather-rate", gather_rate), ("march-budget", march_budget)])


def gather_rate(run: RunData) -> Figure:
    """Return the machine's rate over the size of the table, a panel a scene with its structures."""
    rates = pd.DataFrame(run.meta["rates"])
    counts = sorted(int(n) for n in rates.threads.unique())
    scenes = ordered(run.results.scene)
    columns = min(2, len(scenes))
    lines = -(-len(scenes) // columns)
    figure = Figure(figsize=(5.2 * columns + 0.8, 3.9 * lines + 1.2))
    axes = panels(figure, len(scenes), columns, sharex=True, sharey=True)
    for ax, scene in zip(axes, scenes, strict=True):
        for threads, colour in zip(counts, (BLUE, ORANGE), strict=False):
            for kind, style, marker in LINES:
                part = rates[(rates.kind == kind) & (rates.threads == threads)]
                ax.plot(
                    part.bytes / 1024, 1 / part.ns_element, style, color=colour, marker=marker,
                    ms=4.5, label=f"{threads_text(threads)}, {NAMES[kind]}",
                )  # fmt: skip
        _mark(ax, run.results[run.results.scene == scene].iloc[0], rates)
        title(ax, scene_name(run, scene), 4.5)
        ax.set(xscale="log", yscale="log")
        ax.xaxis.set_major_locator(LogLocator(base=4, numticks=20))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda kib, _: _size(kib)))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.tick_params(axis="x", labelsize=8)
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    for ax in axes[-columns:]:
        ax.set_xlabel("working set")
    shown = rates[rates.kind.isin([kind for kind, *_ in LINES])]
    slowest = 1 / float(shown.ns_element.max())
    axes[0].set_ylim(slowest / 14)  # room for the names of the structures
    figure.supylabel("32-bit elements gathered, 10⁹ per second", fontsize=10)
    legend(figure, *axes[0].get_legend_handles_labels())
    caches = ", ".join(f"{c['name']} {_size(c['bytes'] / 1024)}" for c in run.meta["caches"])
    footer(
        figure,
        f"Dotted: all of what the march ({', '.join(ordered(run.results.technique))}) gathers "
        "from, in the first view of the scene.",
        f"Caches: {caches}." if caches else "",
        told(run, run.results.drop(columns="threads")),
    )
    return figure


def _mark(ax: Axes, row: Any, rates: pd.DataFrame) -> None:
    """Draw a line for each structure; names that would lie on each other share one."""
    sizes = sorted((float(row[f"{name}_bytes"]) / 1024, name) for name in STRUCTURES)
    groups: list[tuple[float, list[str]]] = []
    for size, name in sizes:
        ax.axvline(size, color=PURPLE, lw=1.2, ls=":", zorder=1)
        if groups and size < 1.6 * groups[-1][0]:
            groups[-1][1].append(name)
        else:
            groups.append((size, [name]))
    for size, names in groups:
        ax.annotate(
            ", ".join(names), (size, 0.015), xycoords=ax.get_xaxis_transform(), rotation=90,
            xytext=(-3, 0), textcoords="offset points", ha="right", va="bottom", fontsize=8.5,
            color="black",
        )  # fmt: skip
    lowest = min(rates.bytes.min() / 1024, sizes[0][0])
    ax.set_xlim(lowest / 1.5, 1.5 * max(rates.bytes.max() / 1024, sizes[-1][0]))


def march_budget(run: RunData) -> Figure:
    """Return the march's time in parts, a bar a view, with Embree's time and the budget."""
    groups = list(run.results.groupby("threads"))
    bars = max(len(rows) for _, rows in groups)
    columns = min(2, len(groups))
    lines = -(-len(groups) // columns)
    figure = Figure(figsize=(2.6 + 4.0 * columns, 1.3 + lines * (0.7 + 0.36 * bars)))
    axes = panels(figure, len(groups), columns, sharex=True, sharey=True)
    for ax, (threads, rows) in zip(axes, groups, strict=True):
        _bars(ax, run, rows)
        ax.set_title(threads_text(int(str(threads))))
    low = min(0.0, float(run.results.budget_ns.min()))
    high = float(run.results[["march_ns", "embree_ns"]].to_numpy().max())
    axes[0].set_xlim(1.1 * low, 1.18 * high)  # room for the numbers
    for ax in axes[-columns:]:
        ax.set_xlabel("ns per ray")
    legend(figure, *axes[0].get_legend_handles_labels())
    footer(
        figure,
        f"A bar is the march of one view: {', '.join(ordered(run.results.technique))}; its "
        "number is at the right. Far gathers, at random places, are cut off where they alone "
        "would take longer.",
        told(run, run.results.drop(columns="threads")),
    )
    return figure


def _bars(ax: Axes, run: RunData, rows: pd.DataFrame) -> None:
    each: list[Any] = [row for _, row in rows.iterrows()]
    at = np.arange(len(rows))
    march = rows.march_ns.to_numpy(np.float64)
    start = np.minimum(rows.start_ns.to_numpy(np.float64), march)
    rates = run.meta["rates"]
    near = np.minimum([near_gathers_ns(rates, row) for row in each], march - start)
    far = np.minimum([far_gathers_ns(rates, row) for row in each], march - start)
    heights = start, near, far - near, march - start - far
    left = np.zeros(len(rows))
    for (label, how), height in zip(PARTS, heights, strict=True):
        ax.barh(at, height, 0.62, left=left, color=how.colour, hatch=how.hatch, lw=0,
                edgecolor="white", label=label, zorder=2)  # fmt: skip
        left = left + height
    lines: tuple[tuple[Any, str, Any, str], ...] = (
        (rows.embree_ns, BLACK, "-", "strongest Embree, every ray"),
        (rows.budget_ns, ORANGE, "--", "break-even march time"),
    )
    for values, colour, style, label in lines:
        ax.vlines(
            values, at - 0.42, at + 0.42, colour, linestyles=style, label=label, lw=2.2, zorder=4
        )
    for y, total in zip(at, march, strict=True):
        ax.text(0.995, float(y), number(total), transform=ax.get_yaxis_transform(), fontsize=8,
                ha="right", va="center")  # fmt: skip
    ax.axvline(0, color=GREY, lw=0.8, zorder=3)
    if ax.get_subplotspec().is_first_col():  # type: ignore[union-attr]
        ax.set_yticks(at, [wrapped(view(run, row), 2.8, 8) for row in each], fontsize=8)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="y", visible=False)


def _size(kib: float) -> str:
    """Return a size in KiB or MiB."""
    return f"{kib / 1024:g} MiB" if kib >= 1024 else f"{kib:g} KiB"
