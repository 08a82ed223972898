"""What the paper measured: mirror rays, marched first and traced where the screen has no answer."""

from hybrid_rt_bench.options import TECHNIQUES, VIEWS
from hybrid_rt_bench.registry import Kind, register

register(
    Kind(
        "paper",
        __name__,
        spec=".spec:PaperExperiment",
        run=".run:run_paper",
        schema=".columns:SCHEMA",
        tables=".tables:tables",
        verdict=".verdict:verdict",
        figures=(".figures:plots", ".pictures:figures"),
        options=(*VIEWS, TECHNIQUES),
        compare=".compared:COMPARED",
    )
)
