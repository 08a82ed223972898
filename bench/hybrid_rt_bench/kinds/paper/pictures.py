"""The paper's figure: the main view, and its reflections with what is unresolved and what wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hybrid_rt_bench.kinds.paper.columns import PIXEL_CLASSES
from hybrid_rt_bench.report.style import hexadecimal, reduced
from hybrid_rt_bench.report.table import percent
from hybrid_rt_bench.results.folder import RunData

UNRESOLVED = (44, 98, 184)
WRONG = (226, 26, 28)
BACKGROUND = (250, 240, 215)
PANEL = 1280
"""Width of a panel in pixels; a larger picture is reduced to it, a smaller one kept."""


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write the paper's figure for every stored picture and return the paths."""
    written = []
    for cell in run.meta["cells"]:
        if "picture" not in cell:
            continue
        with np.load(run.folder / cell["picture"]) as stored:
            arrays = {key: stored[key] for key in stored.files}
        for key in arrays:
            if key.startswith("grey_"):
                technique = key.removeprefix("grey_")
                path = folder / f"{technique}-{cell['scene']}-{cell['camera']}.png"
                _figure(run, cell, technique, arrays).savefig(path, dpi=100)
                written.append(path)
    return written


def reflections(grey: NDArray[np.uint8], classes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the picture of the reflections.

    Greys where the screen answered, blue where it did not, red where its answer is a false hit or a
    false miss, cream where there is no surface. Blue lets a little of the reflection's light
    through, so that the place is still recognised.
    """
    image = np.repeat(grey[..., None], 3, axis=2)
    light = 0.55 + 0.45 * (grey.astype(np.float32) / 255)
    blue = light[..., None] * np.array(UNRESOLVED, np.float32)
    unresolved = classes == PIXEL_CLASSES["unresolved"]
    image[unresolved] = blue[unresolved].astype(np.uint8)
    image[classes == PIXEL_CLASSES["wrong"]] = WRONG
    image[classes == PIXEL_CLASSES["background"]] = BACKGROUND
    return image


def _figure(run: RunData, cell: dict[str, Any], technique: str, arrays: dict[str, Any]) -> Figure:
    results = run.results
    row = results[
        (results.scene == cell["scene"])
        & (results.camera == cell["camera"])
        & (results.width == cell["width"])
        & (results.height == cell["height"])
        & (results.technique == technique)
    ].iloc[0]
    panels = [
        reduced(arrays["shaded"], PANEL),
        reduced(reflections(arrays[f"grey_{technique}"], arrays[f"classes_{technique}"]), PANEL),
    ]
    height, width = panels[0].shape[:2]
    text = max(9.0, width / 72)  # points
    gap, foot = 12, round(4.9 * text)
    figure = Figure(figsize=((2 * width + gap) / 100, (height + foot) / 100), dpi=100)
    total_w, total_h = 2 * width + gap, height + foot
    for k, panel in enumerate(panels):
        ax = figure.add_axes(
            ((width + gap) * k / total_w, foot / total_h, width / total_w, height / total_h)
        )
        ax.imshow(panel, interpolation="nearest", aspect="auto")
        ax.set_axis_off()
    captions = (
        f"(a) {cell['scene']}, camera {cell['camera']}, {cell['width']}×{cell['height']}",
        f"(b) mirror reflections, mode {technique!r}, alpha = {row.alpha:.3f}",
    )
    for k, caption in enumerate(captions):
        x = (width + gap) * k / total_w
        figure.text(x + 0.004, (foot - 0.4 * text) / total_h, caption, va="top", fontsize=text)
    right = row.resolved - row.wrong_count
    labels = (
        ("#9A9A9A", f"answered by the screen {percent(right / row.rays)}"),
        (hexadecimal(UNRESOLVED), f"unresolved {percent(1 - row.alpha)}"),
        (hexadecimal(WRONG), f"wrong {percent(row.wrong_rate)}"),
        (hexadecimal(BACKGROUND), "no surface"),
    )
    figure.legend(
        handles=[Patch(facecolor=c, edgecolor="#777777", lw=0.5, label=t) for c, t in labels],
        loc="lower left",
        bbox_to_anchor=((width + gap) / total_w - 0.002, 0.0),
        ncols=4,
        frameon=False,
        fontsize=0.92 * text,
        handlelength=1.2,
        columnspacing=1.2,
        borderpad=0.3,
    )
    return figure
