"""Pictures side by side, pixel for pixel, with captions, a legend and scales.

Colours that mean something stand in the picture exactly as in the legend: nothing is blended.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullLocator
from numpy.typing import NDArray
from PIL import Image

from hybrid_rt_bench.report.looks import GREY, rgb
from hybrid_rt_bench.report.style import STYLE, columns_of, wrapped

U8 = NDArray[np.uint8]

DPI = 100
"""Pixels an inch of a sheet: a pixel of a picture is one of the sheet's, or a whole number."""

A_POINT = 110
"""Width of a sheet, pixels, for each point of its text: still read where it fills a page."""

GAP, PAD = 12, 4
"""Between pictures, and between a picture and its caption, pixels."""


@dataclass(frozen=True)
class Scale:
    """What the colours of a picture measure, from `low` to `high`.

    Attributes
    ----------
    label : str
        What is measured, and its unit.
    low, high : float
        Values at the ends; what lies beyond has the colour of the end.
    colours : str
        Name of the colour map, from `low` to `high`.
    logarithmic : bool
        Or linear.
    """

    label: str
    low: float
    high: float
    colours: str
    logarithmic: bool = True

    def norm(self) -> Normalize:
        """Return the norm of the scale."""
        kind = LogNorm if self.logarithmic else Normalize
        return kind(self.low, self.high)

    def painted(self, values: NDArray[Any]) -> U8:
        """Return the colours of values, (..., 3) uint8."""
        painted = mpl.colormaps[self.colours](self.norm()(values), bytes=True)
        return np.asarray(painted[..., :3], np.uint8)


@dataclass(frozen=True)
class Picture:
    """A picture of a sheet.

    Attributes
    ----------
    image : (H, W, 3) uint8
    caption : str
        Printed beneath; may be empty.
    scale : Scale, optional
        Printed beneath the caption.
    """

    image: U8
    caption: str = ""
    scale: Scale | None = None


Entry = tuple[str, str]
"""A colour and what it means."""


