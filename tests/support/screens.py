"""Screens, marches and lists in one call, for tests that need each only once."""

import hybrid_rt as hrt
from hybrid_rt.raster.lists import primitive_lists


def through(rays, gbuffer, technique="paper", **options):
    """March rays through a screen made for them."""
    return hrt.march(rays, hrt.prepare(gbuffer, technique), **options)


def lists_of(scene, camera, length, threads=None):
    """Return the lists of primitives in the pixels of a view."""
    return primitive_lists(scene, camera, length, threads)
