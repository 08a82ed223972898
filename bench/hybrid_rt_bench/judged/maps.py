"""Maps of where each technique's answers are wrong, over the reflections in grey."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from hybrid_rt_bench.judged.columns import MAP_CLASSES, WRONG
from hybrid_rt_bench.judged.pooling import Pooled
from hybrid_rt_bench.judged.tables import defaults
from hybrid_rt_bench.report import sheet
from hybrid_rt_bench.report.looks import GREYS, MIDDLE, VERDICTS
from hybrid_rt_bench.report.scenes import scene_name, scene_notes
from hybrid_rt_bench.report.sheet import Picture
from hybrid_rt_bench.report.style import save
from hybrid_rt_bench.report.table import number, threads_text
from hybrid_rt_bench.results.folder import RunData

U8 = NDArray[np.uint8]

PANEL = 800
"""Width of a panel of a sheet in pixels, at most, and at least half of it."""

ORDER = ("background", "right", "unresolved", "wrong_primitive", *reversed(WRONG))
"""What the pixels of a map say, the worst last."""

LEGEND = (
    (VERDICTS["false_hit"], "false hit"),
    (VERDICTS["false_miss"], "false miss"),
    (VERDICTS["wrong_primitive"], "wrong primitive"),
    (VERDICTS["unresolved"], "unresolved"),
    (VERDICTS["background"], "no surface"),
    (MIDDLE, "greys: right, what is reflected"),
)


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
        figure = sheet_of(run, cell, arrays["grey"], classes)
        written += save(figure, folder / f"errors-{view}", sheet.DPI)
    return written


def error_map(grey: U8, classes: U8) -> U8:
    """Return the picture: right answers in greys, all else in the colour of the legend, exactly."""
    colours = {MAP_CLASSES[name]: colour for name, colour in VERDICTS.items()}
    return sheet.coloured(sheet.squeezed(grey, GREYS), classes, colours)


def sheet_of(run: RunData, cell: dict[str, Any], grey: U8, classes: dict[str, U8]) -> Figure:
    """Return all techniques' maps of a view side by side; no pixel in error is averaged away."""
    results = defaults(run.results)
    for key in ("scene", "camera", "width", "height", "workload", "seed"):
        results = results[results[key] == cell[key]]
    machine = run.meta["environment"]
    return sheet.sheet(
        [
            Picture(
                fitted(grey, kinds), _caption(name, Pooled(results[results["technique"] == name]))
            )
            for name, kinds in classes.items()
        ],
        title=f"{scene_name(run, cell['scene'])}, camera {cell['camera']}, "
        f"{cell['width']}×{cell['height']}: where "
        "the answers to mirror rays are wrong",
        legend=LEGEND,
        foot=" ".join(
            (
                f"Default parameters. {threads_text(machine['threads'])}; {machine['cpu']}.",
                *scene_notes(run, [cell["scene"]]),
            )
        ),
    )


def fitted(grey: U8, classes: U8) -> U8:
    """Return the map at a panel's size, by a whole factor; of several pixels the worst is kept."""
    smaller, larger = sheet.factors(grey.shape[1], PANEL)
    kept = sheet.worst(classes, smaller, [MAP_CLASSES[name] for name in ORDER])
    return sheet.enlarged(error_map(sheet.mean(grey, smaller), kept), larger)


def _caption(technique: str, pooled: Pooled) -> str:
    wrong = pooled.rate(WRONG, of_all=True)
    primitive = pooled.rate("wrong_primitive", of_all=True)
    return (
        f"{technique}: resolves {100 * pooled.alpha:.1f} %, wrong {number(100 * wrong.value)} %, "
        f"wrong primitive {number(100 * primitive.value)} % of all rays"
    )
