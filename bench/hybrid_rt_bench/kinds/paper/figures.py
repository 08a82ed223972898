"""Plots of a run of kind "paper": every technique in each, like compared with like."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, NullLocator

from hybrid_rt_bench.kinds.paper import published as paper
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.paper.tables import samples_of
from hybrid_rt_bench.report.alike import MISSING, alike, gap
from hybrid_rt_bench.report.looks import (
    AMBER,
    BLACK,
    GREY,
    STAGES,
    TECHNIQUES,
    Look,
    looks,
)
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.style import (
    footer,
    legend,
    ordered,
    panels,
    plain_log,
    resolutions,
    save_all,
    title,
    told,
    wrapped,
)
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData

VIEW = ("scene", "camera", "width", "height")
ALIKE = "Means are over the views that all techniques of a point have in common."


def plots(run: RunData, folder: Path) -> list[Path]:
    """Write every plot of a run into `folder` and return their paths."""
    return save_all(
        run,
        folder,
        (
            ("time-over-resolution", time_over_resolution),
            ("speedup-by-scene", speedup_by_scene),
            ("alpha-by-camera", alpha_by_camera),
            ("errors-by-camera", errors_by_camera),
            ("time-of-stages", time_of_stages),
        ),
    )


def time_over_resolution(run: RunData) -> Figure:
    """Return the times of Embree and of each technique's march and hybrid over the resolution."""
    results = _sized(run.results)
    same = alike(results, VIEW, ("scene", "size"))
    scenes, look = ordered(results.scene), looks(ordered(results.technique))
    columns = min(3, len(scenes))
    figure = Figure(figsize=(max(6.0, 3.5 * columns + 0.6), 3.4 * -(-len(scenes) // columns) + 0.8))
    axes = panels(figure, len(scenes), columns, sharey=True, sharex=True)
    sizes = results.drop_duplicates("pixels").sort_values("pixels")
    for ax, scene in zip(axes, scenes, strict=True):
        part = same[same.scene == scene]
        # Embree is timed once a view, whatever the techniques.
        once = part.drop_duplicates(list(VIEW))
        _line(ax, once, "embree_ms", TECHNIQUES["embree"], "-", "strongest Embree, every ray")
        for name, how in look.items():
            mine = part[part.technique == name]
            if mine.empty:
                continue
            _line(ax, mine, "hybrid_ms", how, "-", f"{name}: hybrid")
            _line(ax, mine, "march_ms", how, ":", f"{name}: march alone")
        ax.set(xscale="log", yscale="log")
        ax.xaxis.set_major_locator(FixedLocator(sizes.pixels.tolist()))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.set_xticks(sizes.pixels.tolist(), resolutions(sizes), rotation=35, ha="right",
                      rotation_mode="anchor")  # fmt: skip
        ax.set_xlim(0.75 * sizes.pixels.min(), 1.33 * sizes.pixels.max())
        plain_log(ax)
        title(ax, scene_name(run, scene), 3.0)
    figure.supylabel("time, ms", fontsize=10)
    _common_legend(figure, axes)
    footer(
        figure,
        f"Line: mean over cameras; band: least to most. {ALIKE} {told(run, results)}",
        *_absent(results, same, ("scene", "size")),
    )
    return figure


def speedup_by_scene(run: RunData) -> Figure:
    """Return the estimated and the measured speed-up by scene and resolution, a panel each."""
    results = _sized(run.results)
    same = alike(results, VIEW, ("scene", "size"))
    kept = set(zip(*(same[k] for k in (*VIEW, "technique")), strict=True))
    look = looks(ordered(results.technique))
    rows = _groups(results[["scene", "size"]].drop_duplicates())
    columns = min(4, len(look))
    lines = -(-len(look) // columns)
    figure = Figure(
        figsize=(1.6 + (5.0 if columns == 1 else 2.7) * columns,
                 1.6 + lines * (0.5 + 0.27 * len(rows))),
    )  # fmt: skip
    axes = panels(figure, len(look), columns, sharex=True, sharey=True)
    kinds = (
        ("estimated, by the paper's formula", AMBER, "s", 0.26),
        ("measured", BLACK, "o", 0.0),
        ("measured, pyramid added", GREY, "^", -0.26),
    )
    for ax, name in zip(axes, look, strict=True):
        series: dict[tuple[str, str], list[list[Any]]] = {}
        for row, samples in samples_of(run, name):
            if (*(row[k] for k in VIEW), name) in kept:
                group = series.setdefault((row.scene, _size(row)), [[], [], []])
                group[0].append(summary.estimated_speedup(samples, row.alpha))
                group[1].append(summary.measured_speedup(samples))
                group[2].append(summary.measured_speedup(samples, with_pyramid=True))
        for y, key in enumerate(rows):
            if key[1] and key not in series:
                ax.text(0.03, y, MISSING, transform=ax.get_yaxis_transform(), fontsize=8,
                        color=GREY, va="center")  # fmt: skip
            for values, (label, colour, marker, shift) in zip(
                series.get(key, ()), kinds, strict=False
            ):
                mean = stats.geometric_mean_of_medians(values)
                error = [[max(0, mean.value - mean.low)], [max(0, mean.high - mean.value)]]
                ax.errorbar(mean.value, y - shift, xerr=error, fmt=marker, ms=5, color=colour,
                            capsize=2, lw=1.2, label=label)  # fmt: skip
        ax.axvline(1, color="black", lw=1, zorder=1)
        _named_rows(run, ax, rows, 2.1)
        title(ax, name, 2.3, fontweight="bold")
        ax.set_xlabel("T(Embree) / T(hybrid)")
    low, high = zip(*(ax.dataLim.intervalx for ax in axes), strict=True)
    least, most = min(0.9, *low), max(1.1, *high)
    axes[0].set_xlim(least - 0.08 * (most - least), most + 0.08 * (most - least))
    _common_legend(figure, axes)
    footer(
        figure,
        "Right of the line at 1 the hybrid is faster than the strongest Embree for every ray. "
        "Geometric mean over cameras, 95 % bootstrap interval over rounds.",
        ALIKE,
        told(run, results),
    )
    return figure


def alpha_by_camera(run: RunData) -> Figure:
    """Return the share of resolved rays of each camera and technique, beside the paper's mean."""
    rows, views, look = _largest(run)
    groups = _groups(views)
    figure = Figure(figsize=(7.2, 1.7 + (0.22 + 0.05 * len(look)) * len(groups)))
    ax = figure.add_subplot()
    for y, key in enumerate(groups):
        mine = rows[(rows.scene == key[0]) & (rows.camera == key[1])]
        for k, (name, how) in enumerate(look.items()):
            value = mine[mine.technique == name].alpha
            if len(value) and key[1]:
                at = y + _shift(k, len(look))
                ax.plot([0, value.iloc[0]], [at, at], color=how.colour, lw=1.1, zorder=2)
                ax.plot(value, [at], how.marker, color=how.colour, ms=6, label=name, zorder=3)
                if len(look) == 1:
                    ax.annotate(f"{value.iloc[0]:.3f}", (value.iloc[0], at), xytext=(7, 0),
                                textcoords="offset points", va="center", fontsize=9)  # fmt: skip
    ax.axvline(paper.ALPHA, color="black", lw=1, ls="--", zorder=1,
               label=f"the paper's mean, {paper.ALPHA}")  # fmt: skip
    _named_rows(run, ax, groups, 5.0)
    ax.set_xlim(-0.012, max(0.5, 1.12 * float(rows.alpha.max())))
    ax.set_xlabel("alpha: share of mirror rays that the screen resolves")
    _common_legend(figure, [ax])
    footer(figure, told(run, rows), *_lacking(rows, views, look))
    return figure


def errors_by_camera(run: RunData) -> Figure:
    """Return the rates of false hits and other errors of each camera, with their intervals."""
    rows, views, look = _largest(run)
    groups = _groups(views)
    figure = Figure(figsize=(10.4, 1.8 + (0.22 + 0.07 * len(look)) * len(groups)))
    kinds = ("false_hit", "false_miss", "wrong_primitive")
    axes = panels(figure, 3, 3, sharex=True, sharey=True)
    most = float(np.nanmax(100 * rows[[f"{kind}_high" for kind in kinds]].to_numpy(float)))
    for ax, kind in zip(axes, kinds, strict=True):
        for y, key in enumerate(groups):
            mine = rows[(rows.scene == key[0]) & (rows.camera == key[1])]
            for k, (name, how) in enumerate(look.items()):
                found = mine[mine.technique == name]
                if found.empty or not key[1]:
                    continue
                value, low, high = (
                    float(100 * found[f"{kind}_{end}"].iloc[0]) for end in ("rate", "low", "high")
                )
                if not np.isfinite(value):  # a screen without an answer has no rate
                    continue
                error = [[max(0.0, value - low)], [max(0.0, high - value)]]
                ax.errorbar(value, y + _shift(k, len(look)), xerr=error, fmt=how.marker,
                            color=how.colour, ms=5, lw=1.1, capsize=2, label=name)  # fmt: skip
        # Linear about zero, then logarithmic: a rate of exactly zero stays in the picture.
        ax.set_xscale("symlog", linthresh=0.01)
        top = max(10.0, 1.5 * most)
        ax.set_xlim(-0.003, top)
        ticks = [t for t in (0, 0.01, 0.1, 1, 10, 100) if t <= top]
        ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
        ax.xaxis.set_minor_locator(NullLocator())
        _named_rows(run, ax, groups, 2.4)
        title(ax, kind.replace("_", " "), 2.4)
    axes[1].set_xlabel("% of the rays that the screen resolves")
    _common_legend(figure, axes)
    footer(figure, "95 % intervals; linear below 0.01 %.", told(run, rows),
           *_lacking(rows, views, look))  # fmt: skip
    return figure


def time_of_stages(run: RunData) -> Figure:
    """Return where the time goes: tracing every ray beside the stages of each hybrid."""
    rows, views, look = _largest(run)
    scenes = ordered(views.scene)
    columns = min(2, len(scenes))
    each = 2 + len(look)  # a heading, Embree, the hybrids
    most = max(sum(views.scene == scene) for scene in scenes)
    lines = -(-len(scenes) // columns)
    figure = Figure(figsize=(5.4 * columns + 1.0, 1.4 + lines * (0.55 + 0.19 * each * most)))
    axes = panels(figure, len(scenes), columns, sharex=True)
    parts = ("march", "compaction", "fallback", "merge")
    for ax, scene in zip(axes, scenes, strict=True):
        names: list[str] = []
        for camera in ordered(views[views.scene == scene].camera):
            mine = rows[(rows.scene == scene) & (rows.camera == camera)]
            scale = 1e6 / mine.rays.iloc[0]
            names += [camera, "Embree, every ray"]
            ax.barh(len(names) - 1, mine.embree_ms.iloc[0] * scale, 0.72,
                    color=STAGES["embree"].colour)  # fmt: skip
            for name in look:
                names.append(name)
                found = mine[mine.technique == name]
                if found.empty:
                    gap(ax, 0.0, len(names) - 1.36, 0.22, 0.72, upright=False)
                    continue
                left = 0.0
                for stage in parts:
                    width = float(found[f"{stage}_ms"].iloc[0]) * scale
                    ax.barh(len(names) - 1, width, 0.72, left=left, color=STAGES[stage].colour,
                            hatch=STAGES[stage].hatch, edgecolor="white", lw=0)  # fmt: skip
                    left += width
        labels = [wrapped(name, 1.9, 8).replace("\n", " ") for name in names]
        ax.set_yticks(range(len(names)), labels, fontsize=8)
        for k, label in enumerate(ax.get_yticklabels()):
            if k % each == 0:
                label.set_fontweight("bold")
        ax.tick_params(axis="y", length=0)
        ax.set_ylim(len(names) - 0.4, -0.7)
        ax.grid(axis="y", visible=False)
        title(ax, scene_name(run, scene), 4.0)
        ax.set_xlabel("time per ray, ns")
    handles = [
        Patch(facecolor=how.colour, hatch=how.hatch, edgecolor="white", lw=0)
        for how in STAGES.values()
    ]
    legend(figure, handles, ["Embree, every ray", *parts])
    footer(figure, "Time of all threads together, a bar a technique.", told(run, rows))
    return figure


def _line(ax: Axes, rows: pd.DataFrame, column: str, how: Look, dash: str, label: str) -> None:
    values = rows.groupby("pixels")[column]
    x = np.array(list(values.groups))
    ax.plot(x, values.mean(), dash, color=how.colour, marker=how.marker, ms=5, label=label,
            markerfacecolor=how.colour if dash == "-" else "white")  # fmt: skip
    if (values.count() > 1).any():
        ax.fill_between(x, values.min(), values.max(), color=how.colour, alpha=0.12, lw=0)


def _common_legend(figure: Figure, axes: Iterable[Axes]) -> None:
    found: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    legend(figure, list(found.values()), list(found))


def _groups(views: pd.DataFrame) -> list[tuple[str, str]]:
    """Return the lines of a plot: a heading for each scene, its name and nothing, and its parts."""
    lines = []
    first, second = views.columns[:2]
    for scene in ordered(views[first]):
        parts = ordered(views[views[first] == scene][second])
        lines += [(scene, ""), *((scene, part) for part in parts)]
    return lines


def _named_rows(run: RunData, ax: Axes, rows: Sequence[tuple[str, str]], inches: float) -> None:
    """Name the lines at the left, and over them, in the first panel, their headings."""
    if ax.get_subplotspec().is_first_col():  # type: ignore[union-attr]
        ax.set_yticks(range(len(rows)), [part for _, part in rows])
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="y", visible=False)
    for y, (scene, part) in enumerate(rows):
        if not part:
            ax.axhline(y - 0.5, color="#D5D5D5", lw=0.7, zorder=0)
            if ax.get_subplotspec().is_first_col():  # type: ignore[union-attr]
                name = wrapped(scene_name(run, scene), inches, 9, "bold")
                ax.text(0.01, y, name, fontsize=9, fontweight="bold",
                        transform=ax.get_yaxis_transform(), va="center", linespacing=1.0,
                        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
                        zorder=4)  # fmt: skip


def _shift(k: int, count: int) -> float:
    """Return how far the k-th of several marks stands below the middle of its line."""
    return 0.0 if count == 1 else 0.66 * (k / (count - 1) - 0.5)


def _sized(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(
        pixels=rows.width * rows.height, size=[_size(row) for _, row in rows.iterrows()]
    ).sort_values(["pixels"], kind="stable")


def _size(row: Any) -> str:
    return f"{int(row.width)}×{int(row.height)}"


def _largest(run: RunData) -> tuple[pd.DataFrame, pd.DataFrame, dict[str, Look]]:
    """Return the rows of each camera's largest resolution, its views and the techniques' looks."""
    rows = run.results.assign(pixels=run.results.width * run.results.height)
    best = rows.groupby(["scene", "camera"]).pixels.transform("max")
    views = rows[["scene", "camera"]].drop_duplicates()
    return rows[rows.pixels == best], views, looks(ordered(rows.technique))


def _absent(rows: pd.DataFrame, same: pd.DataFrame, group: Sequence[str]) -> list[str]:
    """Return a sentence that names what was not measured, or shares no view with the others."""
    names = [*group, "technique"]
    wanted = [
        (*key, name)
        for key in rows[list(group)].drop_duplicates().itertuples(index=False)
        for name in ordered(rows.technique)
    ]
    found = set(same[names].drop_duplicates().itertuples(index=False, name=None))
    return _sentence([", ".join(map(str, key)) for key in wanted if key not in found])


def _lacking(
    rows: pd.DataFrame, views: pd.DataFrame, techniques: Iterable[str]
) -> list[str]:  # fmt: skip
    """Return a sentence that names the techniques that a view was not measured with."""
    found = set(rows[["scene", "camera", "technique"]].itertuples(index=False, name=None))
    return _sentence(
        [
            f"{scene}, {camera}, {name}"
            for scene, camera in views.itertuples(index=False, name=None)
            for name in techniques
            if (scene, camera, name) not in found
        ]
    )


def _sentence(absent: Sequence[str]) -> list[str]:
    return [f"Not measured: {'; '.join(absent)}."] if absent else []
