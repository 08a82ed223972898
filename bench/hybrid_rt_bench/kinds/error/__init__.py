"""What every technique gets wrong, beside what it is worth in measured time."""

from hybrid_rt_bench.judged import judging
from hybrid_rt_bench.registry import register

register(judging("error", __name__, spec=".spec:ErrorExperiment", frames="frame"))
