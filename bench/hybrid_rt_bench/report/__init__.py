"""Render a run's tables and figures from its files; nothing in here measures or traces."""

from hybrid_rt_bench.report.render import render_run
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.report.tables import all_tables

__all__ = ["Table", "all_tables", "render_run"]
