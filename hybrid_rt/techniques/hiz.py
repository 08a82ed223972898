"""The hierarchical-Z march with a thickness, a vignette and a confidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hybrid_rt import _threads
from hybrid_rt.kernels.techniques import hiz as kernels
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.pyramid import DepthPyramid
from hybrid_rt.rays.rays import Rays
from hybrid_rt.techniques.marched import Marched
from hybrid_rt.techniques.modes import HiZ


def march(
    rays: Rays, gbuffer: GBuffer, pyramid: DepthPyramid, mode: HiZ, threads: int | None
) -> Marched:
    """Return what `HiZ` says about each ray; `hybrid_rt.march` has checked the arguments."""
    marched = Marched.unfilled(len(rays))
    with _threads.limited(threads) as workers:
        steps_by_level = np.zeros((workers, len(pyramid)), np.int64)
        kernels.march(
            workers,
            *rays.arrays,
            gbuffer.depth,
            gbuffer.ddx,
            gbuffer.ddy,
            gbuffer.prim_id,
            pyramid.data,
            pyramid.offsets,
            pyramid.pitches,
            gbuffer.camera.pixel_from_world,
            np.array(gbuffer.camera.eye),
            gbuffer.camera.near,
            mode.thickness_in(gbuffer.scene),
            float(mode.threshold),
            float(mode.border),
            mode.exhausted_hits,
            mode.trace_background,
            mode.max_steps,
            *marched.rows,
            steps_by_level,
        )
    return replace(marched, steps_by_level=steps_by_level.sum(axis=0))
