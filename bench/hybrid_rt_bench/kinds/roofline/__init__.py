"""What the certified march does, reads and takes on this machine, and where it breaks even."""

from hybrid_rt_bench.options import VIEWS
from hybrid_rt_bench.registry import Kind, register

register(
    Kind(
        "roofline",
        __name__,
        spec=".spec:RooflineExperiment",
        run=".run:run_roofline",
        schema=".columns:SCHEMA",
        tables=".tables:tables",
        verdict=".verdict:verdict",
        figures=(".figures:plots",),
        options=VIEWS,
        compare=".compared:COMPARED",
    )
)
