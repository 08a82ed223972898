"""Log-log plots of an experiment of kind "scaling", with lines to hold the slopes against."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FixedLocator, NullLocator

from hybrid_rt_bench.kinds.scaling.stages import (
    A_RAY,
    SHARED,
    Key,
    name_of,
)
from hybrid_rt_bench.kinds.scaling.tables import (
    fixed,
    of_series,
    series_names,
    stages_of,
)
from hybrid_rt_bench.report.looks import BLACK, GREY, SERIES, looks
from hybrid_rt_bench.report.style import (
    Draw,
    columns_of,
    footer,
    ordered,
    plain_log,
    save_all,
    told,
)
from hybrid_rt_bench.results.folder import RunData

SHARED_LOOKS: dict[str, tuple[str, str]] = {
    "embree": (BLACK, "*"),
    "brute_force": (GREY, "x"),
    "build": (BLACK, "*"),
    "raster": (GREY, "h"),
}
"""Colour and marker of the stages that belong to no technique."""

AXIS_NAMES = {"triangles": "triangles n", "pixels": "pixels n", "threads": "threads n"}

Guide = tuple[str, Callable[[Any], Any]]

GUIDES: dict[str, tuple[Guide, ...]] = {
    "triangles": (
        ("O(1)", lambda n: n**0.0),
        ("O(log n)", np.log),
        ("O(n)", lambda n: n),
    ),
    "pixels": (("O(1)", lambda n: n**0.0), ("O(n)", lambda n: n)),
    "threads": (("O(1)", lambda n: n**0.0), ("O(1/n)", lambda n: 1 / n)),
}
"""Slopes to compare with, for each axis."""

LONG_LABEL, MOST_LABELS = 7, 9

PANEL, LEGEND = (5.7, 4.6), 8.5
"""The size of a panel, inches, and that of the text of its legend, points."""

LABEL_SHARE = 0.05
"""The height of a guide's name as a share of the height of a panel."""


@dataclass(frozen=True)
class Line:
    """One curve of a panel."""

    label: str
    colour: str
    marker: str
    dash: str
    x: np.ndarray[Any, Any]
    y: np.ndarray[Any, Any]
    low: np.ndarray[Any, Any]
    high: np.ndarray[Any, Any]


def plots(run: RunData, folder: Path) -> list[Path]:
    """Write the plots of a run into `folder` and return their paths."""
    figures: list[tuple[str, Draw]] = [
        (f"scaling-{name}", functools.partial(time_over_axis, name=name))
        for name in series_names(run)
    ]
    if _with_memory(run):
        figures.append(("memory", memory))
    return save_all(run, folder, figures)


def time_over_axis(run: RunData, name: str) -> Figure:
    """Return the times of a series: what answers rays on the left, all else on the right."""
    part = of_series(run, name)
    axis = str(part.axis.iloc[0])
    # At a fixed view a time a ray says the same and can be held beside a sample of brute force.
    column, unit = ("ns_per_ray", "ns per ray") if axis == "triangles" else ("ms", "ms")
    keys = stages_of(part)
    shown = ("embree", "brute_force", "march", "hybrid")
    left = [key for key in keys if key[1] in shown]
    if column == "ms":
        left = [key for key in left if key[1] != "brute_force"]
    right = [key for key in keys if key[1] not in A_RAY]
    techniques = [t for t in dict.fromkeys(part.technique) if t != SHARED]
    shown_lines = _lines(part, left, column, techniques), _lines(part, right, "ms", techniques)
    figure, axes = _grid(shown_lines)
    _panel(*axes[0], part, shown_lines[0], axis)
    _name(axes[0][0], "Answers to mirror rays", f"time, {unit}")
    _panel(*axes[1], part, shown_lines[1], axis)
    _name(axes[1][0], "What is made before", "time, ms")
    footer(
        figure,
        f"{name}: {fixed(part)}. Median of the rounds; band: its interval.",
        *_absent(part, techniques),
        f"{run.meta['environment']['cpu']}.",
    )
    return figure


