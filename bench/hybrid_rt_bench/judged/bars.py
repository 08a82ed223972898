"""Bars by the kind of rays: what each technique resolves and what it is worth."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from hybrid_rt_bench.judged import tables
from hybrid_rt_bench.judged.columns import CELL, EMBREE
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.report.alike import alike, gap
from hybrid_rt_bench.report.looks import GREY, looks
from hybrid_rt_bench.report.style import footer, legend, ordered, panels, told, wrapped
from hybrid_rt_bench.results.folder import RunData

A_LINE = 5
"""Kinds of rays on a line, at most."""

Height = Callable[[Pooled], tuple[float, float, float]]


def alpha_by_workload(run: RunData) -> Figure:
    """Return the share of resolved rays for each kind of rays and technique."""
    return _bars(
        run,
        "alpha: share of rays\nthat the screen resolves",
        lambda pooled: (pooled.alpha, pooled.alpha, pooled.alpha),
    )


def speedup_by_workload(run: RunData) -> Figure:
    """Return the measured speed-up for each kind of rays and technique."""

    def height(pooled: Pooled) -> tuple[float, float, float]:
        speedup = pooled.speedup(run.samples)
        if speedup is None:
            return (math.nan,) * 3
        return speedup.value, speedup.low, speedup.high

    figure = _bars(run, "measured speed-up\nover the strongest Embree", height, even=1.0)
    for ax in figure.axes:
        ax.axhline(1, color="black", lw=1.2)
    return figure


def _bars(run: RunData, label: str, height: Height, even: float = 0.0) -> Figure:
    """Return grouped bars: workloads along the axes, the techniques' default points in each."""
    timed = tables.timed(run)
    rows = tables.defaults(timed if len(timed) else run.results)
    rows = rows[rows["technique"] != EMBREE]
    same = alike(rows, CELL, ["workload"])
    pooled = {key: height(part) for key, part in pools(same, ["workload", "technique"]).items()}
    workloads, look = ordered(rows["workload"]), looks(ordered(rows["technique"]))
    lines = [workloads[k : k + A_LINE] for k in range(0, len(workloads), A_LINE)]
    each = max(1.3, 0.3 + 0.2 * len(look))
    figure = Figure(
        figsize=(max(6.4, 1.4 + each * len(lines[0])), 1.3 + 2.7 * len(lines)),
    )
    axes = panels(figure, len(lines), 1, sharey=True)
    finite = [heights for heights in pooled.values() if math.isfinite(heights[0])]
    # Of whiskers no more is shown than what leaves bars apart.
    highest, whisker = (max([h[k] for h in finite] or [0.1]) for k in (0, 2))
    top = 1.1 * max(0.1, 1.05 * even, min(whisker, 2 * max(highest, even)))
    width = 0.84 / len(look)
    for ax, names in zip(axes, lines, strict=True):
        for k, (technique, how) in enumerate(look.items()):
            for number, workload in enumerate(names):
                x = number + (k - (len(look) - 1) / 2) * width
                values = pooled.get((workload, technique), (math.nan,) * 3)
                if not math.isfinite(values[0]):
                    gap(ax, x - 0.46 * width, 0.0, 0.92 * width, 0.55, upright=True)
                    continue
                ax.bar(x, values[0], 0.92 * width, color=how.colour, hatch=how.hatch,
                       edgecolor="white", lw=0)  # fmt: skip
                _mark(ax, x, values)
        ax.set_xticks(
            range(len(names)), [wrapped(w.replace("_", " "), 0.9 * each, 10) for w in names]
        )
        ax.set_xlim(-0.5, len(lines[0]) - 0.5)
        ax.set_ylim(0, top)
        ax.tick_params(axis="x", length=0)
        ax.grid(axis="x", visible=False)
        ax.set_ylabel(label)
    legend(
        figure,
        [Patch(facecolor=h.colour, hatch=h.hatch, edgecolor="white", lw=0) for h in look.values()],
        list(look),
    )
    footer(
        figure,
        "Default parameters; pooled over the cells that all techniques of a kind of rays have in "
        f"common. {'Whiskers: 95 % intervals. Above the line at 1 it pays. ' if even else ''}"
        f"{'Whiskers that leave the panel go on beyond it. ' if whisker > top else ''}"
        f"{told(run, same)}",
    )
    return figure


def _mark(ax: Axes, x: float, values: tuple[float, float, float]) -> None:
    """Draw the interval of a bar; a bar of no height is named by its number."""
    value, low, high = values
    if value == 0:
        ax.annotate("0", (x, 0), xytext=(0, 2), textcoords="offset points", ha="center",
                    fontsize=9, color=GREY)  # fmt: skip
    elif high > low:
        error = np.clip([[value - low], [high - value]], 0, None)
        ax.errorbar(x, value, error, fmt="none", ecolor="black", lw=1, capsize=1.5)