def sheet(
    pictures: Sequence[Picture],
    *,
    columns: int = 3,
    title: str = "",
    legend: Sequence[Entry] = (),
    foot: str = "",
    points: float = 0.0,
) -> Figure:
    """Return pictures of one size in lines of at most `columns`.

    Parameters
    ----------
    pictures : sequence of Picture
        All of one size.
    columns : int
    title, foot : str
        Lines above and below.
    legend : sequence of Entry
        Beneath the pictures.
    points : float
        Size of texts; 0 chooses one that suits the width of the sheet.
    """
    height, width = pictures[0].image.shape[:2]
    columns = min(columns, len(pictures))
    total = columns * width + (columns - 1) * GAP
    points = points or max(8.0, total / A_POINT)
    line = 1.35 * points * DPI / 72  # of text, pixels
    beneath = [_beneath(picture, width, points) for picture in pictures]
    groups = [beneath[k : k + columns] for k in range(0, len(beneath), columns)]
    rooms = [max(room for *_, room in group) for group in groups]
    labels = [wrapped(text, (total - 60) / DPI, points) for _, text in legend]
    across = columns_of(labels, total / DPI, points) if legend else 1
    keys = 0
    if legend:
        deepest = max(label.count("\n") + 1 for label in labels)
        keys = round(1.25 * line * deepest * -(-len(legend) // across)) + 2 * PAD
    head_text = wrapped(title, (total - 8) / DPI, points, "bold")
    head = round(line * (head_text.count("\n") + 1)) + 2 * PAD if title else 0
    foot_text = wrapped(foot, (total - 8) / DPI, 0.85 * points)
    below = round(0.9 * line * (foot_text.count("\n") + 1)) + PAD if foot else 0
    # All are whole pixels, so that those of the pictures are those of the sheet.
    tall = head + len(groups) * (height + GAP) - GAP + sum(rooms) + keys + below
    with mpl.rc_context({**STYLE, "figure.constrained_layout.use": False}):
        figure = Figure(figsize=(total / DPI, tall / DPI), dpi=DPI)
        figure.text(PAD / total, 1 - PAD / tall, head_text, va="top", fontsize=points,
                    fontweight="bold")  # fmt: skip
        figure.text(PAD / total, PAD / tall, foot_text, va="bottom", fontsize=0.85 * points,
                    color=GREY)  # fmt: skip
        for k, (picture, (caption, label, _)) in enumerate(zip(pictures, beneath, strict=True)):
            left = (k % columns) * (width + GAP)
            bottom = tall - head - (k // columns) * (height + GAP) - sum(rooms[: k // columns])
            bottom -= height
            ax = figure.add_axes((left / total, bottom / tall, width / total, height / tall))
            ax.imshow(picture.image, interpolation="nearest", aspect="auto")
            ax.set_axis_off()
            figure.text((left + PAD) / total, (bottom - PAD) / tall, caption, va="top",
                        fontsize=points, linespacing=1.15)  # fmt: skip
            if picture.scale:
                under = _lines(caption) * line + PAD if caption else 0.0
                place = (left + 0.08 * width, bottom - under - line, 0.84 * width, 0.6 * line)
                _bar(figure, picture.scale, label, np.divide(place, [total, tall] * 2), points)
        if legend:
            handles = [
                Patch(facecolor=colour, edgecolor="#777777", lw=0.5, label=label)
                for (colour, _), label in zip(legend, labels, strict=True)
            ]
            figure.legend(
                handles=handles, loc="lower left", bbox_to_anchor=(0, below / tall), ncols=across,
                frameon=False, fontsize=points, handlelength=1.3, borderpad=0.3,
                columnspacing=1.4, borderaxespad=0,
            )  # fmt: skip
    return figure


def _lines(text: str) -> int:
    return text.count("\n") + 1


def _beneath(picture: Picture, width: int, points: float) -> tuple[str, str, int]:
    """Return a picture's caption and the label of its scale, broken, and the room for both."""
    line = 1.35 * points * DPI / 72
    caption = wrapped(picture.caption, (width - 8) / DPI, points)
    room = _lines(caption) * line + PAD if caption else 0.0
    label = ""
    if picture.scale:
        label = wrapped(picture.scale.label, (width - 8) / DPI, points)
        # The bar, then ticks and pads, numbers and the label, which are in points.
        room += line + (12 + 1.1 * points + 1.3 * points * _lines(label)) * DPI / 72
    return caption, label, round(room)


def _bar(
    figure: Figure, scale: Scale, label: str, place: NDArray[np.float64], points: float
) -> None:
    """Draw a scale with its numbers and what it measures."""
    ax = figure.add_axes(tuple(place))
    mappable = ScalarMappable(scale.norm(), scale.colours)
    bar = figure.colorbar(mappable, cax=ax, orientation="horizontal", extend="both")
    bar.set_label(label, fontsize=points)
    room = 72 * float(place[2]) * figure.get_figwidth() / (3.2 * points)
    bar.set_ticks(_ticks(scale, max(2, int(room))))
    bar.ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.4g}"))
    bar.ax.xaxis.set_minor_locator(NullLocator())
    bar.ax.tick_params(labelsize=0.9 * points)
    bar.ax.grid(visible=False)


def _ticks(scale: Scale, most: int) -> list[float]:
    """Return at most so many round numbers of a scale, if there are two, else its ends."""
    low, high = scale.low, scale.high
    if scale.logarithmic and high > 3 * low:
        decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        kinds = [
            [step * 10.0**k for k in decades for step in steps]
            for steps in ((1, 2, 5), (1, 3), (1,))
        ]
    else:
        places = (MaxNLocator(n, steps=[1, 2, 5, 10]) for n in (4, 2))
        kinds = [list(locator.tick_values(low, high)) for locator in places]
    for ticks in kinds:
        inside = [tick for tick in ticks if low <= tick <= high]
        if 2 <= len(inside) <= most:
            return inside
    return [low, high]


def pixels(figure: Figure) -> U8:
    """Return a sheet as a picture, (H, W, 3) uint8."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    return np.asarray(Image.open(buffer).convert("RGB"))


def reduced(image: U8, width: int) -> U8:
    """Return a picture at most `width` pixels wide; a smaller one is kept as it is."""
    if image.shape[1] <= width:
        return image
    size = (width, round(image.shape[0] * width / image.shape[1]))
    return np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))


def worst(classes: U8, factor: int, order: Sequence[int]) -> U8:
    """Return a map of classes reduced by a whole factor: of several pixels the worst is kept.

    Parameters
    ----------
    classes : (H, W) uint8
    factor : int
    order : sequence of int
        All classes, the worst last.
    """
    if factor == 1:
        return classes
    rank = np.zeros(max(order) + 1, np.uint8)
    rank[list(order)] = np.arange(len(order))
    highest = _blocks(rank[classes], factor).max(axis=(1, 3))
    return np.asarray(np.array(order, np.uint8)[highest])


def mean(grey: U8, factor: int) -> U8:
    """Return a picture in greys reduced by a whole factor."""
    if factor == 1:
        return grey
    return np.asarray(_blocks(grey, factor).mean(axis=(1, 3)).astype(np.uint8))


def factors(width: int, panel: int) -> tuple[int, int]:
    """Return by which whole factors a picture is reduced, then enlarged, to fit a panel."""
    smaller = -(-width // panel)
    return smaller, max(1, panel // width) if smaller == 1 else 1


def enlarged(image: U8, factor: int) -> U8:
    """Return a picture with every pixel repeated so many times each way."""
    return image.repeat(factor, axis=0).repeat(factor, axis=1)


def squeezed(grey: U8, ends: tuple[int, int]) -> U8:
    """Return greys between two others, so that no colour that means something is one of them."""
    low, high = ends
    scaled = np.round(low + (high - low) / 255 * grey.astype(np.float32)).astype(np.uint8)
    return np.repeat(scaled[..., None], 3, axis=2)


def coloured(image: U8, classes: U8, colours: dict[int, str]) -> U8:
    """Return a picture with the pixels of some classes in their colours, exactly."""
    out = image.copy()
    for number, colour in colours.items():
        out[classes == number] = rgb(colour)
    return out


def _blocks(array: U8, factor: int) -> U8:
    height, width = (n // factor * factor for n in array.shape)
    blocks = (height // factor, factor, width // factor, factor)
    return np.asarray(array[:height, :width].reshape(blocks), np.uint8)
