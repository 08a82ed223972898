"""The pictures of a run of kind "frame": how each technique's marches ended, and what is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from hybrid_rt_bench.judged.maps import LEGEND, PANEL, fitted
from hybrid_rt_bench.kinds.frame.columns import NOWHERE
from hybrid_rt_bench.report import sheet
from hybrid_rt_bench.report.looks import STATUSES, WHITE, rgb
from hybrid_rt_bench.report.sheet import Picture
from hybrid_rt_bench.report.style import save
from hybrid_rt_bench.report.table import number, threads_text
from hybrid_rt_bench.results.folder import RunData

U8 = NDArray[np.uint8]

NAMES = [name for name in STATUSES if name]
"""Of the numbers that a map of statuses holds."""


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
        rows = run.results[run.results.workload == cell["workload"]].set_index("technique")
        statuses = _named(arrays, "status_")
        maps = folder / "statuses"
        maps.mkdir(exist_ok=True, parents=True)
        for name, status in statuses.items():
            Image.fromarray(status_map(status)).save(maps / f"{name}.png")
        written += [maps, *save(_endings(run, cell, rows, statuses), maps, sheet.DPI)]
        classes = _named(arrays, "classes_")
        if classes:
            wrong = _errors(run, cell, rows, arrays["grey"], classes)
            written += save(wrong, folder / "errors", sheet.DPI)
    return written


def status_map(status: U8) -> U8:
    """Return the statuses of rays, (H, W), in their colours; white where no ray starts."""
    palette = np.full((256, 3), 255, np.uint8)
    palette[: len(NAMES)] = [rgb(STATUSES[name]) for name in NAMES]
    palette[NOWHERE] = rgb(WHITE)
    return palette[status]


def _named(arrays: dict[str, U8], prefix: str) -> dict[str, U8]:
    return {k.removeprefix(prefix): a for k, a in arrays.items() if k.startswith(prefix)}


def _title(cell: dict[str, Any]) -> str:
    rays = str(cell["workload"]).replace("_", " ")
    return f"{cell['scene']}, {cell['width']}×{cell['height']}, {rays} rays"


def _foot(run: RunData) -> str:
    machine = run.meta["environment"]
    return f"Default parameters. {threads_text(machine['threads'])}; {machine['cpu']}."


def _endings(run: RunData, cell: dict[str, Any], rows: Any, statuses: dict[str, U8]) -> Figure:
    smaller, larger = sheet.factors(next(iter(statuses.values())).shape[1], PANEL)
    present = np.unique(np.concatenate([status.ravel() for status in statuses.values()]))
    entries = [(STATUSES[name], name.lower()) for k, name in enumerate(NAMES) if k in present]
    return sheet.sheet(
        [
            # A status has no mean: of several pixels one is shown.
            Picture(
                sheet.enlarged(status_map(status[::smaller, ::smaller]), larger),
                f"{name}: resolves {100 * rows.alpha[name]:.1f} % of the rays",
            )
            for name, status in statuses.items()
        ],
        title=f"{_title(cell)}: how the marches ended",
        legend=[*entries, (WHITE, "no ray")],
        foot=_foot(run),
    )


def _errors(
    run: RunData, cell: dict[str, Any], rows: Any, grey: U8, classes: dict[str, U8]
) -> Figure:
    return sheet.sheet(
        [Picture(fitted(grey, kinds), _wrong(rows, name)) for name, kinds in classes.items()],
        title=f"{_title(cell)}: where answers are wrong",
        legend=LEGEND,
        foot=_foot(run),
    )


def _wrong(rows: Any, name: str) -> str:
    row = rows.loc[name]
    wrong = f"{number(100 * row.wrong_rate)} %" if row.resolved else "none"
    return f"{name}: of {int(row.resolved):,} resolved rays {wrong} wrong"
