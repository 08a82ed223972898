"""Write ``tables.md`` and ``figures/`` of a run from its files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hybrid_rt_bench.report import (
    ablation,
    error_maps,
    error_tables,
    figures,
    goal,
    pareto,
    peers,
    pictures,
    roofline,
    roofline_figures,
    scaling,
    scaling_figures,
    stability,
)
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.report.tables import all_tables
from hybrid_rt_bench.results import ReportsError, RunData, write_bytes


@dataclass(frozen=True)
class Form:
    """How runs of one kind are shown.

    Attributes
    ----------
    tables : callable
        Returns the tables of a run, in the order of reading.
    figures : tuple of callable
        Each writes pictures of a run into a folder and returns their paths.
    """

    tables: Callable[[RunData], list[Table]]
    figures: tuple[Callable[[RunData, Path], list[Path]], ...]


def _error_tables(run: RunData) -> list[Table]:
    """Return the tables of those points that have tables of their own, else the usual ones."""
    return [*ablation.tables(run), *goal.tables(run)] or error_tables.all_tables(run)


FORMS = {
    "paper": Form(all_tables, (figures.plots, pictures.figures)),
    "error": Form(_error_tables, (pareto.plots, error_maps.figures)),
    "stability": Form(stability.tables, (stability.figures,)),
    "scaling": Form(scaling.tables, (scaling_figures.plots,)),
    "peers": Form(peers.tables, (peers.figures,)),
    "roofline": Form(roofline.tables, (roofline_figures.plots,)),
}
"""The form of each kind of run."""


def render_run(run: RunData) -> tuple[list[Table], list[Path]]:
    """Write the tables and figures of a run.

    Returns
    -------
    tables : list of Table
    paths : list of Path
        Every file written.

    Raises
    ------
    ReportsError
        The run's folder cannot be written to, or its kind is not known.
    """
    if run.kind not in FORMS:
        raise ReportsError(f"{run.folder}: a run of kind {run.kind!r}, which cannot be shown here")
    form = FORMS[run.kind]
    tables = form.tables(run)
    document = _document(run, tables)
    written = [run.folder / "tables.md"]
    write_bytes(written[0], document.encode())
    folder = run.folder / "figures"
    try:
        folder.mkdir(exist_ok=True)
        for write in form.figures:
            written += write(run, folder)
    except OSError as error:
        raise ReportsError(f"{folder}: cannot be written ({error.strerror})") from error
    return tables, written


def _document(run: RunData, tables: list[Table]) -> str:
    meta, machine = run.meta, run.meta["environment"]
    cells = [cell["state"] for cell in meta["cells"]]
    lines = [
        f"# {meta['spec']['title']}",
        "",
        f"Run `{run.name}`, started {meta['started']}"
        + ("" if meta["finished"] else ", **not finished: only some cells are here**")
        + ".",
        f"{machine['cpu']}, {machine['threads']} threads, {machine['os']}; Embree "
        f"{machine['embree'].get('version', '?')}, Numba {machine['packages']['numba']}; "
        f"commit {machine['git'] or 'unknown'}.",
        f"Cells measured: {cells.count('measured')}, failed: {cells.count('failed')}.",
    ]
    for title, texts in (("Notes", meta["notes"]), ("Warnings", meta["warnings"])):
        if texts:
            lines += ["", f"{title}:", "", *[f"- {text}" for text in texts]]
    failed = [cell for cell in meta["cells"] if cell["state"] == "failed"]
    if failed:
        lines += ["", "Failed:", ""]
        lines += [f"- {_cell_name(c)}: {c['error']}" for c in failed]
    return "\n".join(lines) + "\n\n" + "\n".join(table.markdown() for table in tables)


def _cell_name(cell: dict[str, Any]) -> str:
    return ", ".join(
        str(cell[key]) for key in ("series", "label", "scene", "camera", "case") if cell.get(key)
    )
