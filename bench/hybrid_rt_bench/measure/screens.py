"""The points at which techniques are measured, and what they read of a view, made once each."""

from __future__ import annotations

import hybrid_rt as hrt


class Screens:
    """What one view has on its screen for techniques, made when first asked for.

    Parameters
    ----------
    gbuffer : GBuffer
    threads : int
    """

    def __init__(self, gbuffer: hrt.GBuffer, threads: int) -> None:
        self.gbuffer, self.threads = gbuffer, threads
        self._made: dict[tuple[object, ...], hrt.Screen] = {}

    def of(self, technique: hrt.Technique) -> hrt.Screen:
        """Return what a technique reads; points that read the same share it."""
        key = type(technique), technique.reads
        if key not in self._made:
            self._made[key] = technique.prepare(self.gbuffer, threads=self.threads)
        return self._made[key].of(technique)


def points_of(technique: type[hrt.Technique], which: str) -> list[hrt.Point]:
    """Return the points of a technique, the one of its default parameters always among them.

    Parameters
    ----------
    technique : type
        A subclass of `hybrid_rt.Technique`.
    which : {"all", "default", "switches", "cheapest"}
        See `hybrid_rt.Technique.points`.
    """
    points = technique.points(which)
    if not any(point.default for point in points):
        points = [hrt.Point("default", technique()), *points]
    return points
