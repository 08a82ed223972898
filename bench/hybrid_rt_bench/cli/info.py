"""``hybrid-rt info``."""

from __future__ import annotations

from typing import Annotated

import typer

from hybrid_rt_bench.cli import terminal


def info(
    what: Annotated[
        str | None,
        typer.Argument(help="A mesh, a definition, a file of cameras, or a scene by name."),
    ] = None,
) -> None:
    """Show what is in a file; or versions, CPU, where scenes are kept, problems of measuring.

    Of a mesh: triangles, objects, bounds and cameras.

    Examples
    --------
    * `hybrid-rt info` - this machine

    * `hybrid-rt info hall.glb`
    """
    if what is not None:
        from hybrid_rt_bench.cli import contents

        contents.show(what)
        return
    import numba
    from rich.table import Table

    import hybrid_rt_scenes as hrs
    from hybrid_rt_bench.measure import environment as env

    out = terminal.out()
    load = env.load_average()
    found = {**env.describe(numba.get_num_threads()), "load_average": load}
    table = Table(show_header=False, box=None)
    for key, value in found.items():
        if isinstance(value, dict):
            value = ", ".join(f"{k} {v}" for k, v in value.items())
        elif key == "memory_bytes":
            key, value = "memory", f"{value / 2**30:.1f} GiB"
        table.add_row(key.replace("_", " "), str(value))
    specs, faults = hrs.all_scenes()
    there = [spec for spec in specs if spec.missing() is None]
    named = (f"{spec.name} ({spec.mark})" if spec.mark else spec.name for spec in there)
    table.add_row("scenes", ", ".join(named))
    table.add_row("scenes looked for in", "\n".join(map(str, hrs.data_directories())))
    out.print(table)
    for spec in there:
        if spec.mark:
            out.print(
                f"Scene {spec.name} ({spec.mark}): {spec.note}.", soft_wrap=True, highlight=False
            )
    problems = [*env.problems(found), *faults]
    if not problems:
        out.print("no problems found", style="green")
    for problem in problems:
        out.print(f"problem: {problem}", style="yellow", soft_wrap=True, highlight=False)
