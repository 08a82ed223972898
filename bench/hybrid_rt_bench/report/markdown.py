"""The document of a run: what was measured where, and its tables."""

from __future__ import annotations

from typing import Any

from hybrid_rt_bench.report.page import bullets, paragraph
from hybrid_rt_bench.report.table import Table, threads_text
from hybrid_rt_bench.results.folder import RunData


def document(run: RunData, tables: list[Table], verdict: str) -> str:
    """Return the text of ``tables.md``: the verdict, what was measured where, the tables."""
    meta, machine = run.meta, run.meta["environment"]
    cells = [cell["state"] for cell in meta["cells"]]
    parts = [f"# {meta['spec']['title']}", paragraph(f"**Verdict.** {verdict}")]
    threads = threads_text(machine["threads"])
    about = [
        f"Run `{run.name}`, started {meta['started']}.",
        f"{machine['cpu']}, {threads}, {machine['os']}; Embree "
        f"{machine['embree'].get('version', '?')}, Numba {machine['packages'].get('numba', '?')}; "
        f"commit {machine.get('git') or 'unknown'}.",
        f"Cells measured: {cells.count('measured')}, failed: {cells.count('failed')}.",
    ]
    parts.append(paragraph(" ".join(about)))
    if not meta["finished"]:
        parts.append("This run is **not finished**: only some cells are here.")
    failed = [f"{_name(c)}: {c['error']}" for c in meta["cells"] if c["state"] == "failed"]
    for title, texts in (
        ("Notes", meta["notes"]),
        ("Warnings", meta["warnings"]),
        ("Failed", failed),
    ):
        if texts:
            parts.append(f"{title}:\n\n{bullets(texts)}")
    return "\n\n".join(parts) + "\n\n" + "\n".join(table.markdown() for table in tables)


def _name(cell: dict[str, Any]) -> str:
    """Return the keys of a cell in words, its size as one."""
    words = {k: v for k, v in cell.items() if k not in ("state", "error", "width", "height", "x")}
    return ", ".join(str(value) for value in words.values() if value and isinstance(value, str))
