"""What figures have in common: plain axes, texts that fit, footers, how they are saved."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextToPath
from matplotlib.ticker import FuncFormatter, LogLocator

from hybrid_rt_bench.report.looks import GREY
from hybrid_rt_bench.report.scenes import scene_name, scene_notes
from hybrid_rt_bench.report.table import threads_text
from hybrid_rt_bench.results.folder import RunData

STYLE: dict[Any, Any] = {
    "figure.dpi": 100,
    "savefig.dpi": 160,
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.8,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "hatch.linewidth": 0.6,
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.w_pad": 0.08,
    # Text stays text, and the names of things in the file do not change from run to run.
    "svg.fonttype": "none",
    "svg.hashsalt": "hybrid-rt",
}

FORMATS: dict[str, dict[str, Any]] = {
    "png": {"metadata": {"Software": None}},
    "svg": {"metadata": {"Date": None, "Creator": None}},
}
"""What every figure is written as; without a date or a version, so that equal is equal."""

SMALL = 8.0
"""Size of footers and notes, points."""

Draw = Callable[[RunData], Figure]


def save_all(run: RunData, folder: Path, figures: Iterable[tuple[str, Draw]]) -> list[Path]:
    """Draw figures in the common style, write each by `save` and return the paths."""
    written = []
    with mpl.rc_context(STYLE):
        for name, draw in figures:
            written += save(draw(run), folder / name)
    return written


def save(figure: Figure, stem: Path, dpi: float | None = None) -> list[Path]:
    """Write a figure as ``STEM.png`` and ``STEM.svg`` and return both paths.

    The same figure gives the same bytes.

    Parameters
    ----------
    figure : Figure
    stem : Path
        The files' path without an ending.
    dpi : float, optional
        Pixels an inch; default: those of the style.
    """
    written = []
    # How it is laid out is the figure's own matter.
    style = {key: value for key, value in STYLE.items() if "layout" not in key}
    with mpl.rc_context(style):
        for ending, options in FORMATS.items():
            path = stem.with_name(f"{stem.name}.{ending}")
            figure.savefig(path, dpi=dpi or STYLE["savefig.dpi"], **options)
            written.append(path)
    return written


def footer(figure: Figure, *sentences: str) -> None:
    """Write small lines at the foot of a figure, broken where they would be wider than it."""
    text = wrapped(" ".join(sentences), 0.95 * figure.get_figwidth(), SMALL)
    figure.supxlabel(text, fontsize=SMALL, color=GREY, x=0.01, ha="left", ma="left")


def told(run: RunData, rows: pd.DataFrame) -> str:
    """Return what rows are of: scenes, views, resolutions, threads, processor; notes of scenes."""
    views = rows[["scene", "camera"]].drop_duplicates()
    machine = run.meta["environment"]
    counts = rows["threads"].unique().tolist() if "threads" in rows else [machine["threads"]]
    threads = threads_text(int(counts[0])) if len(counts) == 1 else "threads as said"
    scenes = ordered(rows["scene"])
    sentence = (
        f"{', '.join(scene_name(run, scene) for scene in scenes)}; "
        f"{len(views)} view{'s' if len(views) != 1 else ''}; {', '.join(resolutions(rows))}; "
        f"{threads}; {machine['cpu']}."
    )
    return " ".join((sentence, *scene_notes(run, scenes)))


def resolutions(rows: pd.DataFrame) -> list[str]:
    """Return the resolutions of rows as ``W×H``, the smallest first."""
    sizes = {(int(w), int(h)) for w, h in zip(rows["width"], rows["height"], strict=True)}
    return [f"{w}×{h}" for w, h in sorted(sizes, key=lambda size: size[0] * size[1])]


def ordered(column: Iterable[Any]) -> list[str]:
    """Return the values of a column as text, each once, in the order in which they come."""
    return [str(value) for value in dict.fromkeys(column)]


def wide(text: str, points: float, weight: str = "normal") -> float:
    """Return how wide a line is, in inches."""
    font = FontProperties(size=points, weight=weight)
    return float(TextToPath().get_text_width_height_descent(text, font, ismath=False)[0]) / 72


def wrapped(text: str, inches: float, points: float, weight: str = "normal") -> str:
    """Return a text broken into lines of that width: at spaces, after - and _, else in words."""
    count = len(text)
    while count > 1:
        lines = [
            line
            for part in text.split("\n")
            for line in textwrap.wrap(part.replace("_", "_ "), count) or [""]
        ]
        # A little less, as what is drawn is fitted to pixels.
        if all(wide(line, points, weight) <= 0.96 * inches for line in lines):
            break
        count = min(count - 1, max(len(line) for line in lines) - 1)
    else:
        lines = list(text)
    return "\n".join(lines).replace("_ ", "_")


def title(ax: Axes, text: str, inches: float, **how: Any) -> None:
    """Write a panel's title, broken into lines of that width."""
    points = float(STYLE["axes.titlesize"])
    ax.set_title(wrapped(text, inches, points, how.get("fontweight", "normal")), **how)


def columns_of(labels: Sequence[str], inches: float, points: float = 10.0) -> int:
    """Return how many columns a legend of these labels may have to be no wider than that."""
    widest = max(
        (wide(line, points) for label in labels for line in label.split("\n")), default=0.0
    )
    a_column = widest + points * 4.4 / 72  # handle, its pad, the space between columns
    return max(1, min(len(labels), int((inches - 2 * points / 72) / a_column)))


def legend(figure: Figure, handles: Sequence[Any], labels: Sequence[str], **how: Any) -> None:
    """Put one legend above the panels, each label once, in as many columns as there is room for."""
    unique = dict(zip(labels, handles, strict=True))
    points = float(how.get("fontsize", STYLE["font.size"]))
    columns = columns_of(list(unique), figure.get_figwidth(), points)
    options = {"loc": "outside upper center", "ncols": columns, **how}
    figure.legend(list(unique.values()), list(unique), **options)


def panels(figure: Figure, count: int, columns: int, **share: Any) -> list[Axes]:
    """Return panels in lines of at most so many; the outer ones alone have labels if shared."""
    columns = min(columns, count)
    lines = -(-count // columns)
    grid: Any = figure.subplots(lines, columns, squeeze=False, **share)
    axes = list(grid.flat)
    for ax in axes[count:]:
        ax.remove()
    for k, ax in enumerate(axes[:count]):
        if k + columns >= count:  # nothing stands below it
            ax.tick_params(labelbottom=True)
    return axes[:count]


def plain_log(ax: Axes) -> None:
    """Write the numbers of a logarithmic upright axis without exponents.

    Where it spans little, numbers between the decades are named too.
    """
    low, high = ax.get_ylim()
    ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:,.10g}"))
    if high / low < 300:
        ax.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0) if high / low > 4 else "all"))
        ax.yaxis.set_minor_formatter(FuncFormatter(lambda y, _: f"{y:,.10g}"))
        ax.tick_params(axis="y", which="minor", labelsize=8.5)
    else:
        ax.yaxis.set_minor_formatter(FuncFormatter(lambda y, _: ""))
