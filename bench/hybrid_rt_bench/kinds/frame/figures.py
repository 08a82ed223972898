"""The pictures of a run of kind "frame": how each technique's marches ended, and what is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image

from hybrid_rt_bench.judged.columns import MAP_CLASSES
from hybrid_rt_bench.judged.maps import error_map
from hybrid_rt_bench.kinds.frame.columns import NOWHERE
from hybrid_rt_bench.report.table import number
from hybrid_rt_bench.results.folder import RunData

U8 = NDArray[np.uint8]

STATUSES = {
    "HIT": "#C8C8C8",
    "MISS": "#56B4E9",
    "OFFSCREEN": "#E69F00",
    "HIDDEN": "#0072B2",
    "NEAR": "#009E73",
    "EXHAUSTED": "#CC79A7",
    "INVALID": "#D55E00",
    "UNDECIDED": "#F0E442",
    "SKIPPED": "#000000",
}
"""The colour of each `MarchStatus`, in its order."""
WIDEST, NARROWEST = 900, 300
"""Pixels of a picture on a sheet, across."""
DPI, TEXT, LINE = 100, 10.0, 19
"""Of a sheet: pixels per inch, size of texts in points, pixels of a line."""


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write a map of statuses for each technique, a sheet of them and, if judged, one of errors."""
    written = []
    for cell in run.meta["cells"]:
        if "picture" not in cell:
            continue
        with np.load(run.folder / cell["picture"]) as stored:
            arrays = {key: stored[key] for key in stored.files}
        rows = run.results[run.results.workload == cell["workload"]].set_index("technique")
        title = f"{cell['scene']}, {cell['width']}x{cell['height']}, {cell['workload']} rays"
        statuses = _named(arrays, "status_")
        maps = folder / "statuses"
        maps.mkdir(exist_ok=True)
        for name, status in statuses.items():
            Image.fromarray(status_map(status)).save(maps / f"{name}.png")
        written.append(maps)
        present = np.unique(np.concatenate([s.ravel() for s in statuses.values()]))
        pictures = {
            f"{name}: answers {100 * rows.alpha[name]:.1f} % of the rays": status_map(status)
            for name, status in statuses.items()
        }
        legend = {name.lower(): STATUSES[name] for k, name in enumerate(STATUSES) if k in present}
        sheet = _sheet(f"{title}: how the marches ended", pictures, legend | {"no ray": "#FFFFFF"})
        written.append(_saved(sheet, folder / "statuses.png"))
        classes = _named(arrays, "classes_")
        if classes:
            pictures = {
                _wrong(rows, name): error_map(arrays["grey"], c) for name, c in classes.items()
            }
            sheet = _sheet(f"{title}: where answers are wrong", pictures, _errors(arrays["grey"]))
            written.append(_saved(sheet, folder / "errors.png"))
    return written


def status_map(status: U8) -> U8:
    """Return the statuses of rays, (H, W), in their colours; white where no ray starts."""
    palette = np.full((256, 3), 255, np.uint8)
    for k, colour in enumerate(STATUSES.values()):
        palette[k] = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    palette[NOWHERE] = 255
    return palette[status]


def _named(arrays: dict[str, U8], prefix: str) -> dict[str, U8]:
    return {k.removeprefix(prefix): a for k, a in arrays.items() if k.startswith(prefix)}


def _wrong(rows: Any, name: str) -> str:
    row = rows.loc[name]
    wrong = f"{number(100 * row.wrong_rate)} %" if row.resolved else "none"
    return f"{name}: of {int(row.resolved):,} answers {wrong} wrong"


def _errors(grey: U8) -> dict[str, str]:
    """Return the legend of a map of errors, with the colours as that draws them."""
    words = {
        "false_hit": "false hit", "false_miss": "false miss", "wrong_primitive": "wrong primitive",
        "unresolved": "not answered by the screen", "background": "no ray",
    }  # fmt: skip
    middle = np.full((1, 1), int(np.median(grey)), np.uint8)
    found = {}
    for name, text in words.items():
        pixel = error_map(middle, np.full((1, 1), MAP_CLASSES[name], np.uint8))[0, 0]
        found[text] = "#{:02X}{:02X}{:02X}".format(*(int(k) for k in pixel))
    return found


def _sheet(title: str, pictures: dict[str, U8], legend: dict[str, str]) -> Figure:
    """Return pictures of one size side by side, captions beneath, a legend at the foot."""
    shown = {caption: _fitted(image) for caption, image in pictures.items()}
    height, width = next(iter(shown.values())).shape[:2]
    columns = min(3 if width < 500 else 2, len(shown))
    lines = -(-len(shown) // columns)
    gap, head, foot = 12, 2 * LINE, 2 * LINE
    total_w = columns * width + (columns - 1) * gap
    entries = max(1, total_w // 190)
    foot += LINE * -(-len(legend) // entries)
    total_h = head + lines * (height + 2 * LINE) + foot
    figure = Figure(figsize=(total_w / DPI, total_h / DPI), dpi=DPI)
    figure.text(
        4 / total_w, 1 - 5 / total_h, title, va="top", fontsize=1.1 * TEXT, fontweight="bold"
    )
    for k, (caption, image) in enumerate(shown.items()):
        left, top = (k % columns) * (width + gap), head + (k // columns) * (height + 2 * LINE)
        ax = figure.add_axes(
            (left / total_w, 1 - (top + height) / total_h, width / total_w, height / total_h)
        )
        ax.imshow(image, interpolation="nearest", aspect="auto")
        ax.set_axis_off()
        below = 1 - (top + height + 4) / total_h
        figure.text((left + 4) / total_w, below, caption, va="top", fontsize=TEXT)
    figure.legend(
        handles=[
            Patch(facecolor=colour, edgecolor="#777777", lw=0.5, label=text)
            for text, colour in legend.items()
        ],
        loc="lower left", ncols=entries, frameon=False, fontsize=TEXT, handlelength=1.3,
    )  # fmt: skip
    return figure


def _fitted(image: U8) -> U8:
    """Return a picture with each pixel kept or repeated a whole number of times, or reduced."""
    width = image.shape[1]
    if width > WIDEST:
        return np.asarray(image[:: -(-width // WIDEST), :: -(-width // WIDEST)])
    times = max(1, NARROWEST // width)
    return image.repeat(times, axis=0).repeat(times, axis=1)


def _saved(figure: Figure, path: Path) -> Path:
    figure.savefig(path, dpi=DPI)
    return path
