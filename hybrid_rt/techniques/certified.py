"""The certified march: an answer only where the lists of primitives prove it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.base import Point, Screen, Technique, register
from hybrid_rt.camera.camera import LARGEST_SIDE, Camera
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import Box
from hybrid_rt.kernels.techniques.certified import lanes, scalar, slots
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.lists import PrimitiveLists, primitive_lists
from hybrid_rt.raster.pyramid import DepthPyramid, bits, pyramid_of
from hybrid_rt.rays.marched import Marched, MarchWork
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene
from hybrid_rt.techniques import stepping

PROBES = (1, 2, 4, 8, 16)
"""Of 16 rays, how many can be marched first."""
LONGEST, WIDEST_CELL, WIDEST_GUARD = 64, 64, 8.0
LARGEST_INDEX = 2**31 - 1


@dataclass(frozen=True, eq=False)
class CertifiedData:
    """What the certified march reads: lists, and the pyramid of their first bounds."""

    lists: PrimitiveLists
    pyramid: DepthPyramid

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return self.lists.nbytes + self.pyramid.nbytes


@register
@dataclass(frozen=True)
class Certified(Technique):
    """Answers only what is proven, "certified": never a wrong hit, never a wrong miss.

    Depths of whole pixel squares instead of pixel centres prove free space; where a square may hold
    something as near as the ray, the ray is intersected with the primitives of the pixel's list in
    float64 with error bounds; a ray is answered when nothing nearer than its hit is left, or
    nothing at all up to infinity, its t_far or the scene's bounds. docs/certified.md has the proof.

    Attributes
    ----------
    lists : int
        Longest list of primitives that is kept for each pixel square, 1 to 64; 8 bytes a primitive
        and pixel.
    cell : int
        Pixels of the image along each side of a square that shares a list, 1 to 64. Proofs need no
        pixel of the image, and larger squares are cheaper to make and to walk through.
    guard : float
        Width and height of what has lists, in those of the screen, 1 to 8: above 1, rays that leave
        the screen stay in sight.
    planes : bool
        Whether planes of primitives are kept, which put off most exact tests.
    max_tests : int
        Budget of exact tests of a ray, >= 1; a ray that needs more is unresolved.
    max_steps : int, optional
        Step budget of a ray. None: 2 (W + H) + 64, W by H the size of the lists, which no ray can
        use up. The default gives up those few that pass behind something near for long and take
        much of the time; ``hybrid-rt run ablation`` measures both budgets.
    hand_over : bool
        Whether `hybrid_rt.trace_hybrid` starts unresolved rays where the proof ended.
    probes : {1, 2, 4, 8, 16}
        Of each 16 consecutive rays so many, evenly spread, are marched first, and the others only
        if the screen answered one of them. It saves marches where the screen has nothing to say.
        No answer changes: a ray that is left out is unresolved, `MarchStatus.SKIPPED`, whether or
        not the screen could have answered it, and goes to the tracer. 16 marches all rays.
    vectors : bool
        Whether rays are marched in the lanes of vectors, several at a time. The answers are the
        same, bit for bit, without; steps are then counted by level too. Without, `probes` must
        be 16. More than 2**31 numbers in an array, of rays, lists or triangles, are too many for
        the lanes: then all rays are marched without.
    """

    name = "certified"
    description = (
        "Exact tests against the few primitives that can touch a pixel: only what is proven"
    )
    reference = "this project"
    certified = True
    answers_misses = True

    lists: int = 8
    cell: int = 1
    guard: float = 1.0
    planes: bool = True
    max_tests: int = 16
    max_steps: int | None = 64
    hand_over: bool = True
    probes: int = 16
    vectors: bool = True

    def __post_init__(self) -> None:
        _check.integer("lists", self.lists, least=1, most=LONGEST)
        _check.integer("cell", self.cell, least=1, most=WIDEST_CELL)
        if not 1.0 <= _check.real("guard", self.guard) <= WIDEST_GUARD:
            raise ArgumentError("guard", "a number from 1 to 8", _check.describe(self.guard))
        _check.boolean("planes", self.planes)
        _check.integer("max_tests", self.max_tests, least=1, most=stepping.MOST)
        stepping.checked_steps(self.max_steps)
        _check.boolean("hand_over", self.hand_over)
        _check.choice("probes", _check.integer("probes", self.probes, least=1, most=16), PROBES)
        _check.boolean("vectors", self.vectors)
        if not self.vectors and self.probes != 16:
            raise ArgumentError("probes", "16 where vectors=False", str(self.probes))

    @property
    def reads(self) -> tuple[Any, ...]:
        """The lists, by their form."""
        return "lists", int(self.lists), int(self.cell), float(self.guard), bool(self.planes)

    @property
    def hands_over(self) -> bool:
        """Whether a tracer starts where the proof ended."""
        return bool(self.hand_over)

    @classmethod
    def _grid(cls, which: str) -> list[Point]:
        grids: dict[str, Sequence[tuple[str, dict[str, Any]]]] = {
            "all": [(f"lists {n}", {"lists": n}) for n in LENGTHS],
            "default": [(f"lists {cls().lists}", {})],
            "switches": SWITCHES,
            "cheapest": [SWITCHES[0], CHEAPEST],
        }
        points: dict[Certified, Point] = {}
        for label, changes in grids[which]:  # one that asks for the default is no point of its own
            technique = cls(**changes)
            points.setdefault(technique, Point(label, technique))
        return list(points.values())

    def lists_camera(self, camera: Camera) -> Camera:
        """Return the view in whose pixels the lists for a screen are made.

        Raises
        ------
        ArgumentError
            With the guard band it would have more pixels along a side than a camera may.
        """
        _check.instance("camera", camera, Camera)
        longest = max(camera.width, camera.height) * self.guard
        if longest > LARGEST_SIDE:
            most = LARGEST_SIDE / max(camera.width, camera.height)
            got = _check.describe(self.guard)
            raise ArgumentError("guard", f"at most {most:g} for a view of this size", got)
        wide = camera if self.guard == 1.0 else camera.widened(self.guard)
        return wide.resized(max(1, wide.width // self.cell), max(1, wide.height // self.cell))

    def _read(self, gbuffer: GBuffer, threads: int | None) -> CertifiedData:
        camera = self.lists_camera(gbuffer.camera)
        lists = primitive_lists(gbuffer.known_scene, camera, int(self.lists), threads)
        if not self.planes:
            # Every comparison denies NaN, so that no plane ever puts a primitive out of question.
            lists.planes.fill(np.nan)
        nearest = np.ascontiguousarray(lists.nearest[:, :, 0])
        return CertifiedData(lists, pyramid_of(nearest, threads))

    def _march(self, rays: Rays, screen: Screen, any_hit: bool, threads: int | None) -> Marched:
        data = screen.data
        camera = data.lists.camera
        max_steps = self.max_steps or 2 * (camera.width + camera.height) + 64
        limits = int(max_steps), int(self.max_tests), any_hit
        if self.vectors and _countable(rays, data):
            marched = _in_lanes(rays, screen.scene, data, limits, int(self.probes), threads)
        else:
            marched = _one_by_one(rays, screen.scene, data, limits, threads)
        if camera != screen.camera:
            marched.pixel.fill(-1)
        return marched


LENGTHS = (2, 4, 8, 16)
"""Of lists, in the grid."""

CHEAPEST: tuple[str, dict[str, Any]] = (
    "4x4 cells, guard x2, 4 tests, 32 steps, probe 1 of 16",
    {"max_tests": 4, "max_steps": 32, "probes": 1, "cell": 4, "guard": 2.0},
)
"""A march that gives up early: its label, and what it changes of the default."""

SWITCHES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("base", {}),
    ("one ray at a time", {"vectors": False}),
    ("no planes", {"planes": False}),
    *((f"lists {n}", {"lists": n}) for n in LENGTHS),
    *((f"{n}x{n} cells", {"cell": n}) for n in (1, 2, 4, 8)),
    *((f"guard x{g:g}", {"guard": g}) for g in (1.5, 2.0)),
    *((f"4x4 cells, guard x{g:g}", {"cell": 4, "guard": g}) for g in (1.5, 2.0)),
    *((f"{n} tests", {"max_tests": n}) for n in (4, 8, 16, 64)),
    *((f"{n} steps", {"max_steps": n}) for n in (16, 32, 64)),
    ("any number of steps", {"max_steps": None}),
    ("no hand-over", {"hand_over": False}),
    *((f"probe {n} of 16", {"probes": n}) for n in PROBES),
    ("4x4 cells, 4 tests, 32 steps", {"max_tests": 4, "max_steps": 32, "cell": 4}),
    (
        "lists 2, 4 tests, 32 steps, probe 1 of 16",
        {"max_tests": 4, "max_steps": 32, "probes": 1, "lists": 2},
    ),
    CHEAPEST,
)
"""What it can do without, or otherwise; each as `CHEAPEST`, the first is the default."""


def _countable(rays: Rays, data: CertifiedData) -> bool:
    """Can the lanes, which are int32, index every array. A face has 9 coordinates of corners."""
    lists = data.lists
    sizes = 3 * len(rays), lists.prim_id.size, 9 * len(lists.planes), data.pyramid.data.size
    return max(sizes) <= LARGEST_INDEX


def _in_lanes(
    rays: Rays,
    scene: Scene,
    data: CertifiedData,
    limits: tuple[int, int, bool],
    probes: int,
    threads: int | None,
) -> Marched:
    """March as many rays at a time as a vector has lanes."""
    lists, camera = data.lists, data.lists.camera
    width, height = camera.width, camera.height
    columns, rows = bits(width, height)
    marched = Marched.unfilled(len(rays))
    origin, direction, _, t_near, t_far = rays.arrays
    with _threads.limited(threads) as workers:
        counted = np.zeros((workers, slots.COUNTERS), np.int64)
        lanes.march(
            (origin.reshape(-1), direction.reshape(-1), t_near, t_far),
            (width, height),
            tuple(_box(scene, camera)),
            lists.prim_id.reshape(-1),
            lists.nearest.reshape(-1),
            lists.rest.reshape(-1),
            lists.planes.reshape(-1),
            (width, height, lists.length, min(columns, rows)),
            data.pyramid.arrays.cells,
            (rows, columns),
            scene.corners.reshape(-1),
            *limits,
            probes,
            tuple(marched.arrays),
            counted,
        )
    work = MarchWork(slots.W, *map(int, counted.sum(axis=0)))
    return replace(marched, tests=work.tests, work=work)


def _one_by_one(
    rays: Rays,
    scene: Scene,
    data: CertifiedData,
    limits: tuple[int, int, bool],
    threads: int | None,
) -> Marched:
    """March one ray after the other."""
    camera, pyramid = data.lists.camera, data.pyramid.arrays
    # As the lanes, rays go up to the level at which the shorter axis is one cell.
    levels = min(bits(camera.width, camera.height)) + 1
    marched = Marched.unfilled(len(rays))
    with _threads.limited(threads) as workers:
        steps_by_level = np.zeros((workers, len(data.pyramid)), np.int64)
        tests = np.zeros((workers, 1), np.int64)
        scalar.march(
            rays.arrays, _box(scene, camera), data.lists.arrays,
            pyramid._replace(offsets=pyramid.offsets[:levels]), scene.arrays, limits,
            marched.arrays, steps_by_level, tests,
        )  # fmt: skip
    return replace(marched, steps_by_level=steps_by_level.sum(axis=0), tests=int(tests.sum()))


def _box(scene: Scene, camera: Camera) -> Box:
    """Return a view as a proof needs it; `spread`, `deep`, `apart`: see `scalar.trusted`."""
    view = camera.arrays
    rows, constants = np.abs(view.m[:, :3]).sum(axis=1), np.abs(view.m[:, 3])
    longer = max(camera.width, camera.height) + 1
    low, high = scene.bounds.copy()
    spread = float(max(rows[0], rows[1]) / longer + rows[2])
    # A constant that is all of its row has no error.
    apart = max(float(c / r) if r > 0.0 else 0.0 for r, c in zip(rows, constants, strict=True))
    return Box(view.m, view.eye, spread, float(rows[3]), apart, low, high)
