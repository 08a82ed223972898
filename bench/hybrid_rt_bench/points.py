"""The points of an error experiment: techniques with their parameters, and what they read."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import hybrid_rt as hrt
from hybrid_rt.certified import LENGTH
from hybrid_rt_bench.techniques import Technique

LISTS = (2, 4, LENGTH, 16)
"""Lengths of the lists of primitives a pixel with which "certified" is measured."""


@dataclass(frozen=True)
class Point:
    """A technique with parameters.

    Attributes
    ----------
    technique : str
    label : str
        Says the parameters; unique among the points of the technique.
    mode : Mode
    default : bool
        Whether these are the technique's default parameters.
    lists : int
        Length of the lists of primitives that the G-buffer has to hold; 0 for none.
    """

    technique: str
    label: str
    mode: hrt.Mode
    default: bool
    lists: int = 0


@dataclass(frozen=True, eq=False)
class Screen:
    """What a march reads of a view.

    Attributes
    ----------
    gbuffer : GBuffer
    pyramid : DepthPyramid
    seconds : float
        What it took to make what a plain raster does not give: the pyramid, and lists if any.
    """

    gbuffer: hrt.GBuffer
    pyramid: Any
    seconds: float

    @property
    def lists(self) -> hrt.PrimitiveLists | None:
        """The lists of primitives, if the G-buffer has any."""
        return self.gbuffer.lists


class View:
    """What one view has on its screen, each form of it made once, when first asked for.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    threads : int
    """

    def __init__(self, scene: hrt.Scene, camera: hrt.Camera, threads: int) -> None:
        self.scene, self.camera, self.threads = scene, camera, threads
        self.gbuffer, self.raster_seconds = _timed(
            lambda: hrt.rasterize(scene, camera, threads=threads)
        )
        self._screens: dict[tuple[type | None, int], Screen] = {}

    def screen(self, point: Point) -> Screen:
        """Return what the march of a point reads."""
        kind = type(point.mode) if point.lists or isinstance(point.mode, hrt.SlopeAware) else None
        if (kind, point.lists) not in self._screens:
            self._screens[kind, point.lists] = self._make(point)
        return self._screens[kind, point.lists]

    def _make(self, point: Point) -> Screen:
        threads = self.threads
        if isinstance(point.mode, hrt.Certified):
            start = time.perf_counter()
            gbuffer = hrt.rasterize(self.scene, self.camera, lists=point.lists, threads=threads)
            pyramid = hrt.build_depth_pyramid(gbuffer, conservative=True, threads=threads)
            # What a renderer has anyway, the visible surface, is not a cost of the technique.
            seconds = time.perf_counter() - start - self.raster_seconds
            return Screen(gbuffer, pyramid, seconds)
        slope = isinstance(point.mode, hrt.SlopeAware)
        make = hrt.build_slope_pyramid if slope else hrt.build_depth_pyramid
        built, seconds = _timed(lambda: make(self.gbuffer, threads=threads))
        return Screen(self.gbuffer, built, seconds)


def points_of(technique: Technique, scene: hrt.Scene, *, every: bool) -> list[Point]:
    """Return the points of a technique, the one of its default parameters among them.

    Parameters
    ----------
    technique : Technique
    scene : Scene
        What lengths in world units relate to.
    every : bool
        All of them; else the default alone.
    """
    usual = _in_scene(technique.mode, scene)
    points = [
        Point(technique.name, label, mode, default=_in_scene(mode, scene) == usual)
        for label, mode in technique.points(scene)
    ]
    if isinstance(technique.mode, hrt.Certified):
        points = [
            dataclasses.replace(point, label=f"lists {lists}", default=lists == LENGTH, lists=lists)
            for point in points
            for lists in LISTS
        ]
    if not any(point.default for point in points):
        points.insert(0, Point(technique.name, "default", technique.mode, default=True))
    return points if every else [point for point in points if point.default]


def _in_scene(mode: hrt.Mode, scene: hrt.Scene) -> hrt.Mode:
    """Return a mode with the thickness that it has in a scene, so that modes can be compared."""
    if isinstance(mode, hrt.Linear | hrt.PixelDDA | hrt.HiZ):
        return dataclasses.replace(mode, thickness=mode.thickness_in(scene))
    return mode


def _timed(call: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    made = call()
    return made, time.perf_counter() - start
