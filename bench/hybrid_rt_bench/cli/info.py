"""``hybrid-rt info``."""

from __future__ import annotations

from hybrid_rt_bench.cli import terminal


def info() -> None:
    """Show versions, CPU, Embree's choice, where scenes are kept, what would spoil measurements."""
    import numba
    from rich.table import Table

    from hybrid_rt_bench.measure import environment as env
    from hybrid_rt_scenes import data_directories

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
    table.add_row("scenes looked for in", "\n".join(map(str, data_directories())))
    out.print(table)
    problems = env.problems(found)
    if not problems:
        out.print("no problems found", style="green")
    for problem in problems:
        out.print(f"problem: {problem}", style="yellow", soft_wrap=True, highlight=False)
