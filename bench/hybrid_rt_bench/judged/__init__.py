"""What the kinds share that hold every answer against the truth and time it beside Embree."""

from hybrid_rt_bench.options import TECHNIQUES, VIEWS
from hybrid_rt_bench.registry import Kind


def judging(name: str, package: str, spec: str, frames: str = "") -> Kind:
    """Return a kind that judges: its own are its TOML files, class, tables and verdict."""
    return Kind(
        name,
        package,
        spec=spec,
        run="hybrid_rt_bench.judged.run:run_judged",
        schema="hybrid_rt_bench.judged.columns:SCHEMA",
        tables=".tables:tables",
        verdict=".verdict:verdict",
        figures=("hybrid_rt_bench.judged.figures:plots", "hybrid_rt_bench.judged.maps:figures"),
        options=(*VIEWS, TECHNIQUES),
        frames=frames,
        compare="hybrid_rt_bench.judged.compared:COMPARED",
    )
