"""hybrid_rt_bench."""
