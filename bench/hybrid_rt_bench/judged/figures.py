"""Plots of speed against error, on an axis on which zero has a place."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator
from matplotlib.transforms import Bbox

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.judged import tables
from hybrid_rt_bench.judged.columns import EMBREE, POINT, WRONG
from hybrid_rt_bench.judged.pooling import Pooled, pareto, pools
from hybrid_rt_bench.report.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, footer, save_all
from hybrid_rt_bench.results.folder import RunData

LOOKS = {
    "certified": (BLUE, "o"),
    "paper": (ORANGE, "s"),
    "slope": (GREEN, "^"),
    "hiz": (PURPLE, "D"),
    "dda": (SKY, "v"),
    "linear": ("#B8860B", "P"),
    EMBREE: ("#222222", "*"),
}
"""Colour and marker of each technique, the same in every figure."""
SPARE = ((GREY, "X"), ("#8C564B", "<"), ("#17A2A2", ">"))


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
    """Write every plot of a run into `folder` and return their paths."""
    return save_all(
        run,
        folder,
        (
            ("speed-against-error", speed_against_error),
            ("march-rate-against-error", march_rate_against_error),
            ("speed-against-error-by-scene", speed_by_scene),
            ("alpha-by-workload", alpha_by_workload),
            ("speedup-by-workload", speedup_by_workload),
        ),
    )


def speed_against_error(run: RunData) -> Figure:
    """Return the measured speed-up over the share of wrong answers, all scenes pooled."""
    figure = Figure(figsize=(9.6, 6.2))
    ax = figure.add_subplot()
    _draw(figure, ax, _speedups(run, tables.shared(run)), break_even=True)
    ax.set_ylabel("measured speed-up over the strongest Embree")
    ax.set_xlabel("wrong answers (false hits and false misses), % of all rays of the hybrid")
    ax.set_title("Hybrid: each technique, then Embree for what it leaves open", loc="left")
    _footer(figure, run)
    return figure


def march_rate_against_error(run: RunData) -> Figure:
    """Return the speed of the march alone over the share of wrong answers that it gives."""
    dots = []
    for (technique, point), pooled in pools(tables.shared(run), POINT).items():
        rate = tables.march_rate(technique, pooled)
        dots.append(
            Dot(technique, point, _is_default(pooled), pooled.rate(WRONG), rate, rate, rate)
        )
    figure = Figure(figsize=(9.6, 6.2))
    ax = figure.add_subplot()
    _draw(figure, ax, dots, break_even=False)
    ax.set_ylabel("Mrays/s, march alone (Embree: every ray traced)")
    ax.set_xlabel("wrong answers (false hits and false misses), % of the answers given")
    ax.set_title("Alone: each technique, for the rays that it answers", loc="left")
    _footer(figure, run)
    return figure


def speed_by_scene(run: RunData) -> Figure:
    """Return `speed_against_error` for each scene by itself."""
    parts = pools(tables.shared(run), ["scene"])
    columns = min(3, len(parts))
    lines = -(-len(parts) // columns)
    figure = Figure(figsize=(4.6 * columns + 0.4, 3.9 * lines + 0.9))
    dots = {scene: _speedups(run, part.rows) for (scene,), part in parts.items()}
    every = [dot for some in dots.values() for dot in some]
    axes: list[Axes] = []
    for number, (scene, some) in enumerate(dots.items()):
        first = axes[0] if axes else None
        ax = figure.add_subplot(lines, columns, number + 1, sharex=first, sharey=first)
        _draw(figure, ax, some, break_even=True, small=True, scale_of=every)
        ax.set_title(scene, loc="left", fontweight="bold")
        axes.append(ax)
    figure.supylabel("measured speed-up", fontsize=11)
    figure.supxlabel("wrong answers, % of all rays of the hybrid", fontsize=11)
    handles, labels = axes[0].get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(
        unique.values(), unique.keys(), loc="outside upper center", ncols=min(8, len(unique)),
        fontsize=11,
    )  # fmt: skip
    return figure


def alpha_by_workload(run: RunData) -> Figure:
    """Return the share of answered rays for each kind of rays and technique."""
    return _bars(
        run,
        "alpha: share of rays that the screen answers",
        lambda pooled: (pooled.alpha, pooled.alpha, pooled.alpha),
    )


def speedup_by_workload(run: RunData) -> Figure:
    """Return the measured speed-up for each kind of rays and technique."""

    def height(pooled: Pooled) -> tuple[float, float, float]:
        speedup = pooled.speedup(run.samples)
        if speedup is None:
            return (math.nan,) * 3
        return speedup.value, speedup.low, speedup.high

    figure = _bars(run, "measured speed-up over the strongest Embree", height)
    ax = figure.axes[0]
    ax.axhline(1, color="black", lw=1.2)
    ax.set_ylim(0, max(1.1, ax.get_ylim()[1]))
    ax.annotate(
        "pays above", (1, 1), xycoords=("axes fraction", "data"), xytext=(0, 3),
        textcoords="offset points", ha="right", fontsize=9, color=GREY,
    )  # fmt: skip
    return figure


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
    figure: Figure,
    ax: Axes,
    dots: Sequence[Dot],
    *,
    break_even: bool,
    small: bool = False,
    scale_of: Sequence[Dot] = (),
) -> None:
    """Draw dots, their front, what is better and, over each technique's best dot, its name."""
    _scale(ax, scale_of or dots, small=small)
    if break_even:
        ax.axhline(1, color="black", lw=1.1, zorder=1)
    steps = [dots[k] for k in _front(dots)]
    right = ax.get_xlim()[1]
    ax.step(
        [*(100 * dot.error.value for dot in steps), right],
        [*(dot.worth for dot in steps), steps[-1].worth],
        where="post", color="#C9C9C9", lw=5, solid_joinstyle="miter", zorder=1.5,
        label="Pareto front: nothing is both faster and less wrong",
    )  # fmt: skip
    for technique in dict.fromkeys(dot.technique for dot in dots):
        mine = [dot for dot in dots if dot.technique == technique]
        colour, marker = _look(technique, [dot.technique for dot in dots])
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
    if not small:
        _hints(ax)
        _name(figure, ax, dots, break_even=break_even)


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
    decades = range(first, last + 1, 2 if small and last - first > 4 else 1)
    ticks = [0.0, *(10.0**k for k in decades)]
    ax.xaxis.set_major_locator(FixedLocator(ticks))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticklabels(["none\nseen", *(_decade(k) for k in decades)])
    ax.axvspan(-0.35 * threshold, 0.35 * threshold, color="#E9F3EC", zorder=0, lw=0)
    top = max([dot.high for dot in dots] or [1.0])
    ax.set_ylim(0, 1.14 * max(top, 1.0))


