"""Time and memory along one axis, all else fixed."""

from hybrid_rt_bench.options import RESOLUTIONS, ROUNDS, TECHNIQUES, Option
from hybrid_rt_bench.registry import Kind, register

SERIES = Option("series", "Series by name or axis, such as triangles")
TRIANGLES = Option("triangles", "Sizes: 4096,2^14 or 2^10..2^18")

register(
    Kind(
        "scaling",
        __name__,
        spec=".spec:ScalingExperiment",
        run=".run:run_scaling",
        schema=".columns:SCHEMA",
        tables=".tables:tables",
        verdict=".verdict:verdict",
        figures=(".figures:plots",),
        options=(SERIES, TRIANGLES, RESOLUTIONS, ROUNDS, TECHNIQUES),
        compare=".compared:COMPARED",
    )
)