def _absent(part: pd.DataFrame, techniques: Sequence[str]) -> list[str]:
    """Return a sentence that names the sizes at which a technique was not measured."""
    lost = []
    for technique in techniques:
        mine = part[part.technique == technique]
        labels = part[~part.x.isin(mine.x)].label
        if len(labels):
            lost.append(f"{technique} at {', '.join(ordered(labels))}")
    return [f"Not measured: {'; '.join(lost)}."] if lost else []


def _with_memory(run: RunData) -> dict[str, list[str]]:
    """Return the series over triangles and over pixels whose memory is known."""
    groups: dict[str, list[str]] = {"triangles": [], "pixels": []}
    for name in series_names(run):
        part = of_series(run, name)
        axis = str(part.axis.iloc[0])
        if axis in groups and part.peak_bytes.max() > 0:
            groups[axis].append(name)
    return {axis: names for axis, names in groups.items() if names}


def memory(run: RunData) -> Figure:
    """Return the peak memory over triangles and over pixels."""
    groups = _with_memory(run)
    lines: dict[str, list[Line]] = {}
    for axis, names in groups.items():
        for number, name in enumerate(names):
            part = of_series(run, name).drop_duplicates("x")
            part = part[part.peak_bytes > 0]
            colour, marker, _ = SERIES[number % len(SERIES)]
            whole = part.peak_bytes.to_numpy(float) / 2**20
            rest = whole - part.program_bytes.to_numpy(float) / 2**20
            for label, y, dash in ((name, whole, "-"), ("", rest, "--")):
                x = part.x.to_numpy(float)
                kept = y > 0
                lines.setdefault(axis, []).append(
                    Line(label, colour, marker, dash, x[kept], y[kept], y[kept], y[kept])
                )
    figure, axes = _grid(list(lines.values()))
    for (ax, beneath), (axis, names) in zip(axes, groups.items(), strict=True):
        _panel(ax, beneath, of_series(run, names[0]), lines[axis], axis)
        _name(ax, f"Over {axis}", "peak memory of the process, MiB")
    every = run.results[run.results.series.isin([n for names in groups.values() for n in names])]
    footer(
        figure,
        "Solid: all; dashed: without the program, which is interpreter, libraries and compiled "
        "kernels. The rest: scene, Embree, images, rays of all techniques.",
        told(run, every),
    )
    return figure


