"""Plots of a run: plain, labelled, readable without colour vision."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from hybrid_rt_bench.kinds.paper import published as paper
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.paper.tables import samples_of
from hybrid_rt_bench.report.style import (
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    footer,
    ordered,
    save_all,
)
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData


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
    """Return the times of march, strongest Embree and hybrid over the number of pixels."""
    results = _first_technique(run)
    scenes = ordered(results.scene)
    figure = Figure(figsize=(3.4 * len(scenes) + 0.8, 3.6))
    axes = _row_of_axes(figure, len(scenes), sharey=True)
    lines = (
        ("march_ms", "march (SSRM)", GREEN, "^"),
        ("embree_ms", "strongest Embree, every ray", ORANGE, "s"),
        ("hybrid_ms", "hybrid, measured", BLUE, "o"),
    )
    for ax, scene in zip(axes, scenes, strict=True):
        part = results[results.scene == scene]
        groups = part.assign(megapixels=part.width * part.height / 1e6).groupby("megapixels")
        for column, label, colour, marker in lines:
            values = groups[column]
            x = np.array(list(values.groups))
            ax.plot(x, values.mean(), color=colour, marker=marker, ms=5, label=label)
            if len(x) and (values.count() > 1).any():
                ax.fill_between(x, values.min(), values.max(), color=colour, alpha=0.13, lw=0)
        sizes = part.drop_duplicates(["width", "height"])
        ticks = sizes.width * sizes.height / 1e6
        names = dict(
            zip(
                ticks,
                [f"{w}×{h}" for w, h in zip(sizes.width, sizes.height, strict=True)],
                strict=True,
            )
        )
        ax.set(title=scene, xscale="log", yscale="log", xlabel="resolution")
        ax.xaxis.set_major_locator(FixedLocator(list(names)))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter(
            FuncFormatter(lambda x, _, n=names: n[min(n, key=lambda k: abs(k - x))])
        )
        ax.tick_params(axis="x", rotation=30)
        ax.set_xlim(0.7 * min(names), 1.4 * max(names))
        _plain_log(ax)
    axes[0].set_ylabel("time, ms")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    footer(figure, "Line: mean over cameras; band: least to most.")
    return figure


def speedup_by_scene(run: RunData) -> Figure:
    """Return the estimated and the measured speed-up by scene and resolution."""
    technique = ordered(run.results.technique)[0]
    series: dict[tuple[str, str], dict[str, list[Any]]] = {}
    for row, samples in samples_of(run, technique):
        group = series.setdefault(
            (row.scene, f"{int(row.width)}×{int(row.height)}"),
            {"estimated": [], "measured": [], "pyramid": []},
        )
        group["estimated"].append(summary.estimated_speedup(samples, row.alpha))
        group["measured"].append(summary.measured_speedup(samples))
        group["pyramid"].append(summary.measured_speedup(samples, with_pyramid=True))
    keys = list(series)
    figure = Figure(figsize=(max(6.6, 0.62 * len(keys) + 2.4), 4.2))
    ax = figure.add_subplot()
    kinds = (
        ("estimated", "estimated (paper's formula)", ORANGE, "s", -0.22),
        ("measured", "measured", BLUE, "o", 0.0),
        ("pyramid", "measured, pyramid added", SKY, "^", 0.22),
    )
    for kind, label, colour, marker, shift in kinds:
        means = [stats.geometric_mean_of_medians(series[key][kind]) for key in keys]
        y = np.array([m.value for m in means])
        error = np.abs(np.array([[m.low for m in means], [m.high for m in means]]) - y)
        x = np.arange(len(keys)) + shift
        ax.errorbar(x, y, error, fmt=marker, ms=6, color=colour, capsize=2, lw=1.2, label=label)
    ax.axhline(1, color="black", lw=1)
    ax.annotate(
        "the hybrid wins above", (1, 1), xycoords=("axes fraction", "data"), xytext=(-2, 3),
        textcoords="offset points", ha="right", va="bottom", fontsize=8, color=GREY,
    )  # fmt: skip
    for k, scene in enumerate(ordered([key[0] for key in keys])):
        places = [i for i, key in enumerate(keys) if key[0] == scene]
        if k:
            ax.axvline(places[0] - 0.5, color="#BBBBBB", lw=0.8)
        ax.text(
            float(np.mean(places)), 1.02, scene, transform=ax.get_xaxis_transform(), ha="center",
            fontweight="bold",
        )  # fmt: skip
    ax.set_xticks(range(len(keys)), [key[1] for key in keys], rotation=35, ha="right")
    ax.set_xlim(-0.6, len(keys) - 0.4)
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, 0.9), max(high, 1.12))
    ax.set_ylabel("T(Embree) / T(hybrid)")
    ax.grid(axis="x", visible=False)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    footer(figure, "Geometric mean over cameras, 95 % bootstrap interval over rounds.")
    return figure


def alpha_by_camera(run: RunData) -> Figure:
    """Return the share of resolved rays of each camera, beside the paper's mean."""
    rows = _largest(run)
    figure = Figure(figsize=(6.6, 1.3 + 0.3 * len(rows)))
    ax = figure.add_subplot()
    scenes = ordered(rows.scene)
    for k, (_, row) in enumerate(rows.iterrows()):
        colour = COLOURS[scenes.index(row.scene) % len(COLOURS)]
        ax.barh(k, row.alpha, color=colour, height=0.66)
        ax.text(row.alpha + 0.006, k, f"{row.alpha:.3f}", va="center", fontsize=9)
    ax.axvline(paper.ALPHA, color="black", lw=1, ls="--")
    ax.text(
        paper.ALPHA, 1.01, f"paper's mean {paper.ALPHA}", transform=ax.get_xaxis_transform(),
        ha="center", va="bottom", fontsize=9,
    )  # fmt: skip
    ax.set_yticks(range(len(rows)), [f"{r.scene}, {r.camera}" for _, r in rows.iterrows()])
    ax.invert_yaxis()
    ax.grid(axis="y", visible=False)
    ax.set_xlim(0, max(0.5, 1.12 * float(rows.alpha.max())))
    ax.set_xlabel("alpha: share of mirror rays that the screen answers")
    return figure


