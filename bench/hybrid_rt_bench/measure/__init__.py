"""Measure: scenes, rays, the strongest Embree, the machine, the life of a run."""
