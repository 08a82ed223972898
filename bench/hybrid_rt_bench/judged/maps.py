"""Maps of where each technique's answers are wrong, over the reflections in grey."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image

from hybrid_rt_bench.judged.columns import MAP_CLASSES, WRONG
from hybrid_rt_bench.judged.pooling import Pooled
from hybrid_rt_bench.judged.tables import defaults
from hybrid_rt_bench.report.style import hexadecimal
from hybrid_rt_bench.report.table import number
from hybrid_rt_bench.results.folder import RunData

U8 = NDArray[np.uint8]

COLOURS = {
    "background": (250, 240, 215),
    "unresolved": (70, 110, 170),
    "false_hit": (226, 26, 28),
    "false_miss": (255, 0, 220),
    "wrong_primitive": (255, 196, 0),
}
PANEL = 800
"""Width of a panel of a sheet in pixels, at most, and at least half of it."""


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write a map for each technique and view, and a sheet of them for each view.

    Of the maps by themselves, only the folders are returned.
    """
    written = []
    for cell in run.meta["cells"]:
        if "picture" not in cell:
            continue
        with np.load(run.folder / cell["picture"]) as stored:
            arrays = {key: stored[key] for key in stored.files}
        view = f"{cell['scene']}-{cell['camera']}"
        classes = {
            key.removeprefix("classes_"): array
            for key, array in arrays.items()
            if key.startswith("classes_")
        }
        maps = folder / "maps" / view
        maps.mkdir(parents=True, exist_ok=True)
        for technique, kinds in classes.items():
            Image.fromarray(error_map(arrays["grey"], kinds)).save(maps / f"{technique}.png")
        written.append(maps)
        path = folder / f"errors-{view}.png"
        _sheet(run, cell, arrays["grey"], classes).savefig(path, dpi=100)
        written.append(path)
    return written


def error_map(grey: U8, classes: U8) -> U8:
    """Return the picture: errors coloured, what is not answered bluish, the rest in pale greys."""
    pale = (110 + 0.52 * grey.astype(np.float32))[..., None]
    image = np.repeat(pale, 3, axis=2)
    blue = classes == MAP_CLASSES["unresolved"]
    image[blue] = 0.62 * image[blue] + 0.38 * np.array(COLOURS["unresolved"], np.float32)
    for name in ("background", *WRONG, "wrong_primitive"):
        image[classes == MAP_CLASSES[name]] = COLOURS[name]
    return image.astype(np.uint8)


def _sheet(run: RunData, cell: dict[str, Any], grey: U8, classes: dict[str, U8]) -> Figure:
    """Return all techniques' maps of a view side by side; no pixel in error is averaged away."""
    results = defaults(run.results)
    for key in ("scene", "camera", "width", "height", "workload", "seed"):
        results = results[results[key] == cell[key]]
    maps = {name: _fitted(grey, kinds) for name, kinds in classes.items()}
    height, width = next(iter(maps.values())).shape[:2]
    columns = min(3, len(maps))
    lines = -(-len(maps) // columns)
    text = width / 62
    caption, gap, head, foot = round(3.4 * text), 14, round(2.6 * text), round(3.2 * text)
    total_w = columns * width + (columns - 1) * gap
    total_h = lines * (height + caption) + head + foot
    figure = Figure(figsize=(total_w / 100, total_h / 100), dpi=100)
    figure.text(
        4 / total_w, 1 - 0.5 * text / total_h, va="top", fontsize=text, fontweight="bold",
        s=f"{cell['scene']}, camera {cell['camera']}, {cell['width']}×{cell['height']}: where the "
        "answers to mirror rays are wrong",
    )  # fmt: skip
    for k, (technique, image) in enumerate(maps.items()):
        left = (k % columns) * (width + gap)
        top = head + (k // columns) * (height + caption)
        ax = figure.add_axes(
            (left / total_w, 1 - (top + height) / total_h, width / total_w, height / total_h)
        )
        ax.imshow(image, interpolation="nearest", aspect="auto")
        ax.set_axis_off()
        figure.text(
            (left + 4) / total_w, 1 - (top + height + 0.3 * text) / total_h, va="top",
            fontsize=0.92 * text,
            s=_caption(technique, Pooled(results[results.technique == technique])),
        )  # fmt: skip
    names = ("false_hit", "false_miss", "wrong_primitive", "unresolved", "background")
    words = {"unresolved": "not answered by the screen", "background": "no surface"}
    figure.legend(
        handles=[
            Patch(
                facecolor=hexadecimal(COLOURS[name]), edgecolor="#777777", lw=0.5,
                label=words.get(name, name.replace("_", " ")),
            )
            for name in names
        ],
        loc="lower left", ncols=5, frameon=False, fontsize=0.92 * text, handlelength=1.3,
        borderpad=0.3,
    )  # fmt: skip
    return figure


def _caption(technique: str, pooled: Pooled) -> str:
    wrong = pooled.rate(WRONG, of_all=True)
    primitive = pooled.rate("wrong_primitive", of_all=True)
    return (
        f"{technique}: answers {100 * pooled.alpha:.1f} %, wrong {number(100 * wrong.value)} %, "
        f"wrong primitive {number(100 * primitive.value)} % of all rays"
    )


def _fitted(grey: U8, classes: U8) -> U8:
    """Return the map at a panel's size, by a whole factor; of several pixels the worst is kept."""
    factor = -(-grey.shape[1] // PANEL)
    if factor == 1:
        larger = max(1, PANEL // grey.shape[1])
        return error_map(grey, classes).repeat(larger, axis=0).repeat(larger, axis=1)
    height, width = (n // factor * factor for n in grey.shape)
    blocks = (height // factor, factor, width // factor, factor)
    mean = grey[:height, :width].reshape(blocks).mean(axis=(1, 3)).astype(np.uint8)
    order = [MAP_CLASSES[k] for k in ("background", "unresolved", "right", "wrong_primitive")]
    order += [MAP_CLASSES[k] for k in reversed(WRONG)]
    rank = np.empty(len(order), np.uint8)
    rank[order] = np.arange(len(order))
    worst = rank[classes[:height, :width]].reshape(blocks).max(axis=(1, 3))
    return error_map(mean, np.array(order, np.uint8)[worst])
