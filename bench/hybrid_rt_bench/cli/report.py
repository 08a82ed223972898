"""``hybrid-rt report``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hybrid_rt_bench.cli.common import OutDir, rendered


def report(
    run_id: Annotated[str, typer.Argument(metavar="RUN", help="Id of a run, or its folder.")],
    out_dir: OutDir = Path("reports"),
) -> None:
    """Render the tables and figures of a run again, from its files alone.

    Example: `hybrid-rt report reports/20250101-120000-paper`
    """
    from hybrid_rt_bench.runs import read_run

    rendered(read_run(run_id, out_dir), show=True)
