"""The tables of a run of kind "lists": what longer lists answer and cost."""

from __future__ import annotations

from hybrid_rt_bench.judged.tables import (
    table_cameras,
    table_counts,
    table_image,
    table_lists,
    table_main,
    table_scenes,
    table_status,
)
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.results.folder import RunData


def tables(run: RunData) -> list[Table]:
    """Return every table of the run, in the order of reading."""
    return [
        *table_lists(run),
        table_main(run),
        table_scenes(run),
        table_counts(run),
        table_cameras(run),
        table_status(run),
        *table_image(run),
    ]
