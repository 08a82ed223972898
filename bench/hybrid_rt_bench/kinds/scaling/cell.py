"""Measure one cell of kind "scaling" in a process of its own.

A process of its own has a peak of memory that is the cell's, and takes nothing with it but the cell
if memory runs out. All cells of a series are alive at once and are visited in turn, round after
round, so that a slow spell of the machine falls on all of them. Between visits a cell gives back
what it does not need; each visit therefore begins with passes that are not measured, and which find
caches, threads and freed memory as a measured pass needs them.
"""

from __future__ import annotations

import functools
import gc
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numba

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.scaling.stages import SHARED, Key
from hybrid_rt_bench.measure import compiling, memory, strongest
from hybrid_rt_bench.measure.errors import CellError
from hybrid_rt_bench.measure.loaded import native_path
from hybrid_rt_bench.measure.plan import find_scene

TRIED_RAYS = 64
"""On how many rays it is tried how long brute force would take."""


@dataclass(frozen=True)
class Task:
    """What a cell is, plain enough to be sent to a process.

    Attributes
    ----------
    scene, camera : str
    size : int or None
        Triangles asked of the scene.
    width, height : int
        Pixels.
    threads : int
        For every stage alike.
    techniques : tuple of str
    selection_rays : int
    build : bool
        Whether Embree's structure is built in every pass.
    brute_rays : int
        Rays of the brute-force sample, 0 for none.
    brute_seconds : float
        It is left out where a pass would take longer.
    """

    scene: str
    camera: str
    size: int | None
    width: int
    height: int
    threads: int
    techniques: tuple[str, ...]
    selection_rays: int
    build: bool
    brute_rays: int = 0
    brute_seconds: float = 0.0


@dataclass(frozen=True)
class Visit:
    """What one visit to a cell found.

    Attributes
    ----------
    rows : list of dict
        Samples: technique, stage, round, seconds, phase.
    alpha, steps : dict of float
        Share of rays that the screen answers, and steps per ray, by technique.
    peak : int or None
        Most bytes of memory during the visit; since the process began where the system cannot
        count from a visit on.
    """

    rows: list[dict[str, Any]]
    alpha: dict[str, float]
    steps: dict[str, float]
    peak: int | None


class Stages:
    """The timed stages of a cell, each run once by `run`.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    tracer : EmbreeTracer
        The strongest.
    task : Task
    """

    def __init__(
        self, scene: hrt.Scene, camera: hrt.Camera, tracer: hrt.EmbreeTracer, task: Task
    ) -> None:
        self.scene, self.camera, self.task = scene, camera, task
        self.tracer: hrt.EmbreeTracer | None = tracer
        self.options: dict[str, Any] = {
            "path": tracer.path,
            "width": tracer.width,
            "robust": tracer.robust,
            "coherent": tracer.coherent,
        }
        # In every cell the same build is timed, also where embreex's own path, which copies the
        # scene through Python, is the strongest.
        self.built = {**self.options, "path": native_path()}
        self.techniques = {name: hrt.TECHNIQUES[name]() for name in task.techniques}
        self.brute = hrt.BruteForceTracer(scene, threads=task.threads)
        self.brute_rays = task.brute_rays
        self.alpha: dict[str, float] = {}
        self.steps: dict[str, float] = {}

    def run(self, *, trace_first: bool) -> dict[Key, float]:
        """Return the seconds of every stage by technique and stage, garbage collection apart."""
        gc.collect()
        gc.disable()
        try:
            return self._run(trace_first)
        finally:
            gc.enable()

    def _run(self, trace_first: bool) -> dict[Key, float]:
        seconds: dict[Key, float] = {}
        threads = self.task.threads

        def timed(stage: str, call: Callable[[], Any]) -> Any:
            start = time.perf_counter()
            made = call()
            seconds[SHARED, stage] = time.perf_counter() - start
            return made

        if self.task.build:
            replaced = self.options["path"] == self.built["path"]
            if replaced:
                self.tracer = None  # never two of them in memory
            built = timed("build", lambda: self.make_tracer(self.built))
            self.tracer = built if replaced else self.tracer
            del built
        tracer = self.tracer
        assert tracer is not None
        gbuffer = timed("raster", lambda: hrt.rasterize(self.scene, self.camera, threads=threads))
        rays = timed("rays", lambda: hrt.mirror_rays(gbuffer))
        if trace_first:
            timed("embree", lambda: tracer.intersect(rays))
        for name, technique in self.techniques.items():
            screen = technique.prepare(gbuffer, threads=threads)
            seconds[name, "prepare"] = screen.seconds
            result = hrt.trace_hybrid(rays, screen, tracer, threads=threads)
            for stage, value in result.timings.items():
                seconds[name, stage] = float(value)
            self.alpha[name] = float(result.resolved.mean())
            self.steps[name] = float(result.marched.steps.mean())
            del screen, result  # not while the next one makes its own
        if not trace_first:
            timed("embree", lambda: tracer.intersect(rays))
        if self.brute_rays:
            few = strongest.sample_of(rays, self.brute_rays)
            self.brute_rays = len(few)
            timed("brute_force", lambda: self.brute.intersect(few))
        return seconds

    def make_tracer(self, options: dict[str, Any]) -> hrt.EmbreeTracer:
        """Return a tracer, newly built."""
        return hrt.EmbreeTracer(self.scene, threads=self.task.threads, **options)


