"""The perspective-correct pixel DDA with a thickness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hybrid_rt import _threads
from hybrid_rt.kernels.techniques import dda as kernels
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.pyramid import DepthPyramid
from hybrid_rt.rays.rays import Rays
from hybrid_rt.techniques.marched import Marched
from hybrid_rt.techniques.modes import PixelDDA


def march(
    rays: Rays, gbuffer: GBuffer, pyramid: DepthPyramid, mode: PixelDDA, threads: int | None
) -> Marched:
    """Return what `PixelDDA` says about each ray; `hybrid_rt.march` has checked the arguments."""
    height, width = gbuffer.depth.shape
    max_steps = width + height + 2 if mode.max_steps is None else mode.max_steps
    marched = Marched.unfilled(len(rays))
    with _threads.limited(threads) as workers:
        kernels.march(
            workers,
            *rays.arrays,
            gbuffer.depth,
            gbuffer.prim_id,
            gbuffer.camera.pixel_from_world,
            np.array(gbuffer.camera.eye),
            gbuffer.camera.near,
            mode.thickness_in(gbuffer.scene),
            mode.stride,
            float(mode.jitter),
            max_steps,
            *marched.rows,
        )
    # Every sample is of the depth buffer itself.
    steps_by_level = np.zeros(len(pyramid), np.int64)
    steps_by_level[0] = marched.steps.sum(dtype=np.int64)
    return replace(marched, steps_by_level=steps_by_level)
