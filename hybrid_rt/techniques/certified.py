"""The certified march: an answer only where the lists of primitives prove it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt import _threads
from hybrid_rt._arrays import F64
from hybrid_rt.camera.pinhole import Camera
from hybrid_rt.kernels.techniques.certified import lanes as simd_kernels
from hybrid_rt.kernels.techniques.certified import scalar as kernels
from hybrid_rt.kernels.techniques.certified import slots
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.lists import PrimitiveLists, primitive_lists
from hybrid_rt.raster.pyramid import DepthPyramid, bits, build_depth_pyramid
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene
from hybrid_rt.techniques.marched import Marched, MarchWork
from hybrid_rt.techniques.modes import Certified

LENGTH = 8
"""Length of the lists that are made where a G-buffer has none."""
LARGEST_INDEX = 2**31 - 1


def march(
    rays: Rays,
    gbuffer: GBuffer,
    pyramid: DepthPyramid,
    mode: Certified,
    any_hit: bool,
    threads: int | None,
) -> Marched:
    """Return what `Certified` proves of each ray; arguments as `hybrid_rt.march` has checked them.

    Notes
    -----
    The proof and its error bounds are in `certified.scalar` and docs/certified.md.
    """
    lists = gbuffer.lists
    if lists is None:
        lists = primitive_lists(gbuffer.scene, gbuffer.camera, LENGTH, threads)
        gbuffer = replace(gbuffer, lists=lists)
    if not pyramid.conservative:
        pyramid = build_depth_pyramid(gbuffer, conservative=True, threads=threads)
    camera = lists.camera
    max_steps = mode.max_steps
    if max_steps is None:
        max_steps = 2 * (camera.width + camera.height) + 64
    limits = max_steps, mode.max_tests, any_hit
    if mode.vectors and _countable(rays, lists, pyramid):
        marched = _in_lanes(rays, gbuffer.scene, lists, pyramid, limits, mode.probes, threads)
    else:
        marched = _one_by_one(rays, gbuffer.scene, lists, pyramid, limits, threads)
    if camera != gbuffer.camera:
        marched.pixel.fill(-1)
    return marched


def _countable(rays: Rays, lists: PrimitiveLists, pyramid: DepthPyramid) -> bool:
    """Can the lanes, which are int32, index every array. A face has 9 coordinates of corners."""
    sizes = 3 * len(rays), lists.prim_id.size, 9 * len(lists.planes), pyramid.data.size
    return max(sizes) <= LARGEST_INDEX


def _in_lanes(
    rays: Rays,
    scene: Scene,
    lists: PrimitiveLists,
    pyramid: DepthPyramid,
    limits: tuple[int, int, bool],
    probes: int,
    threads: int | None,
) -> Marched:
    """March as many rays at a time as a vector has lanes."""
    camera = lists.camera
    width, height = camera.width, camera.height
    columns, rows = bits(width, height)
    marched = Marched.unfilled(len(rays))
    with _threads.limited(threads) as workers:
        counted = np.zeros((workers, slots.COUNTERS), np.int64)
        simd_kernels.march(
            workers,
            tuple(_flat(a) for a in (rays.origin, rays.direction, rays.t_near, rays.t_far)),
            (width, height),
            _box(scene, camera),
            _flat(lists.prim_id),
            _flat(lists.nearest),
            _flat(lists.rest),
            _flat(lists.planes),
            (width, height, lists.length, min(columns, rows)),
            pyramid.data,
            (rows, columns),
            _flat(scene.corners),
            *limits,
            probes,
            marched.rows,
            counted,
        )
    work = MarchWork(slots.W, *map(int, counted.sum(axis=0)))
    return replace(marched, tests=work.tests, work=work)


def _one_by_one(
    rays: Rays,
    scene: Scene,
    lists: PrimitiveLists,
    pyramid: DepthPyramid,
    limits: tuple[int, int, bool],
    threads: int | None,
) -> Marched:
    """March one ray after the other."""
    camera = lists.camera
    # As the lanes, rays go up to the level at which the shorter axis is one cell.
    levels = min(bits(camera.width, camera.height)) + 1
    marched = Marched.unfilled(len(rays))
    with _threads.limited(threads) as workers:
        steps_by_level = np.zeros((workers, len(pyramid)), np.int64)
        tests = np.zeros((workers, 1), np.int64)
        kernels.march(
            workers,
            rays.origin,
            rays.direction,
            rays.t_near,
            rays.t_far,
            lists.prim_id,
            lists.nearest,
            lists.rest,
            lists.planes,
            pyramid.data,
            pyramid.offsets[:levels],
            pyramid.pitches,
            scene.vertices,
            scene.faces,
            *_box(scene, camera),
            *limits,
            *marched.rows,
            steps_by_level,
            tests,
        )
    return replace(marched, steps_by_level=steps_by_level.sum(axis=0), tests=int(tests.sum()))


def _box(scene: Scene, camera: Camera) -> tuple[F64, F64, float, float, F64, F64]:
    """Return the projection, the eye, the near plane, `spread` (see `kernels.trusted`), bounds."""
    m = camera.pixel_from_world
    rows = np.abs(m).sum(axis=1)
    longer = max(camera.width, camera.height) + 1
    low, high = scene.bounds
    spread = float(max(rows[0], rows[1]) / longer + rows[2])
    return m, np.array(camera.eye), float(camera.near), spread, low, high


def _flat(values: NDArray[Any]) -> NDArray[Any]:
    """Return an array in one dimension, as vectors are loaded from; a copy if it has gaps."""
    # A read-only array has a type of its own in Numba and would compile the kernel again.
    return np.require(values, requirements=["C", "W"]).reshape(-1)
