"""The hard set: which technique gives wrong answers on which case."""

from hybrid_rt_bench.options import TECHNIQUES, Option
from hybrid_rt_bench.registry import Kind, register

CASES = Option("cases", "Hard cases by name")

register(
    Kind(
        "stability",
        __name__,
        spec=".spec:StabilityExperiment",
        run=".run:run_stability",
        schema=".columns:SCHEMA",
        tables=".tables:tables",
        verdict=".verdict:verdict",
        figures=(".figures:figures",),
        options=(CASES, TECHNIQUES),
        compare=".compared:COMPARED",
    )
)
