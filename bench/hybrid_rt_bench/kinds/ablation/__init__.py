"""What each part of the certified march is worth: every switch by itself."""

from hybrid_rt_bench.judged import judging
from hybrid_rt_bench.registry import register

register(judging("ablation", __name__, spec=".spec:AblationExperiment"))
