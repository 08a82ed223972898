"""The document of a run: what was measured where, and its tables."""

from __future__ import annotations

from typing import Any

from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.results.folder import RunData


def document(run: RunData, tables: list[Table]) -> str:
    """Return the text of ``tables.md``."""
    meta, machine = run.meta, run.meta["environment"]
    cells = [cell["state"] for cell in meta["cells"]]
    lines = [
        f"# {meta['spec']['title']}",
        "",
        f"Run `{run.name}`, started {meta['started']}"
        + ("" if meta["finished"] else ", **not finished: only some cells are here**")
        + ".",
        f"{machine['cpu']}, {machine['threads']} threads, {machine['os']}; Embree "
        f"{machine['embree'].get('version', '?')}, Numba {machine['packages'].get('numba', '?')}; "
        f"commit {machine.get('git') or 'unknown'}.",
        f"Cells measured: {cells.count('measured')}, failed: {cells.count('failed')}.",
    ]
    for title, texts in (("Notes", meta["notes"]), ("Warnings", meta["warnings"])):
        if texts:
            lines += ["", f"{title}:", "", *[f"- {text}" for text in texts]]
    failed = [cell for cell in meta["cells"] if cell["state"] == "failed"]
    if failed:
        lines += ["", "Failed:", ""]
        lines += [f"- {_name(cell)}: {cell['error']}" for cell in failed]
    return "\n".join(lines) + "\n\n" + "\n".join(table.markdown() for table in tables)


def _name(cell: dict[str, Any]) -> str:
    """Return the keys of a cell in words, its size as one."""
    words = {k: v for k, v in cell.items() if k not in ("state", "error", "width", "height", "x")}
    return ", ".join(str(value) for value in words.values() if value and isinstance(value, str))
