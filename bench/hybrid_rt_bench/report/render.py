"""Write ``tables.md`` and ``figures/`` of a run from its files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from hybrid_rt_bench.report.markdown import document
from hybrid_rt_bench.report.scenes import with_scene_notes
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.report.verdict import Verdict, paragraph
from hybrid_rt_bench.results.files import ReportsError, reason, write_bytes
from hybrid_rt_bench.results.folder import RunData

Tables = Callable[[RunData], list[Table]]
Figures = Callable[[RunData, Path], list[Path]]


def render_run(
    run: RunData, tables: Tables, verdict: Verdict, figures: Sequence[Figures] = ()
) -> tuple[list[Table], list[Path]]:
    """Write the tables and figures of a run.

    Parameters
    ----------
    run : RunData
    tables : callable
        Returns the tables of a run, in the order of reading.
    verdict : callable
        Returns what the run comes to.
    figures : sequence of callable
        Each writes pictures of a run into a folder and returns their paths.

    Returns
    -------
    tables : list of Table
    paths : list of Path
        Every file written.

    Raises
    ------
    ReportsError
        The run's folder cannot be written to.
    """
    made = with_scene_notes(run, tables(run))
    written = [run.folder / "tables.md"]
    write_bytes(written[0], document(run, made, paragraph(run, verdict)).encode())
    folder = run.folder / "figures"
    try:
        folder.mkdir(exist_ok=True)
        for write in figures:
            written += write(run, folder)
    except OSError as error:
        raise ReportsError(f"{folder}: cannot be written ({reason(error)})") from error
    return made, written
