"""What several commands share: their options, reading a run, showing its tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.cli import terminal

if TYPE_CHECKING:
    from hybrid_rt_bench.report.table import Table
    from hybrid_rt_bench.results.folder import RunData

OutDir = Annotated[Path, typer.Option("--out", help="Directory that holds the runs.")]
Threads = Annotated[
    int | None,
    typer.Option("--threads", help="Threads for every stage alike; default: all cores."),
]


def rendered(data: RunData, *, show: bool) -> list[Path]:
    """Write the tables and figures of a run, print them and its verdict where asked for.

    Returns
    -------
    list of Path
        Every file written.
    """
    from hybrid_rt_bench.runs import render_run, verdict_of

    with terminal.err().status("writing tables and figures"):
        tables, written = render_run(data)
    if show:
        for table in tables:
            show_table(table, written[0])
        for path in written:
            terminal.out().print(f"wrote {path}", soft_wrap=True, highlight=False)
        terminal.out().print()
        terminal.out().print(verdict_of(data), highlight=False)
    return written


def show_table(table: Table, document: Path | None = None) -> None:
    """Print a table; a terminal too narrow for a detailed one is told where it stands."""
    from rich.measure import Measurement

    out = terminal.out()
    rich = table.rich()
    natural = Measurement.get(out, out.options.update(width=10_000), rich).maximum
    if document is not None and table.detail and natural > out.width:
        text = f"{table.title}: too wide for this terminal, see {document}"
        out.print(text, soft_wrap=True, highlight=False)
    else:
        out.print(rich)
    out.print()


def names(option: str, text: str | None) -> list[str] | None:
    """Return the names in the text of an option, each once; None stays None.

    Raises
    ------
    ArgumentError
        No name at all.
    """
    if text is None:
        return None
    found = [part.strip() for part in text.split(",") if part.strip()]
    if not found:
        raise ArgumentError(option, "at least one name", repr(text))
    return list(dict.fromkeys(found))
