"""The paper's figure: the main view, and its reflections with what is unresolved and what wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hybrid_rt_bench.kinds.paper.columns import PIXEL_CLASSES
from hybrid_rt_bench.report import sheet
from hybrid_rt_bench.report.looks import GREYS, MIDDLE, VERDICTS
from hybrid_rt_bench.report.scenes import scene_name, scene_notes
from hybrid_rt_bench.report.sheet import Picture
from hybrid_rt_bench.report.style import save
from hybrid_rt_bench.report.table import percent, threads_text
from hybrid_rt_bench.results.folder import RunData

U8 = NDArray[np.uint8]

COLOURS = {
    PIXEL_CLASSES["unresolved"]: VERDICTS["unresolved"],
    PIXEL_CLASSES["wrong"]: VERDICTS["false_hit"],
    PIXEL_CLASSES["background"]: VERDICTS["background"],
}
PANEL = 1280
"""Width of a panel in pixels, at most, and at least half of it."""


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write the paper's figure for every stored picture and technique and return the paths."""
    written = []
    for cell in run.meta["cells"]:
        if "picture" not in cell:
            continue
        with np.load(run.folder / cell["picture"]) as stored:
            arrays = {key: stored[key] for key in stored.files}
        for key in arrays:
            if key.startswith("grey_"):
                technique = key.removeprefix("grey_")
                name = f"{technique}-{cell['scene']}-{cell['camera']}"
                written += save(figure(run, cell, technique, arrays), folder / name, sheet.DPI)
    return written


def reflections(grey: U8, classes: U8) -> U8:
    """Return the picture of the reflections.

    Greys where the screen resolves a ray, and exactly the colours of the legend elsewhere: where
    it does not, where its answer is a false hit or a false miss, where there is no surface.
    """
    return sheet.coloured(sheet.squeezed(grey, GREYS), classes, COLOURS)


def figure(run: RunData, cell: dict[str, Any], technique: str, arrays: dict[str, Any]) -> Figure:
    """Return the main view beside the reflections as a technique answers them."""
    results = run.results
    row = results[
        (results.scene == cell["scene"])
        & (results.camera == cell["camera"])
        & (results.width == cell["width"])
        & (results.height == cell["height"])
        & (results.technique == technique)
    ].iloc[0]
    grey, classes = arrays[f"grey_{technique}"], arrays[f"classes_{technique}"]
    smaller, larger = sheet.factors(grey.shape[1], PANEL)
    order = [PIXEL_CLASSES[name] for name in ("background", "right", "unresolved", "wrong")]
    kept = sheet.worst(classes, smaller, order)
    answered = sheet.enlarged(reflections(sheet.mean(grey, smaller), kept), larger)
    height, width = answered.shape[:2]
    view = arrays["shaded"][: smaller * (height // larger), : smaller * (width // larger)]
    view = sheet.enlarged(sheet.reduced(view, width // larger), larger)
    right = row.resolved - row.wrong_count
    machine = run.meta["environment"]
    return sheet.sheet(
        [
            Picture(
                view, f"(a) {scene_name(run, cell['scene'])}, camera {cell['camera']}, "
                f"{cell['width']}×{cell['height']}",
            ),
            Picture(
                answered, f"(b) mirror reflections, technique {technique}, "
                f"alpha = {row.alpha:.3f}",
            ),
        ],
        legend=(
            (MIDDLE, f"greys: resolved and right {percent(right / row.rays)}"),
            (VERDICTS["unresolved"], f"unresolved {percent(1 - row.alpha)}"),
            (VERDICTS["false_hit"], f"wrong {percent(row.wrong_rate)}"),
            (VERDICTS["background"], "no surface"),
        ),
        foot=" ".join(
            (
                "Shares of all mirror rays of the view.",
                f"{threads_text(machine['threads'])}; {machine['cpu']}.",
                *scene_notes(run, [cell["scene"]]),
            )
        ),
    )  # fmt: skip
