"""What figures have in common: colours, plain axes, footers, how they are saved."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from hybrid_rt_bench.results.folder import RunData

# Okabe and Ito's palette: told apart with every common colour vision.
BLUE, ORANGE, GREEN, SKY, PURPLE, GREY = (
    "#0072B2", "#D55E00", "#009E73", "#56B4E9", "#CC79A7", "#6E6E6E",
)  # fmt: skip
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY)

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
    "figure.constrained_layout.use": True,
}

Draw = Callable[[RunData], Figure]


def save_all(run: RunData, folder: Path, figures: Iterable[tuple[str, Draw]]) -> list[Path]:
    """Draw figures in the common style, write each as ``NAME.png`` and return the paths."""
    written = []
    with mpl.rc_context(STYLE):
        for name, draw in figures:
            path = folder / f"{name}.png"
            draw(run).savefig(path)
            written.append(path)
    return written


def footer(figure: Figure, text: str) -> None:
    """Write a small line at the foot of a figure."""
    figure.supxlabel(text, fontsize=8, color=GREY, x=0.99, ha="right")


def ordered(column: Iterable[Any]) -> list[str]:
    """Return the values of a column as text, each once, in the order in which they come."""
    return [str(value) for value in dict.fromkeys(column)]


def hexadecimal(colour: tuple[int, int, int]) -> str:
    """Return a colour of bytes as matplotlib reads it."""
    return "#{:02X}{:02X}{:02X}".format(*colour)


def reduced(image: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    """Return a picture at most `width` pixels wide; a smaller one is kept as it is."""
    if image.shape[1] <= width:
        return image
    size = (width, round(image.shape[0] * width / image.shape[1]))
    return np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))
