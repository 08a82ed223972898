"""``hybrid-rt list``."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from hybrid_rt_bench.cli import terminal
from hybrid_rt_bench.cli.common import show_table


def list_all() -> None:
    """List scenes with their cameras, experiments, techniques, workloads and what kinds add."""
    from hybrid_rt_bench.experiments import experiment_names, load_experiment
    from hybrid_rt_bench.measure.workloads import WORKLOADS
    from hybrid_rt_bench.registry import kinds

    out = terminal.out()
    _scenes()
    _table(
        "Experiments",
        ("experiment", "what it measures"),
        [(name, load_experiment(name).title) for name in experiment_names()],
    )
    _techniques()
    _table(
        "Workloads",
        ("workload", "which rays"),
        [(workload.name, workload.description) for workload in WORKLOADS.values()],
    )
    for kind in kinds.values():
        for table in kind.listed():
            show_table(table)
    out.print("Thickness is a share of the diagonal of the scene's bounding box.")


def _scenes() -> None:
    import hybrid_rt_scenes as hrs

    out = terminal.out()
    rows = []
    specs, missing = hrs.all_scenes()
    for spec in specs:
        absent = spec.missing()
        state = "built in" if spec.builtin else "missing" if absent else "found"
        if absent:
            missing.append(absent)
        mark = f", {spec.mark}" if spec.mark else ""
        named = Text.assemble(spec.name, "\n", (state + mark, "dim"))
        note = f"\n{spec.mark}: {spec.note}" if spec.mark else ""
        rows.append((named, "\n".join(spec.cameras), spec.description + note))
    _table("Scenes", ("scene", "cameras", "what it is"), rows)
    places = ", then in ".join(map(str, hrs.data_directories()))
    out.print(f"Mesh files of scenes are looked for in {places}", soft_wrap=True)
    for text in missing:
        out.print(text, style="yellow", soft_wrap=True, highlight=False)


def _techniques() -> None:
    import hybrid_rt as hrt

    rows = [
        (
            technique.name,
            Text.assemble(technique.description, "\n", (technique.reference, "dim")),
            ", ".join(f"{k} {v}" for k, v in technique().words().items()),
        )
        for technique in hrt.TECHNIQUES.values()
    ]
    _table("Techniques", ("technique", "what it does", "default parameters"), rows)


def _table(title: str, columns: tuple[str, ...], rows: Sequence[tuple[str | Text, ...]]) -> None:
    table = Table(*columns, title=title, title_justify="left")
    for row in rows:
        table.add_row(*row)
    terminal.out().print(table)
