"""The tables of a run of kind "error": what each technique is worth, and what it gets wrong."""

from __future__ import annotations

from hybrid_rt_bench.judged.tables import (
    table_cameras,
    table_counts,
    table_image,
    table_lists,
    table_main,
    table_scenes,
    table_status,
    table_t_error,
    table_workloads,
)
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.results.folder import RunData


def tables(run: RunData) -> list[Table]:
    """Return every table of the run, in the order of reading."""
    return [
        table_main(run),
        table_scenes(run),
        table_workloads(run),
        table_counts(run),
        *table_lists(run),
        table_cameras(run),
        table_status(run),
        table_t_error(run),
        *table_image(run),
    ]