def errors_by_camera(run: RunData) -> Figure:
    """Return the rates of false hits and other errors of each camera, with their intervals."""
    rows = _largest(run)
    figure = Figure(figsize=(6.6, 1.6 + 0.36 * len(rows)))
    ax = figure.add_subplot()
    kinds = (
        ("false_hit", "false hit", ORANGE, "s"),
        ("false_miss", "false miss", PURPLE, "D"),
        ("wrong_primitive", "wrong primitive", BLUE, "o"),
    )
    for number, (kind, label, colour, marker) in enumerate(kinds):
        value = 100 * rows[f"{kind}_rate"].to_numpy(float)
        low, high = (100 * rows[f"{kind}_{end}"].to_numpy(float) for end in ("low", "high"))
        ax.errorbar(
            value, np.arange(len(rows)) + 0.2 * (number - 1),
            xerr=np.clip([value - low, high - value], 0, None),
            fmt=marker, color=colour, ms=5, lw=1.2, capsize=2, label=label,
        )  # fmt: skip
    # Linear about zero, then logarithmic: a rate of exactly zero stays in the picture.
    ax.set_xscale("symlog", linthresh=0.01)
    top = max(10.0, 1.5 * float(np.nanmax(100 * rows.wrong_primitive_rate.to_numpy(float))))
    ax.set_xlim(-0.002, top)
    ticks = [t for t in (0, 0.01, 0.1, 1, 10, 100) if t <= top]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_yticks(range(len(rows)), [f"{r.scene}, {r.camera}" for _, r in rows.iterrows()])
    ax.set_ylim(len(rows) - 0.5, -0.5)
    ax.set_xlabel("% of the rays that the screen answers")
    figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def time_of_stages(run: RunData) -> Figure:
    """Return where the time goes: tracing every ray beside the stages of the hybrid."""
    rows = _largest(run)
    figure = Figure(figsize=(7.2, 1.7 + 0.5 * len(rows)))
    ax = figure.add_subplot()
    parts = (
        ("march_ms", "march", GREEN),
        ("compaction_ms", "compaction", PURPLE),
        ("fallback_ms", "fallback", "#E69F00"),
        ("merge_ms", "merge", SKY),
    )
    for k, (_, row) in enumerate(rows.iterrows()):
        scale = 1e6 / row.rays
        ax.barh(k - 0.19, row.embree_ms * scale, 0.34, color=GREY, label="Embree, every ray")
        left = 0.0
        for column, label, colour in parts:
            ax.barh(k + 0.19, row[column] * scale, 0.34, left=left, color=colour, label=label)
            left += row[column] * scale
    ax.set_yticks(range(len(rows)), [f"{r.scene}, {r.camera}" for _, r in rows.iterrows()])
    ax.invert_yaxis()
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("time a ray, ns (all threads together)")
    handles, labels = ax.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(
        unique.values(), unique.keys(), loc="outside upper center", ncols=5, fontsize=9,
        handlelength=1.2, columnspacing=1.4,
    )  # fmt: skip
    return figure


def _first_technique(run: RunData) -> pd.DataFrame:
    first = str(run.results.technique.iloc[0])
    return run.results[run.results.technique == first]


def _largest(run: RunData) -> pd.DataFrame:
    rows = _first_technique(run)
    rows = rows.assign(pixels=rows.width * rows.height)
    best = rows.groupby(["scene", "camera"]).pixels.transform("max")
    return rows[rows.pixels == best]


def _row_of_axes(figure: Figure, count: int, *, sharey: bool) -> list[Axes]:
    axes: list[Axes] = []
    for k in range(count):
        axes.append(figure.add_subplot(1, count, k + 1, sharey=axes[0] if sharey and k else None))
    for ax in axes[1:]:
        ax.tick_params(labelleft=not sharey)
    return axes


def _plain_log(ax: Axes) -> None:
    ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    ax.yaxis.set_minor_formatter(FuncFormatter(lambda y, _: ""))
