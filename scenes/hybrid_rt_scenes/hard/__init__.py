"""The parts of the hard set; `hybrid_rt_scenes.hard_cases` is the way in."""