def _name(figure: Figure, ax: Axes, dots: Sequence[Dot], *, break_even: bool) -> None:
    """Write each technique's name beside its default dot, clear of dots and other names."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    renderer = canvas.get_renderer()  # type: ignore[no-untyped-call]
    taken = _drawn(ax, dots) + [note.get_window_extent(renderer) for note in ax.texts]
    legend = ax.get_legend()
    if legend is not None:
        taken.append(legend.get_window_extent(renderer))
    offsets = [
        (dx * reach, dy * reach)
        for reach in (1, 1.5, 2.2, 3.2, 4.5)
        for dx, dy in ((10, 8), (10, -8), (-10, 8), (-10, -8), (0, 13), (0, -13))
    ]
    techniques = [dot.technique for dot in dots]
    for dot in dots:
        if not dot.default and dot.technique != EMBREE:
            continue
        text = f"Embree, {dot.label}" if dot.technique == EMBREE else dot.technique
        if dot.error.count == 0:
            text += f"\n0 of {_count(dot.error.total)} (< {100 * dot.error.high:.1e} %)"
        colour, _ = _look(dot.technique, techniques)
        best = None
        for dx, dy in offsets:
            note = ax.annotate(
                text, (100 * dot.error.value, dot.worth), xytext=(dx, dy),
                textcoords="offset points", fontsize=10.5, color=colour, fontweight="bold",
                ha="left" if dx > 0 else "right" if dx < 0 else "center",
                va="bottom" if dy > 0 else "top", zorder=5, linespacing=1.1,
                bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75},
            )  # fmt: skip
            box = note.get_window_extent(renderer)
            inside = ax.bbox.x0 <= box.x0 and box.x1 <= ax.bbox.x1
            inside = inside and ax.bbox.y0 <= box.y0 and box.y1 <= ax.bbox.y1
            clashes = sum(box.overlaps(other) for other in taken) + (0 if inside else 100)
            note.remove()
            if best is None or clashes < best[0]:
                best = clashes, note, box
            if clashes == 0:
                break
        if best is not None:
            ax.add_artist(best[1])
            taken.append(best[2])
    if break_even:
        notes = []
        for above, place in product((True, False), np.linspace(0.995, 0.3, 29)):
            note = ax.annotate(
                "as fast as the strongest Embree", (place, 1), xycoords=("axes fraction", "data"),
                xytext=(0, 3 if above else -3), textcoords="offset points", ha="right",
                va="bottom" if above else "top", fontsize=9,
            )  # fmt: skip
            box = note.get_window_extent(renderer)
            notes.append((sum(box.overlaps(other) for other in taken), note))
            note.remove()
        ax.add_artist(min(notes, key=lambda found: found[0])[1])


def _drawn(ax: Axes, dots: Sequence[Dot]) -> list[Bbox]:
    """Return boxes, in pixels, over the dots, their error bars and the lines that join them."""
    lines = [((100 * dot.error.low, dot.worth), (100 * dot.error.high, dot.worth)) for dot in dots]
    lines += [((100 * dot.error.value, dot.low), (100 * dot.error.value, dot.high)) for dot in dots]
    for technique in dict.fromkeys(dot.technique for dot in dots if dot.technique != EMBREE):
        mine = [dot for dot in dots if dot.technique == technique]
        places = [(100 * mine[k].error.value, mine[k].worth) for k in _front(mine)]
        lines += pairwise(places)
    boxes = []
    for dot in dots:
        x, y = ax.transData.transform((100 * dot.error.value, dot.worth))
        boxes.append(Bbox.from_extents(x - 8, y - 8, x + 8, y + 8))
    for ends in lines:
        (x0, y0), (x1, y1) = ax.transData.transform(ends)
        for share in np.linspace(0, 1, 2 + int(math.hypot(x1 - x0, y1 - y0) / 6)):
            x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
            boxes.append(Bbox.from_extents(x - 1, y - 1, x + 1, y + 1))
    return boxes


def _hints(ax: Axes) -> None:
    """Say which way is better and what the grey line is."""
    ax.annotate(
        "better", (0.985, 0.965), xycoords="axes fraction", ha="right", va="top", fontsize=11,
        color=GREY,
    )  # fmt: skip
    ax.annotate(
        "", (0.885, 0.985), (0.925, 0.925), xycoords="axes fraction",
        arrowprops={"arrowstyle": "-|>", "color": GREY, "lw": 2},
    )  # fmt: skip
    handles, labels = ax.get_legend_handles_labels()
    front = [k for k, label in enumerate(labels) if label.startswith("Pareto")]
    ax.legend([handles[k] for k in front], [labels[k] for k in front], loc="lower right")


def _bars(
    run: RunData, label: str, height: Callable[[Pooled], tuple[float, float, float]]
) -> Figure:
    """Return grouped bars: workloads along the axis, the techniques' default points in each."""
    rows = tables.defaults(tables.timed(run))
    rows = rows[rows.technique != EMBREE]
    pooled = pools(rows, ["workload", "technique"])
    workloads = list(dict.fromkeys(key[0] for key in pooled))
    techniques = list(dict.fromkeys(key[1] for key in pooled))
    figure = Figure(figsize=(max(6.4, 2.2 + 1.35 * len(workloads)), 4.4))
    ax = figure.add_subplot()
    width = 0.84 / len(techniques)
    for k, technique in enumerate(techniques):
        values = np.array(
            [
                height(pooled[w, technique]) if (w, technique) in pooled else (math.nan,) * 3
                for w in workloads
            ]
        )
        x = np.arange(len(workloads)) + (k - (len(techniques) - 1) / 2) * width
        colour, _ = _look(technique, techniques)
        ax.bar(x, values[:, 0], 0.92 * width, color=colour, label=technique)
        spread = np.abs(values[:, 1:].T - values[:, 0])
        if np.nanmax(spread, initial=0) > 0:
            ax.errorbar(x, values[:, 0], spread, fmt="none", ecolor="black", lw=1, capsize=1.5)
    ax.set_xticks(range(len(workloads)), [w.replace("_", "\n") for w in workloads])
    ax.grid(axis="x", visible=False)
    ax.set_ylabel(label)
    figure.legend(
        *ax.get_legend_handles_labels(), loc="outside upper center", ncols=len(techniques)
    )
    _footer(figure, run)
    return figure


def _look(technique: str, techniques: Sequence[str]) -> tuple[str, str]:
    if technique in LOOKS:
        return LOOKS[technique]
    others = [name for name in dict.fromkeys(techniques) if name not in LOOKS]
    return SPARE[others.index(technique) % len(SPARE)]


def _is_default(pooled: Pooled) -> bool:
    return bool(pooled.rows.default.iloc[0])


def _decade(k: int) -> str:
    return f"{10.0**k:g}" if k >= -3 else f"$10^{{{k}}}$"


def _count(n: int) -> str:
    for size, word in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if n >= size:
            return f"{n / size:.3g} {word}"
    return str(n)


def _footer(figure: Figure, run: RunData) -> None:
    rows = tables.timed(run)
    scenes = ", ".join(dict.fromkeys(rows.scene))
    machine = run.meta["environment"]
    text = f"{scenes}; {machine['threads']} threads, {machine['cpu']}. Whiskers: 95 % intervals."
    footer(figure, text)
