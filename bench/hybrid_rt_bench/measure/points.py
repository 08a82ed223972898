"""The points of an error experiment: techniques with their parameters, and what they read."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt.raster.lists import primitive_lists
from hybrid_rt.techniques.certified import LENGTH
from hybrid_rt_bench.judged.spec import Which
from hybrid_rt_bench.measure.techniques import Technique


@dataclass(frozen=True)
class ListsForm:
    """Lists of primitives as "certified" reads them.

    Attributes
    ----------
    length : int
        Primitives a list, at most.
    cell : int
        Pixels of the image along each side of the square that has a list.
    guard : float
        Width and height of what has lists, in those of the screen.
    planes : bool
        Whether the planes of the primitives may put off an exact test.
    """

    length: int = LENGTH
    cell: int = 1
    guard: float = 1.0
    planes: bool = True

    def camera(self, camera: hrt.Camera) -> hrt.Camera:
        """Return the view in whose pixels the lists for a screen are made."""
        wide = camera if self.guard == 1.0 else camera.widened(self.guard)
        return wide.resized(max(1, wide.width // self.cell), max(1, wide.height // self.cell))


LISTS = (2, 4, LENGTH, 16)
"""Lengths of the lists of primitives a pixel with which "certified" is measured."""

Changes = dict[str, Any]

CHEAPEST: tuple[str, Changes, Changes] = (
    "4x4 cells, guard x2, 4 tests, 32 steps, probe 1 of 16",
    {"max_tests": 4, "max_steps": 32, "probes": 1},
    {"cell": 4, "guard": 2.0},
)
"""A march that gives up early: its label, and what it changes of `Certified` and `ListsForm`."""

SWITCHES: tuple[tuple[str, Changes, Changes], ...] = (
    ("base", {}, {}),
    ("one ray at a time", {"vectors": False, "probes": 16}, {}),
    ("no planes", {}, {"planes": False}),
    *((f"lists {n}", {}, {"length": n}) for n in LISTS),
    *((f"{n}x{n} cells", {}, {"cell": n}) for n in (1, 2, 4, 8)),
    *((f"guard x{g:g}", {}, {"guard": g}) for g in (1.5, 2.0)),
    *((f"4x4 cells, guard x{g:g}", {}, {"cell": 4, "guard": g}) for g in (1.5, 2.0)),
    *((f"{n} tests", {"max_tests": n}, {}) for n in (4, 8, 16, 64)),
    *((f"{n} steps", {"max_steps": n}, {}) for n in (16, 32, 64)),
    ("any number of steps", {"max_steps": None}, {}),
    ("no hand-over", {"hand_over": False}, {}),
    *((f"probe {n} of 16", {"probes": n}, {}) for n in (1, 2, 4, 8, 16)),
    ("4x4 cells, 4 tests, 32 steps", {"max_tests": 4, "max_steps": 32}, {"cell": 4}),
    (
        "lists 2, 4 tests, 32 steps, probe 1 of 16",
        {"max_tests": 4, "max_steps": 32, "probes": 1},
        {"length": 2},
    ),
    CHEAPEST,
)
"""What "certified" can do without, or otherwise; each as `CHEAPEST`, the first is the default.

One that asks for what is the default anyway is no point of its own.
"""


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
    lists : ListsForm, optional
        The lists of primitives that the G-buffer has to hold.
    """

    technique: str
    label: str
    mode: hrt.Mode
    default: bool
    lists: ListsForm | None = None


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

    @property
    def nbytes(self) -> int:
        """Bytes of what was made: the pyramid, and lists if any."""
        return int(self.pyramid.data.nbytes) + (0 if self.lists is None else self.lists.nbytes)


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
        self.gbuffer = hrt.rasterize(scene, camera, threads=threads)
        self._screens: dict[tuple[type | None, ListsForm | None], Screen] = {}

    def screen(self, point: Point) -> Screen:
        """Return what the march of a point reads."""
        slope = isinstance(point.mode, hrt.SlopeAware)
        key = hrt.SlopeAware if slope else None, point.lists
        if key not in self._screens:
            if point.lists is not None:
                self._screens[key] = self._with_lists(point, point.lists)
            else:
                make = hrt.build_slope_pyramid if slope else hrt.build_depth_pyramid
                built, seconds = _timed(lambda: make(self.gbuffer, threads=self.threads))
                self._screens[key] = Screen(self.gbuffer, built, seconds)
        return self._screens[key]

    def _with_lists(self, point: Point, form: ListsForm) -> Screen:
        if not form.planes:
            whole = dataclasses.replace(form, planes=True)
            screen = self.screen(dataclasses.replace(point, lists=whole))
            assert screen.lists is not None
            # Every comparison denies NaN, so that no plane ever puts a primitive out of question.
            none = np.full_like(screen.lists.planes, np.nan)
            lists = dataclasses.replace(screen.lists, planes=none)
            return dataclasses.replace(screen, gbuffer=self._holding(lists))
        start = time.perf_counter()
        camera = form.camera(self.camera)
        gbuffer = self._holding(primitive_lists(self.scene, camera, form.length, self.threads))
        pyramid = hrt.build_depth_pyramid(gbuffer, conservative=True, threads=self.threads)
        return Screen(gbuffer, pyramid, time.perf_counter() - start)

    def _holding(self, lists: hrt.PrimitiveLists) -> hrt.GBuffer:
        return dataclasses.replace(self.gbuffer, lists=lists)


def points_of(technique: Technique, scene: hrt.Scene, which: Which) -> list[Point]:
    """Return the points of a technique, the one of its default parameters among them.

    Parameters
    ----------
    technique : Technique
    scene : Scene
        What lengths in world units relate to.
    which : {"all", "default", "switches", "cheapest"}
        The whole grid, or the default alone. Of "certified" also every one of `SWITCHES`, or the
        default and `CHEAPEST`; of all others these two are the default alone.
    """
    if isinstance(technique.mode, hrt.Certified):
        return _certified(technique.name, technique.mode, which)
    usual = _in_scene(technique.mode, scene)
    points = [
        Point(technique.name, label, mode, default=_in_scene(mode, scene) == usual)
        for label, mode in technique.points(scene)
    ]
    if not any(point.default for point in points):
        points.insert(0, Point(technique.name, "default", technique.mode, default=True))
    return points if which == "all" else [point for point in points if point.default]


def _certified(name: str, usual: hrt.Certified, which: Which) -> list[Point]:
    """Return the points of mode "certified", none twice, the default first but in its grid."""
    asked: dict[Which, Sequence[tuple[str, Changes, Changes]]] = {
        "all": [(f"lists {n}", {}, {"length": n}) for n in LISTS],
        "default": [(f"lists {LENGTH}", {}, {})],
        "switches": SWITCHES,
        "cheapest": [SWITCHES[0], CHEAPEST],
    }
    points: dict[tuple[hrt.Mode, ListsForm], Point] = {}
    for label, of_march, of_lists in asked[which]:
        mode, form = dataclasses.replace(usual, **of_march), ListsForm(**of_lists)
        default = (mode, form) == (usual, ListsForm())
        points.setdefault((mode, form), Point(name, label, mode, default, form))
    return list(points.values())


def _in_scene(mode: hrt.Mode, scene: hrt.Scene) -> hrt.Mode:
    """Return a mode with the thickness that it has in a scene, so that modes can be compared."""
    if isinstance(mode, hrt.Linear | hrt.PixelDDA | hrt.HiZ):
        return dataclasses.replace(mode, thickness=mode.thickness_in(scene))
    return mode


def _timed(call: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    made = call()
    return made, time.perf_counter() - start
