"""Plots of speed against error, on an axis on which zero has a place."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from adjustText import adjust_text
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.judged import bars, tables
from hybrid_rt_bench.judged.columns import CELL, EMBREE, POINT, WRONG
from hybrid_rt_bench.judged.pooling import Pooled, pareto, pools
from hybrid_rt_bench.report.alike import alike
from hybrid_rt_bench.report.looks import GREY, looks
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.style import footer, legend, ordered, panels, save_all, title, told
from hybrid_rt_bench.results.folder import RunData

FRONT = "#C9C9C9"
NAMED_AFTER = 400
"""Steps in which names are moved apart: a number of them and no time, so that equal is equal."""


@dataclass(frozen=True)
class Dot:
    """One point of a technique on a plot.

    Attributes
    ----------
    technique, label : str
    default : bool
    error : Rate
    worth, low, high : float
        The height of the dot and its interval.
    """

    technique: str
    label: str
    default: bool
    error: Rate
    worth: float
    low: float
    high: float


def plots(run: RunData, folder: Path) -> list[Path]:
    """Write every plot of a run into `folder` and return their paths.

    Where nothing was timed there is no speed to be shown.
    """
    of_counts: list[tuple[str, Callable[[RunData], Figure]]] = [
        ("alpha-by-workload", bars.alpha_by_workload)
    ]
    of_times: list[tuple[str, Callable[[RunData], Figure]]] = [
        ("speed-against-error", speed_against_error),
        ("march-rate-against-error", march_rate_against_error),
        ("speed-against-error-by-scene", speed_by_scene),
        ("speedup-by-workload", bars.speedup_by_workload),
    ]
    return save_all(run, folder, of_counts + (of_times if run.results["timed"].any() else []))


def speed_against_error(run: RunData) -> Figure:
    """Return the measured speed-up over the share of wrong answers, all scenes pooled."""
    rows = _shared(run)
    figure, ax = _single("Hybrid: each technique, then Embree for the unresolved rays")
    ax.set_ylabel("measured speed-up over the strongest Embree")
    ax.set_xlabel("wrong answers (false hits and false misses), % of all rays of the hybrid")
    _finish(figure, ax, run, rows, _speedups(run, rows), break_even=True)
    return figure


def march_rate_against_error(run: RunData) -> Figure:
    """Return the speed of the march alone over the share of wrong answers that it gives."""
    rows, dots = _shared(run), []
    for (technique, point), pooled in pools(rows, POINT).items():
        rate = tables.march_rate(technique, pooled)
        dots.append(
            Dot(technique, point, _is_default(pooled), pooled.rate(WRONG), rate, rate, rate)
        )
    figure, ax = _single("Alone: each technique, for the rays that it resolves")
    ax.set_ylabel("Mrays/s, march alone (Embree: every ray traced)")
    ax.set_xlabel("wrong answers (false hits and false misses), % of the resolved rays")
    _finish(figure, ax, run, rows, dots, break_even=False)
    return figure


def speed_by_scene(run: RunData) -> Figure:
    """Return `speed_against_error` for each scene by itself."""
    rows = _shared(run, "scene")
    dots = {scene: _speedups(run, part.rows) for (scene,), part in pools(rows, ["scene"]).items()}
    columns = min(3, len(dots))
    lines = -(-len(dots) // columns)
    figure = Figure(figsize=(3.9 * columns + 2.2 * (columns == 1) + 0.4, 3.5 * lines + 1.6))
    every = [dot for some in dots.values() for dot in some]
    axes = panels(figure, len(dots), columns, sharex=True, sharey=True)
    for ax, (scene, some) in zip(axes, dots.items(), strict=True):
        _draw(ax, some, ordered(run.results["technique"]), break_even=True, small=True,
              scale_of=every)  # fmt: skip
        title(ax, scene_name(run, scene), 3.3, fontweight="bold")
    figure.supylabel("measured speed-up over the strongest Embree", fontsize=11)
    for ax in axes[-columns:]:
        ax.set_xlabel("wrong answers, % of all rays")
    _explain(figure, axes, break_even=True)
    footer(figure, *_signs(every), told(run, rows), *_absent(run, rows, "scene"))
    return figure


def _single(title: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(9.6, 6.6))
    ax = figure.add_subplot()
    ax.set_title(title, loc="left")
    ax.set_title("better: up and to the left", loc="right", fontsize=9, color=GREY)
    return figure, ax


def _finish(
    figure: Figure,
    ax: Axes,
    run: RunData,
    rows: pd.DataFrame,
    dots: Sequence[Dot],
    *,
    break_even: bool,
) -> None:
    """Draw dots with the legend and the footer, then name those of default parameters."""
    _draw(ax, dots, ordered(run.results["technique"]), break_even=break_even)
    _explain(figure, [ax], break_even=break_even)
    footer(figure, *_signs(dots), told(run, rows), *_absent(run, rows))
    _name(figure, ax, dots)


def _shared(run: RunData, group: str = "") -> pd.DataFrame:
    """Return the timed rows of the cells that all points have in common, in each group."""
    rows = tables.timed(run)
    rows = rows.assign(entrant=rows["technique"] + ", " + rows["point"])
    return alike(rows, CELL, [group] if group else [], "entrant")


def _absent(run: RunData, rows: pd.DataFrame, group: str = "") -> list[str]:
    """Return a sentence that names what is left out, as it has no cell in common with the rest."""
    every = tables.timed(run)
    every = every.assign(entrant=every["technique"] + ", " + every["point"])
    parts = ordered(every[group]) if group else [""]
    absent = []
    for part in parts:
        of = rows[rows[group] == part] if group else rows
        lost = [name for name in ordered(every["entrant"]) if name not in set(of["entrant"])]
        absent += [f"{part}, {name}" if part else name for name in lost]
    return [f"Not measured: {'; '.join(absent)}."] if absent else []


def _speedups(run: RunData, rows: pd.DataFrame) -> list[Dot]:
    dots = []
    for (technique, point), pooled in pools(rows, POINT).items():
        speedup = pooled.speedup(run.samples)
        if speedup is not None:
            error = pooled.rate(WRONG, of_all=True)
            values = speedup.value, speedup.low, speedup.high
            dots.append(Dot(technique, point, _is_default(pooled), error, *values))
    return dots


def _draw(
    ax: Axes,
    dots: Sequence[Dot],
    techniques: Sequence[str],
    *,
    break_even: bool,
    small: bool = False,
    scale_of: Sequence[Dot] = (),
) -> None:
    """Draw dots, what no other one beats, and where the hybrid breaks even."""
    _scale(ax, scale_of or dots, small=small)
    if break_even:
        ax.axhline(1, color="black", lw=1.1, zorder=1)
    steps = [dots[k] for k in _front(dots)]
    right = ax.get_xlim()[1]
    ax.step(
        [*(100 * dot.error.value for dot in steps), right],
        [*(dot.worth for dot in steps), steps[-1].worth],
        where="post", color=FRONT, lw=5, solid_joinstyle="miter", zorder=1.5,
    )  # fmt: skip
    look = looks(techniques)
    for technique in dict.fromkeys(dot.technique for dot in dots):
        mine = [dot for dot in dots if dot.technique == technique]
        colour, marker, _ = look[technique]
        x = np.array([100 * dot.error.value for dot in mine])
        y = np.array([dot.worth for dot in mine])
        best = _front(mine)
        if technique != EMBREE:
            ax.plot(x[best], y[best], color=colour, lw=1.5, alpha=0.7, zorder=2)
        ends = [(100 * dot.error.low, 100 * dot.error.high) for dot in mine]
        spread = np.clip(np.abs(np.array(ends).T - x), 0, None)
        tall = np.abs(np.array([(dot.low, dot.high) for dot in mine]).T - y)
        ax.errorbar(x, y, tall, spread, fmt="none", ecolor=colour, lw=1.1, capsize=2, zorder=2.5)
        size = 4.5 if small else 6
        beaten = [k for k in range(len(mine)) if k not in best]
        ax.plot(x[beaten], y[beaten], ls="", marker=marker, ms=size, color=colour, alpha=0.35)
        ax.plot(
            x[best], y[best], ls="", marker=marker, ms=size, color=colour, zorder=3,
            label=technique,
        )  # fmt: skip
        chosen = [k for k, dot in enumerate(mine) if dot.default]
        ax.plot(
            x[chosen], y[chosen], ls="", marker=marker, ms=1.7 * size, color=colour,
            mec="black", mew=1.0, zorder=4,
        )  # fmt: skip


def _front(dots: Sequence[Dot]) -> list[int]:
    return pareto([dot.error.value for dot in dots], [dot.worth for dot in dots])


def _scale(ax: Axes, dots: Sequence[Dot], *, small: bool) -> None:
    """Set the axes: errors linear about zero and logarithmic beyond, so that zero has a place."""
    seen = [100 * dot.error.value for dot in dots if dot.error.count]
    least, most = (min(seen), max(seen)) if seen else (0.01, 1.0)
    first = math.floor(math.log10(least))
    last = max(first + 1, math.ceil(math.log10(most)))
    threshold = 10.0**first
    ax.set_xscale("symlog", linthresh=threshold, linscale=0.9)
    ax.set_xlim(-0.35 * threshold, 1.15 * 10.0**last)
    decades = range(first, last + 1, 2 if small and last - first > 3 else 1)
    ticks = [0.0, *(10.0**k for k in decades)]
    ax.xaxis.set_major_locator(FixedLocator(ticks))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticks(ticks, ["none\nseen", *(_decade(k) for k in decades)])
    ax.axvspan(-0.35 * threshold, 0.35 * threshold, color="#E9F3EC", zorder=0, lw=0)
    ax.set_ylim(0, 1.14 * _top(dots))


def _top(dots: Sequence[Dot]) -> float:
    """Return the height that is shown: of whiskers no more than what leaves dots apart."""
    return max(1.0, min(max(dot.high for dot in dots), 2 * max(dot.worth for dot in dots)))


def _signs(dots: Sequence[Dot]) -> list[str]:
    """Return what the signs say, in sentences."""
    words = [
        "Whiskers: 95 % intervals.",
        "Pareto front: no other point is both faster and less wrong. Pale: another point of the "
        "same technique is.",
    ]
    if max(dot.high for dot in dots) > 1.14 * _top(dots):
        words.append("Whiskers that leave the panel go on beyond it.")
    return words


def _name(figure: Figure, ax: Axes, dots: Sequence[Dot]) -> None:
    """Write each technique's name beside its default dot, clear of dots and other names."""
    FigureCanvasAgg(figure).draw()  # type: ignore[no-untyped-call]
    named = [dot for dot in dots if dot.default or dot.technique == EMBREE]
    look = looks(ordered(dot.technique for dot in dots))
    texts = []
    for dot in named:
        text = f"Embree, {dot.label}" if dot.technique == EMBREE else dot.technique
        place = 100 * dot.error.value
        if dot.error.count == 0:
            # Right of the band of zeros: at the left edge there is no room about a dot.
            place = ax.get_xlim()[0] * -1.1
            text += f"\n0 of {_count(dot.error.total)} (< {100 * dot.error.high:.1e} %)"
        texts.append(
            ax.text(
                place, dot.worth, text, fontsize=10, fontweight="bold", zorder=2.7,
                color=look[dot.technique].colour, linespacing=1.1, in_layout=False,
                bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.8},
            )  # beneath the dots: a name never hides one
        )  # fmt: skip
    adjust_text(
        texts, [100 * dot.error.value for dot in dots], [dot.worth for dot in dots], ax=ax,
        target_x=[100 * dot.error.value for dot in named], target_y=[dot.worth for dot in named],
        expand=(1.12, 1.35), force_text=(0.4, 0.6), force_static=(0.5, 0.9), min_arrow_len=12,
        iter_lim=NAMED_AFTER,
        arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.7},
    )  # fmt: skip


def _explain(figure: Figure, axes: Iterable[Axes], *, break_even: bool) -> None:
    """Put the legend of techniques and of the signs above the panels."""
    found: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    sign: dict[str, Any] = {"color": GREY, "ls": "", "marker": "o"}
    found |= {
        "ringed: default parameters": Line2D([], [], ms=9, mec="black", **sign),
        "pale: beaten": Line2D([], [], ms=6, alpha=0.35, **sign),
        "Pareto front": Line2D([], [], color=FRONT, lw=5),
    }
    if break_even:
        found["as fast as Embree"] = Line2D([], [], color="black", lw=1.1)
    legend(figure, list(found.values()), list(found), fontsize=9)


def _is_default(pooled: Pooled) -> bool:
    return bool(pooled.rows["default"].iloc[0])


def _decade(k: int) -> str:
    return f"{10.0**k:g}" if k >= -3 else f"$10^{{{k}}}$"


def _count(n: int) -> str:
    for size, word in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if n >= size:
            return f"{n / size:.3g} {word}"
    return str(n)
