"""The pictures of a run of kind "frame": how each technique's marches ended, and what is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.judged import maps
from hybrid_rt_bench.kinds.frame.columns import NOWHERE, WRONG
from hybrid_rt_bench.report import sheet
from hybrid_rt_bench.report.looks import MIDDLE, STATUSES, VERDICTS, rgb
from hybrid_rt_bench.report.sheet import Entry, Picture
from hybrid_rt_bench.report.style import save
from hybrid_rt_bench.report.table import rate_words
from hybrid_rt_bench.results.folder import RunData

U8 = NDArray[np.uint8]

NAMES = [name for name in STATUSES if name]
"""Of statuses, in the order of their numbers."""


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write a map of statuses for each technique, a sheet of them and, if judged, one of errors.

    Of the maps by themselves, only the folder is returned.
    """
    written = []
    for cell in run.meta["cells"]:
        if "picture" not in cell:
            continue
        with np.load(run.folder / cell["picture"]) as stored:
            arrays = {key: stored[key] for key in stored.files}
        rows = run.results[run.results["workload"] == cell["workload"]].set_index("technique")
        what = f"{cell['scene']}, {cell['width']}×{cell['height']}"
        statuses, classes = _named(arrays, "status_"), _named(arrays, "classes_")
        single = folder / "statuses"
        single.mkdir(exist_ok=True)
        for name, status in statuses.items():
            Image.fromarray(status_map(status)).save(single / f"{name}.png")
        written.append(single)
        pictures = [
            Picture(_fitted(status), f"{name}: alpha {rows['alpha'][name]:.3f}")
            for name, status in statuses.items()
        ]
        title = f"{what}: how the marches of {cell['workload']} rays ended"
        figure = sheet.sheet(pictures, title=title, legend=_legend(statuses))
        written += save(figure, folder / "statuses", sheet.DPI)
        if classes:
            pictures = [
                Picture(maps.fitted(arrays["grey"], kinds), _wrong(rows.loc[name], name))
                for name, kinds in classes.items()
            ]
            title = f"{what}: where the answers to {cell['workload']} rays are wrong"
            figure = sheet.sheet(pictures, title=title, legend=ERRORS)
            written += save(figure, folder / "errors", sheet.DPI)
    return written


ERRORS: tuple[Entry, ...] = (
    *((VERDICTS[name], name.replace("_", " ")) for name in (*WRONG, "wrong_primitive")),
    (VERDICTS["unresolved"], "unresolved"),
    (VERDICTS["background"], "no ray starts here"),
    (MIDDLE, "greys: right"),
)


def status_map(status: U8) -> U8:
    """Return the statuses of rays, (H, W), in their colours, (H, W, 3)."""
    palette = np.empty((256, 3), np.uint8)
    palette[:] = rgb(STATUSES[""])
    palette[: len(NAMES)] = [rgb(STATUSES[name]) for name in NAMES]
    return palette[status]


def _fitted(status: U8) -> U8:
    """Return a map of statuses at a panel's size; larger ones lose whole rows and columns."""
    smaller, larger = sheet.factors(status.shape[1], maps.PANEL)
    return sheet.enlarged(status_map(status[::smaller, ::smaller]), larger)


def _legend(statuses: dict[str, U8]) -> list[Entry]:
    present = np.unique(np.concatenate([status.ravel() for status in statuses.values()]))
    legend = [(STATUSES[name], name.lower()) for k, name in enumerate(NAMES) if k in present]
    nowhere = [(STATUSES[""], "no ray starts here")]
    return legend + (nowhere if NOWHERE in present else [])


def _named(arrays: dict[str, U8], prefix: str) -> dict[str, U8]:
    return {k.removeprefix(prefix): a for k, a in arrays.items() if k.startswith(prefix)}


def _wrong(row: Any, name: str) -> str:
    rate = Rate.of(int(sum(row[kind] for kind in WRONG)), int(row["resolved"]))
    return f"{name}: wrong on {rate_words(rate).replace(' rays', ' resolved rays')}"
