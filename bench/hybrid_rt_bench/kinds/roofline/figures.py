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
from hybrid_rt_bench.report.style import BLUE, GREEN, GREY, ORANGE, SKY, save_all
from hybrid_rt_bench.report.table import number, threads_text
from hybrid_rt_bench.results.folder import RunData

LINES = (("gather", "-", "o"), ("chain", "--", "s"))
NAMES = {"gather": "independent", "chain": "each waits for the last"}
PARTS = (
    ("set-up, one step, write", GREEN),
    ("near gathers", BLUE),
    ("more of far gathers", SKY),
    ("rest", GREY),
)


def plots(run: RunData, folder: Path) -> list[Path]:
    """Write the figures of the run into `folder`."""
    return save_all(run, folder, [("gather-rate", gather_rate), ("march-budget", march_budget)])


def gather_rate(run: RunData) -> Figure:
    """Return the machine's rate over the size of the table, a panel a scene with its structures."""
    rates = pd.DataFrame(run.meta["rates"])
    counts = sorted(int(n) for n in rates.threads.unique())
    scenes = list(dict.fromkeys(run.results.scene))
    figure = Figure(figsize=(1.2 + 5.2 * len(scenes), 4.6))
    axes: Any = figure.subplots(1, len(scenes), sharex=True, sharey=True, squeeze=False)[0]
    for ax, scene in zip(axes, scenes, strict=True):
        for threads, colour in zip(counts, (BLUE, ORANGE), strict=False):
            for kind, style, marker in LINES:
                part = rates[(rates.kind == kind) & (rates.threads == threads)]
                ax.plot(
                    part.bytes / 1024, 1 / part.ns_element, style, color=colour, marker=marker,
                    ms=4.5, label=f"{threads_text(threads)}, {NAMES[kind]}",
                )  # fmt: skip
        _mark(ax, run.results[run.results.scene == scene].iloc[0], rates)
        ax.set(title=scene, xscale="log", yscale="log", xlabel="working set")
        ax.xaxis.set_major_locator(LogLocator(base=4, numticks=20))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda kib, _: _size(kib)))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    shown = rates[rates.kind.isin([kind for kind, *_ in LINES])]
    slowest = 1 / float(shown.ns_element.max())
    axes[0].set_ylabel("gathered numbers, 10⁹ a second")
    axes[0].set_ylim(slowest / 14)  # room for the names of the structures
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2)
    caches = ", ".join(f"{c['name']} {_size(c['bytes'] / 1024)}" for c in run.meta["caches"])
    figure.supxlabel(
        "Dotted: all of what the march gathers from." + (f" Caches: {caches}." if caches else ""),
        fontsize=8, color=GREY, x=0.99, ha="right",
    )  # fmt: skip
    return figure


def _mark(ax: Axes, row: Any, rates: pd.DataFrame) -> None:
    """Draw a line for each structure; names that would lie on each other share one."""
    sizes = sorted((float(row[f"{name}_bytes"]) / 1024, name) for name in STRUCTURES)
    groups: list[tuple[float, list[str]]] = []
    for size, name in sizes:
        ax.axvline(size, color=GREEN, lw=1.2, ls=":", zorder=1)
        if groups and size < 1.6 * groups[-1][0]:
            groups[-1][1].append(name)
        else:
            groups.append((size, [name]))
    for size, names in groups:
        ax.annotate(
            ", ".join(names), (size, 0.015), xycoords=ax.get_xaxis_transform(), rotation=90,
            xytext=(-3, 0), textcoords="offset points", ha="right", va="bottom", fontsize=8.5,
            color=GREEN,
        )  # fmt: skip
    lowest = min(rates.bytes.min() / 1024, sizes[0][0])
    ax.set_xlim(lowest / 1.5, 1.5 * max(rates.bytes.max() / 1024, sizes[-1][0]))


def march_budget(run: RunData) -> Figure:
    """Return the march's time in parts, a bar a view, with Embree's time and the budget."""
    groups = list(run.results.groupby("threads"))
    bars = len(groups[0][1])
    figure = Figure(figsize=(1.6 + max(3.2, 0.85 * bars) * len(groups), 4.8))
    axes: Any = figure.subplots(1, len(groups), sharey=True, squeeze=False)[0]
    for ax, (threads, rows) in zip(axes, groups, strict=True):
        _bars(ax, run, rows)
        ax.set_title(threads_text(int(str(threads))))
    low = min(0.0, float(run.results.budget_ns.min()))
    high = float(run.results[["march_ns", "embree_ns"]].to_numpy().max())
    axes[0].set(ylabel="ns a ray", ylim=(1.1 * low, 1.08 * high))
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    figure.supxlabel(
        "A bar is the march. Far gathers, at random places, are cut off where they alone would "
        "take longer.",
        fontsize=8, color=GREY, x=0.99, ha="right",
    )  # fmt: skip
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
    bottom = np.zeros(len(rows))
    for (label, colour), height in zip(PARTS, heights, strict=True):
        ax.bar(at, height, 0.62, bottom=bottom, color=colour, label=label, zorder=2)
        bottom = bottom + height
    lines: tuple[tuple[Any, str, Any, str], ...] = (
        (rows.embree_ns, ORANGE, "-", "strongest Embree, every ray"),
        (rows.budget_ns, "black", "--", "what the march may take"),
    )
    for values, colour, style, label in lines:
        ax.hlines(
            values, at - 0.42, at + 0.42, colour, linestyles=style, label=label, lw=2.2, zorder=4
        )
    for x, total in zip(at, march, strict=True):
        ax.annotate(
            number(total), (float(x), float(total)), xytext=(0, 2), textcoords="offset points",
            ha="center", va="bottom", fontsize=8,
        )  # fmt: skip
    ax.axhline(0, color=GREY, lw=0.8, zorder=3)
    ax.set_xticks(at, [view(run, row) for row in each], rotation=35, ha="right")
    ax.tick_params(axis="x", length=0)
    ax.grid(axis="x", visible=False)


def _size(kib: float) -> str:
    """Return a size in KiB or MiB."""
    return f"{kib / 1024:g} MiB" if kib >= 1024 else f"{kib:g} KiB"
