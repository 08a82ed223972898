"""What the certified hybrid is worth on each scene at each size, end to end."""

from hybrid_rt_bench.judged import judging
from hybrid_rt_bench.registry import register

register(judging("hybrid", __name__, spec=".spec:HybridExperiment"))
