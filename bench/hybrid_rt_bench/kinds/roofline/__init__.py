"""What the certified march does, reads and takes, and what it may take on this machine."""

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
        figures=(".figures:plots",),
        options=VIEWS,
        compare=".compared:COMPARED",
    )
)