class Cell:
    """A cell made ready: scene loaded, strongest Embree found, everything compiled.

    Parameters
    ----------
    task : Task

    Attributes
    ----------
    details : dict
        What is known of the cell before it is timed.

    Raises
    ------
    CellError
        The camera sees no surface.
    HybridRTError
        The scene cannot be loaded, or not in that size.
    """

    def __init__(self, task: Task) -> None:
        numba.set_num_threads(task.threads)
        compiled = compiling.first_calls(stages_to_compile(task), lambda *_: None)
        gc.collect()
        memory.trim()
        program = memory.resident()
        spec = find_scene(task.scene)
        scene = spec.load(size=task.size)
        camera = spec.camera(task.camera, task.width, task.height)
        gc.collect()
        memory.trim()
        details: dict[str, Any] = {
            "triangles": len(scene),
            "compile_seconds": sum(compiled.values()),
            "program_bytes": program,
            "scene_bytes": max(0, memory.resident() - program),
        }
        tracer, rays, found = _strongest(scene, camera, task)
        self.stages = Stages(scene, camera, tracer, task)
        del tracer
        details |= {"rays": len(rays), **found}
        if task.brute_rays:
            details["brute_force_seconds"] = self._try_brute(rays)
        del rays
        gc.collect()
        memory.keep_freed()
        memory.trim()
        details["peak_is_of_rounds"] = memory.reset_peak()
        self.details = details

    def answer(self, number: int, warmup: int) -> Visit:
        """Return what round `number` takes, after `warmup` passes that are kept as such."""
        memory.reset_peak()
        rows = []
        for index in range(warmup + 1):
            phase = "measured" if index == warmup else "warmup"
            for (technique, stage), seconds in self.stages.run(trace_first=number % 2 == 0).items():
                row = {"technique": technique, "stage": stage, "round": number}
                rows.append({**row, "seconds": seconds, "phase": phase})
        peak = memory.peak()
        gc.collect()
        memory.trim()
        return Visit(rows, dict(self.stages.alpha), dict(self.stages.steps), peak)

    def _try_brute(self, rays: hrt.Rays) -> float:
        """Return how long brute force will take in a pass, and leave it out if that is too long."""
        task, stages = self.stages.task, self.stages
        few = strongest.sample_of(rays, TRIED_RAYS)
        start = time.perf_counter()
        stages.brute.intersect(few)
        each = (time.perf_counter() - start) / len(few)
        expected = each * min(task.brute_rays, len(rays))
        stages.brute_rays = task.brute_rays if expected <= task.brute_seconds else 0
        return expected


def stages_to_compile(task: Task) -> compiling.Stages:
    """Return what is to be compiled: all stages of a cell, on a tiny view."""
    small = replace(
        task, width=64, height=48, brute_rays=TRIED_RAYS if task.brute_rays else 0, build=True
    )
    spec = find_scene("cornell")
    scene = spec.load()
    camera = spec.camera(next(iter(spec.cameras)), small.width, small.height)
    strong = functools.cache(lambda: _strongest(scene, camera, small)[0])

    def stages(*techniques: str) -> Callable[[], Any]:
        mine = replace(small, techniques=techniques)
        return lambda: Stages(scene, camera, strong(), mine).run(trace_first=True)

    return {
        "raster and Embree": lambda: _strongest(scene, camera, small),
        **{name: stages(name) for name in task.techniques},
    }


def _strongest(
    scene: hrt.Scene, camera: hrt.Camera, task: Task
) -> tuple[hrt.EmbreeTracer, hrt.Rays, dict[str, Any]]:
    """Return a tracer of the strongest path and nothing else, the mirror rays, and the choice."""
    rays = hrt.mirror_rays(hrt.rasterize(scene, camera, threads=task.threads))
    if len(rays) == 0:
        raise CellError("the camera sees no surface, so there are no mirror rays")
    robust, default = (
        hrt.EmbreeTracer(scene, threads=task.threads, path=native_path(), robust=mode)
        for mode in (True, False)
    )
    choice = strongest.choose(strongest.candidates(robust, default), rays, task.selection_rays)
    best = choice.best.tracer
    alone = hrt.EmbreeTracer(
        scene, threads=task.threads, path=best.path, width=best.width, robust=best.robust,
        coherent=best.coherent,
    )  # fmt: skip
    found = {"embree_path": choice.best.label, "embree_ns_per_ray": choice.nanoseconds}
    return alone, rays, found
