"""``hybrid-rt compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hybrid_rt_bench.cli.common import OutDir, show_table


def compare(
    first: Annotated[str, typer.Argument(metavar="A", help="The run before.")],
    second: Annotated[str, typer.Argument(metavar="B", help="The run after.")],
    out_dir: OutDir = Path("reports"),
) -> None:
    """Compare the times of two runs over the cells that both measured.

    Ratios are B / A with a 95 % interval; an interval that holds 1 shows no difference.

    Example: `hybrid-rt compare 20250101-120000-paper 20250102-120000-paper`
    """
    from hybrid_rt_bench.runs import compare_runs, read_run

    for table in compare_runs(read_run(first, out_dir), read_run(second, out_dir)):
        show_table(table)
