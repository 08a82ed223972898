"""What the kinds share that hold every answer against the truth and time it beside Embree."""

from hybrid_rt_bench.options import TECHNIQUES, VIEWS
from hybrid_rt_bench.registry import Kind


def judging(name: str, package: str, spec: str, tables: str) -> Kind:
    """Return a kind that judges: its own are its TOML files, its class and its tables."""
    return Kind(
        name,
        package,
        spec=spec,
        run="hybrid_rt_bench.judged.run:run_judged",
        schema="hybrid_rt_bench.judged.columns:SCHEMA",
        tables=tables,
        figures=("hybrid_rt_bench.judged.figures:plots", "hybrid_rt_bench.judged.maps:figures"),
        options=(*VIEWS, TECHNIQUES),
        compare="hybrid_rt_bench.judged.compared:COMPARED",
    )
