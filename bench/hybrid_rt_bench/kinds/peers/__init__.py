"""The same rays and pictures through other programs."""

from hybrid_rt_bench.options import VIEWS
from hybrid_rt_bench.registry import Kind, register

register(
    Kind(
        "peers",
        __name__,
        spec=".spec:PeersExperiment",
        run=".run:run_peers",
        schema=".columns:SCHEMA",
        tables=".tables:tables",
        verdict=".verdict:verdict",
        figures=(".figures:figures",),
        options=VIEWS,
        compare=".compared:COMPARED",
        listing=".programs:listing",
    )
)
