"""``hybrid-rt info``."""

from __future__ import annotations

from hybrid_rt_bench.cli import terminal


def info() -> None:
    """Show versions, CPU, what Embree chose, and problems that would spoil measurements."""
    import numba
    import numpy as np
    from rich.table import Table

    import hybrid_rt as hrt
    from hybrid_rt_bench.measure import environment as env

    out = terminal.out()
    load = env.load_average()
    triangle = hrt.Scene.from_arrays(np.eye(3), [[0, 1, 2]])
    hrt.rasterize(triangle, hrt.Camera.look_at((0, 0, 2), (0, 0, 0), width=8, height=8))
    found = {**env.describe(numba.get_num_threads()), "load_average": load}
    table = Table(show_header=False, box=None)
    for key, value in found.items():
        if isinstance(value, dict):
            value = ", ".join(f"{k} {v}" for k, v in value.items())
        elif key == "memory_bytes":
            key, value = "memory", f"{value / 2**30:.1f} GiB"
        table.add_row(key.replace("_", " "), str(value))
    out.print(table)
    problems = env.problems(found)
    if not problems:
        out.print("no problems found", style="green")
    for problem in problems:
        out.print(f"problem: {problem}", style="yellow", soft_wrap=True, highlight=False)
