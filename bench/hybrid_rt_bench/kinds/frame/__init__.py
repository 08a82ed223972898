"""What the screen answers in a frame of someone's own: alpha, statuses and, with the mesh, errors.

``hybrid-rt run error --depth FILE`` runs it.
"""

from hybrid_rt_bench.options import FRAME, TECHNIQUES
from hybrid_rt_bench.registry import Kind, register

register(
    Kind(
        "frame",
        __name__,
        spec=".spec:FrameExperiment",
        run=".run:run_frame",
        schema=".columns:SCHEMA",
        tables=".tables:tables",
        verdict=".verdict:verdict",
        compare=".compared:COMPARED",
        figures=(".figures:figures",),
        options=(*FRAME, TECHNIQUES),
    )
)
