"""March rays through what one view has on its screen."""

from __future__ import annotations

from hybrid_rt import _check, certified, modes, paper
from hybrid_rt.errors import ArgumentError
from hybrid_rt.modes import Certified, Mode
from hybrid_rt.types import DepthPyramid, GBuffer, Marched, Rays


def march(
    rays: Rays,
    gbuffer: GBuffer,
    pyramid: DepthPyramid,
    mode: str | Mode = "paper",
    *,
    any_hit: bool = False,
    threads: int | None = None,
) -> Marched:
    """Return what the screen says about each ray, and for which rays it says nothing.

    Parameters
    ----------
    rays : Rays
        N rays, world. A ray whose `pixel` is the pixel it starts in is taken to start on the
        surface visible there.
    gbuffer : GBuffer
    pyramid : DepthPyramid
        Of `gbuffer`.
    mode : {"paper", "certified"} or a mode object
        The technique; see `hybrid_rt.modes`. A name stands for its default parameters.
    any_hit : bool
        Whether any hit answers a ray and not only its nearest. For "paper", whose first hit is its
        answer, this changes nothing.
    threads : int, optional
        Default: as many as Numba is set to.

    Returns
    -------
    Marched
        N statuses and answers.

    Raises
    ------
    ArgumentError
        A pyramid of another size than the G-buffer, an unknown mode.

    Notes
    -----
    In mode "paper" free space is proven at pixel centres only, so 0.5 to 2 % of the answers are
    wrong by more than a pixel (``hybrid-rt run paper`` measures the rate).

    The same bits come out for any number of threads and any order of the rays. The inner loop
    computes in float32 from a float64 set-up.
    """
    _check.instance("rays", rays, Rays)
    _check.instance("gbuffer", gbuffer, GBuffer)
    _check.instance("pyramid", pyramid, DepthPyramid)
    _check.choice("any_hit", any_hit, (True, False))
    chosen = modes.named(mode)
    height, width = gbuffer.depth.shape
    if (pyramid.heights[0], pyramid.widths[0]) != (height, width):
        raise ArgumentError(
            "pyramid",
            f"the pyramid of the G-buffer, {width} by {height} pixels at level 0",
            f"one of {pyramid.widths[0]} by {pyramid.heights[0]}",
        )
    if isinstance(chosen, Certified):
        return certified.march(rays, gbuffer, pyramid, chosen, any_hit, threads)
    if pyramid.conservative:
        raise ArgumentError("pyramid", "one of the depths at pixel centres", "a conservative one")
    return paper.march(rays, gbuffer, pyramid, chosen, threads)
