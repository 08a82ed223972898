"""How long a list of primitives pays."""

from hybrid_rt_bench.judged import judging
from hybrid_rt_bench.registry import register

register(judging("lists", __name__, spec=".spec:ListsExperiment"))
