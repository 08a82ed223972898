"""The pictures of a run of kind "frame": how each technique's marches ended, and what is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from hybrid_rt_bench.judged.columns import MAP_CLASSES
from hybrid_rt_bench.judged.maps import LEGEND, ORDER, error_map
from hybrid_rt_bench.kinds.frame.columns import NOWHERE
from hybrid_rt_bench.report import sheet
from hybrid_rt_bench.report.looks import STATUSES, rgb
from hybrid_rt_bench.report.sheet import Entry, Picture
from hybrid_rt_bench.report.style import save
from hybrid_rt_bench.report.table import number, threads_text
from hybrid_rt_bench.results.folder import RunData

U8 = NDArray[np.uint8]

NAMES = [name for name in STATUSES if name]
"""The statuses in the order of `MarchStatus`, whose numbers stand in a run."""
PANEL = 800
"""Width of a picture on a sheet in pixels, at most, and at least half of it."""


def figures(run: RunData, folder: Path) -> list[Path]:
    """Write a map of statuses for each technique, a sheet of them and, if judged, one of errors."""
    written = []
    for cell in run.meta["cells"]:
        if "picture" not in cell:
            continue
        with np.load(run.folder / cell["picture"]) as stored:
            arrays = {key: stored[key] for key in stored.files}
        statuses, classes = _named(arrays, "status_"), _named(arrays, "classes_")
        maps = folder / "statuses"
        maps.mkdir(exist_ok=True)
        for name, status in statuses.items():
            Image.fromarray(status_map(status)).save(maps / f"{name}.png")
        written.append(maps)
        written += save(endings(run, cell, statuses), folder / "statuses", sheet.DPI)
        if classes:
            figure = errors(run, cell, arrays["grey"], classes)
            written += save(figure, folder / "errors", sheet.DPI)
    return written


def endings(run: RunData, cell: dict[str, Any], statuses: dict[str, U8]) -> Figure:
    """Return maps of how the marches of each technique ended, side by side."""
    rows = _rows(run, cell)
    smaller, larger = sheet.factors(next(iter(statuses.values())).shape[1], PANEL)
    present = np.unique(np.concatenate([s.ravel() for s in statuses.values()]))
    legend: list[Entry] = [
        (STATUSES[name], name.lower()) for k, name in enumerate(NAMES) if k in present
    ]
    return sheet.sheet(
        [
            Picture(
                sheet.enlarged(status_map(status[::smaller, ::smaller]), larger),
                f"{name}: resolves {100 * rows.alpha[name]:.1f} % of the rays",
            )
            for name, status in statuses.items()
        ],
        title=f"{_title(cell)}: how the marches ended",
        legend=[*legend, (STATUSES[""], "no ray")],
        foot=_foot(run),
    )


def errors(run: RunData, cell: dict[str, Any], grey: U8, classes: dict[str, U8]) -> Figure:
    """Return maps of where each technique is wrong; no pixel in error is averaged away."""
    rows = _rows(run, cell)
    smaller, larger = sheet.factors(grey.shape[1], PANEL)
    order = [MAP_CLASSES[name] for name in ORDER]
    pale = sheet.mean(grey, smaller)
    return sheet.sheet(
        [
            Picture(
                sheet.enlarged(error_map(pale, sheet.worst(kinds, smaller, order)), larger),
                _wrong(rows, name),
            )
            for name, kinds in classes.items()
        ],
        title=f"{_title(cell)}: where answers are wrong",
        legend=LEGEND,
        foot=_foot(run),
    )


def status_map(status: U8) -> U8:
    """Return the statuses of rays, (H, W), in their colours; white where no ray starts."""
    palette = np.full((256, 3), rgb(STATUSES[""]), np.uint8)
    palette[: len(NAMES)] = [rgb(STATUSES[name]) for name in NAMES]
    palette[NOWHERE] = rgb(STATUSES[""])
    return palette[status]


def _named(arrays: dict[str, U8], prefix: str) -> dict[str, U8]:
    return {k.removeprefix(prefix): a for k, a in arrays.items() if k.startswith(prefix)}


def _rows(run: RunData, cell: dict[str, Any]) -> Any:
    return run.results[run.results.workload == cell["workload"]].set_index("technique")


def _wrong(rows: Any, name: str) -> str:
    row = rows.loc[name]
    wrong = f"{number(100 * row.wrong_rate)} %" if row.resolved else "none"
    return f"{name}: of {int(row.resolved):,} resolved rays {wrong} wrong"


def _title(cell: dict[str, Any]) -> str:
    return f"{cell['scene']}, {cell['width']}×{cell['height']}, {cell['workload']} rays"


def _foot(run: RunData) -> str:
    machine = run.meta["environment"]
    return f"Default parameters. {threads_text(machine['threads'])}; {machine['cpu']}."
