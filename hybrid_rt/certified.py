"""The certified march: an answer only where the lists of primitives prove it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hybrid_rt import _threads
from hybrid_rt.kernels import certified as kernels
from hybrid_rt.lists import primitive_lists
from hybrid_rt.modes import Certified
from hybrid_rt.pyramid import build_depth_pyramid
from hybrid_rt.types import DepthPyramid, GBuffer, Marched, Rays

LENGTH = 8
"""Length of the lists that are made where a G-buffer has none."""


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
    The proof and its error bounds are in `hybrid_rt.kernels.certified` and docs/certified.md.
    """
    scene, camera = gbuffer.scene, gbuffer.camera
    lists = gbuffer.lists
    if lists is None:
        lists = primitive_lists(scene, camera, LENGTH, threads)
        gbuffer = replace(gbuffer, lists=lists)
    if not pyramid.conservative:
        pyramid = build_depth_pyramid(gbuffer, conservative=True, threads=threads)
    m = camera.pixel_from_world
    rows = np.abs(m).sum(axis=1)
    longer = max(camera.width, camera.height) + 1
    max_steps = 2 * (camera.width + camera.height) + 64
    low, high = scene.bounds
    marched = Marched.unfilled(len(rays), len(pyramid))
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
            pyramid.offsets,
            pyramid.pitches,
            scene.vertices,
            scene.faces,
            m,
            np.array(camera.eye),
            camera.near,
            float(max(rows[0], rows[1]) / longer + rows[2]),
            low,
            high,
            max_steps if mode.max_steps is None else mode.max_steps,
            mode.max_tests,
            any_hit,
            *marched.rows,
            steps_by_level,
            tests,
        )
    steps_by_level.sum(axis=0, out=marched.steps_by_level)
    return replace(marched, tests=int(tests.sum()))