def _grid(legends: Sequence[Sequence[Line]]) -> tuple[Figure, list[tuple[Axes, Axes]]]:
    """Return panels side by side, each with a place beneath that is as high as its legend."""
    labels = [[line.label for line in lines if line.label] for lines in legends]
    columns = [columns_of(of, PANEL[0] - 1.0, LEGEND) for of in labels]
    most = max(-(-len(of) // count) for of, count in zip(labels, columns, strict=True))
    beneath = 0.02 + 0.018 * LEGEND * most
    figure = Figure(figsize=(PANEL[0] * len(legends) + 0.2, PANEL[1] + beneath + 0.6))
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(w_pad=0.14)  # room beside the names of guides
    grid = figure.add_gridspec(2, len(legends), height_ratios=(PANEL[1], beneath))
    return figure, [
        (figure.add_subplot(grid[0, k]), figure.add_subplot(grid[1, k]))
        for k in range(len(legends))
    ]


def _name(ax: Axes, title: str, y: str) -> None:
    ax.set_title(title, pad=18)  # guides that leave at the top are named below it
    ax.set_ylabel(y)


def _lines(
    part: pd.DataFrame, keys: Sequence[Key], column: str, techniques: Sequence[str]
) -> list[Line]:
    lines = []
    for technique, stage in keys:
        rows = part[(part.technique == technique) & (part.stage == stage)]
        if technique == SHARED:
            colour, marker = SHARED_LOOKS[stage]
        else:
            colour, marker, _ = looks(techniques)[technique]
        y = rows[column].to_numpy(float)
        scale = y / rows.ms.to_numpy(float)
        lines.append(
            Line(
                name_of(technique, stage).replace("hybrid: march to merge", "hybrid"),
                colour,
                marker,
                "--" if stage == "hybrid" else "-",
                rows.x.to_numpy(float),
                y,
                rows.ms_low.to_numpy(float) * scale,
                rows.ms_high.to_numpy(float) * scale,
            )
        )
    return lines


def _panel(ax: Axes, beneath: Axes, part: pd.DataFrame, lines: Sequence[Line], axis: str) -> None:
    """Draw curves and guides, set both axes to logarithms, put the legend into `beneath`."""
    for line in lines:
        ax.plot(
            line.x, line.y, line.dash, color=line.colour, marker=line.marker, ms=5,
            label=line.label or "_", zorder=3,
            markerfacecolor="white" if line.dash == "--" else line.colour,
        )  # fmt: skip
        ax.fill_between(line.x, line.low, line.high, color=line.colour, alpha=0.13, lw=0)
    ax.set(xscale="log", yscale="log", xlabel=AXIS_NAMES[axis])
    values = np.concatenate([v for line in lines for v in (line.low, line.y, line.high)])
    places = part.drop_duplicates("x")
    xs = places.x.to_numpy(float)
    _ticks(ax, axis, xs, [str(label) for label in places.label])
    low, high = float(values.min()), float(values.max())
    room = max(high / low, 4.0)  # flat curves are shown as flat
    centre = math.sqrt(low * high)
    bottom, top = centre / math.sqrt(room) / 1.9, centre * math.sqrt(room) * 1.4
    ax.set_ylim(bottom, top)
    _guides(ax, axis, xs, bottom, top, low)
    plain_log(ax)
    beneath.axis("off")
    beneath.legend(
        *ax.get_legend_handles_labels(), loc="upper center", fontsize=LEGEND,
        ncols=columns_of([line.label for line in lines if line.label], PANEL[0] - 1.0, LEGEND),
        handlelength=2.6, borderaxespad=0,
    )  # fmt: skip


def _guides(
    ax: Axes, axis: str, xs: np.ndarray[Any, Any], bottom: float, top: float, low: float
) -> None:
    """Draw the guides from one point, below the curves, or above them where they fall.

    Each is named where it leaves the panel.
    """
    if len(xs) < 2:
        return
    n = np.geomspace(xs.min(), xs.max(), 200)
    falling = axis == "threads"
    start = top / 1.25 if falling else low / 1.35
    ends: dict[str, float] = {}
    for name, shape in GUIDES[axis]:
        y = start * shape(n) / shape(n[0])
        ax.plot(n, y, color="#9A9A9A", lw=1.0, ls=(0, (1, 2)), zorder=1)
        inside = (y <= top) & (y >= bottom)
        last = int(np.flatnonzero(inside)[-1])
        if last == len(n) - 1:
            ends[name] = float(y[last])
            continue
        below = y[last] < math.sqrt(top * bottom)
        ax.annotate(
            name, (n[last], bottom if below else top), xytext=(0, -3 if below else 3),
            textcoords="offset points", ha="center", va="top" if below else "bottom",
            fontsize=8, color=GREY, annotation_clip=False,
        )  # fmt: skip
    above = 0.0
    for name, y in sorted(ends.items(), key=lambda end: end[1]):
        y = max(y, above)  # names that would lie on one another are moved apart
        above = y * (top / bottom) ** LABEL_SHARE
        ax.annotate(
            name, (n[-1], y), xytext=(9, 0), textcoords="offset points", va="center", fontsize=8,
            color=GREY, annotation_clip=False,
        )  # fmt: skip


def _ticks(ax: Axes, axis: str, xs: np.ndarray[Any, Any], labels: list[str]) -> None:
    """Put a tick at every size, and its name at as many as there is room for."""
    powers = all(label.startswith("2^") for label in labels)
    names = [rf"$2^{{{label[2:]}}}$" if powers else label.replace("x", "×") for label in labels]
    every = -(-len(names) // MOST_LABELS)
    # Counted from the largest, whose name is always there.
    names = [name if (len(names) - 1 - k) % every == 0 else "" for k, name in enumerate(names)]
    ax.xaxis.set_major_locator(FixedLocator(list(xs)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticks(list(xs), names)
    if max(len(label) for label in labels) > LONG_LABEL:
        ax.tick_params(axis="x", rotation=35)
        for text in ax.get_xticklabels():
            text.set_horizontalalignment("right")
            text.set_rotation_mode("anchor")
    ax.set_xlim(xs.min() / 1.12, xs.max() * 1.12)
