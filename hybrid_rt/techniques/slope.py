"""The paper's march through planes that bound tilted pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hybrid_rt import _threads
from hybrid_rt.kernels.techniques import slope as kernels
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.slope_pyramid import Pyramid, SlopePyramid, build_slope_pyramid
from hybrid_rt.rays.rays import Rays
from hybrid_rt.techniques.marched import Marched
from hybrid_rt.techniques.modes import SlopeAware


def march(
    rays: Rays, gbuffer: GBuffer, pyramid: Pyramid, mode: SlopeAware, threads: int | None
) -> Marched:
    """Return what `SlopeAware` says about each ray; `hybrid_rt.march` has checked the arguments.

    A `DepthPyramid` has no slopes: the planes are then built from the G-buffer, in this call.
    """
    height, width = gbuffer.depth.shape
    max_steps = 2 * (width + height) + 2 if mode.max_steps is None else mode.max_steps
    if not isinstance(pyramid, SlopePyramid):
        pyramid = build_slope_pyramid(gbuffer, threads=threads)
    marched = Marched.unfilled(len(rays))
    with _threads.limited(threads) as workers:
        steps_by_level = np.zeros((workers, len(pyramid)), np.int64)
        kernels.march(
            workers,
            *rays.arrays,
            gbuffer.prim_id,
            pyramid.data,
            pyramid.offsets,
            pyramid.pitches,
            gbuffer.camera.pixel_from_world,
            np.array(gbuffer.camera.eye),
            gbuffer.camera.near,
            mode.samples,
            max_steps,
            *marched.rows,
            steps_by_level,
        )
    return replace(marched, steps_by_level=steps_by_level.sum(axis=0))
