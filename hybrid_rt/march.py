"""March rays through the depth pyramid of one view."""

from __future__ import annotations

from typing import Literal

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels import march as kernels
from hybrid_rt.types import DepthPyramid, GBuffer, Marched, Rays

MODES = ("paper",)


def march(
    rays: Rays,
    gbuffer: GBuffer,
    pyramid: DepthPyramid,
    *,
    mode: Literal["paper"] = "paper",
    samples: int = 4,
    max_steps: int | None = None,
    threads: int | None = None,
) -> Marched:
    """Return what the screen says about each ray, and for which rays it says nothing.

    Parameters
    ----------
    rays : Rays
        N rays, world. A ray whose `pixel` is the pixel it starts in is taken to start on the
        surface visible there; that pixel is left without being read.
    gbuffer : GBuffer
    pyramid : DepthPyramid
        Of `gbuffer`.
    mode : {"paper"}
        "paper": the strict march of [1]_. Nearest depths of cells, one level coarser after free
        samples, one finer after a blocked one; where a pixel blocks the ray, that pixel's tilted
        plane and then the previous pixel's decide; if neither does, the ray is unresolved. No
        thickness, no skipped pixel.
    samples : int
        Consecutive samples of one level before the level may rise, >= 1. The paper takes 4.
    max_steps : int, optional
        Step budget of a ray. By default 2 (W + H) + 2, which no ray can use up: a blocked sample is
        paid for by an earlier free one, and a free one moves at least one pixel on.
    threads : int, optional
        Default: as many as Numba is set to.

    Returns
    -------
    Marched
        N statuses and answers. In mode "paper" only `MarchStatus.HIT` is an answer.

    Raises
    ------
    ArgumentError
        A pyramid of another size than the G-buffer, an unknown mode, samples or max_steps < 1.

    Notes
    -----
    Free space is proven at pixel centres only, so 0.5 to 2 % of the answers are wrong by more than
    a pixel (``hybrid-rt run paper`` measures the rate). The same bits come out for any number of
    threads and any order of the rays. The inner loop computes in float32 from a float64 set-up.

    References
    ----------
    .. [1] R. M. Pikulsky, "Ray Tracing Algorithm Based on Screen Space Ray Marching", Visnyk VNTU,
       2025, no. 2, pp. 132-137, doi:10.31649/1997-9266-2025-179-2-132-137.
    """
    _check.instance("rays", rays, Rays)
    _check.instance("gbuffer", gbuffer, GBuffer)
    _check.instance("pyramid", pyramid, DepthPyramid)
    _check.choice("mode", mode, MODES)
    samples = _check.integer("samples", samples, least=1)
    height, width = gbuffer.depth.shape
    if (pyramid.heights[0], pyramid.widths[0]) != (height, width):
        raise ArgumentError(
            "pyramid",
            f"the pyramid of the G-buffer, {width} by {height} pixels at level 0",
            f"one of {pyramid.widths[0]} by {pyramid.heights[0]}",
        )
    if max_steps is None:
        max_steps = 2 * (width + height) + 2
    max_steps = _check.integer("max_steps", max_steps, least=1, most=2**31 - 1)
    n = len(rays)
    status = np.empty(n, np.uint8)
    pixel = np.empty((n, 2), np.int32)
    prim = np.empty(n, np.int32)
    t = np.empty(n, np.float32)
    t_free = np.empty(n, np.float32)
    steps = np.empty(n, np.int32)
    with _threads.limited(threads) as workers:
        steps_by_level = np.zeros((workers, len(pyramid)), np.int64)
        kernels.march(
            workers,
            rays.origin,
            rays.direction,
            rays.pixel,
            rays.t_near,
            rays.t_far,
            gbuffer.depth,
            gbuffer.ddx,
            gbuffer.ddy,
            gbuffer.prim_id,
            pyramid.data,
            pyramid.offsets,
            pyramid.widths,
            gbuffer.camera.pixel_from_world,
            np.array(gbuffer.camera.eye),
            gbuffer.camera.near,
            samples,
            max_steps,
            status,
            pixel,
            prim,
            t,
            t_free,
            steps,
            steps_by_level,
        )
    return Marched(status, pixel, prim, t, t_free, steps, steps_by_level.sum(axis=0))
