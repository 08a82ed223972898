"""hybrid_rt_scenes."""
