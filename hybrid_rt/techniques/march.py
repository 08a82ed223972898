"""March rays through what one view has on its screen."""

from __future__ import annotations

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.pyramid import DepthPyramid
from hybrid_rt.raster.slope_pyramid import Pyramid, SlopePyramid
from hybrid_rt.rays.rays import Rays
from hybrid_rt.techniques import certified, dda, hiz, linear, modes, paper, slope
from hybrid_rt.techniques.marched import Marched
from hybrid_rt.techniques.modes import Certified, HiZ, Linear, Mode, PixelDDA, SlopeAware


def march(
    rays: Rays,
    gbuffer: GBuffer,
    pyramid: Pyramid,
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
    pyramid : DepthPyramid or SlopePyramid
        Of `gbuffer`. A SlopePyramid is for mode "slope" only, which makes its own, within the call,
        where it gets a DepthPyramid; a conservative one for mode "certified" only.
    mode : {"paper", "certified", "slope", "linear", "dda", "hiz"} or a mode object
        The technique, one of `Paper`, `Certified`, `SlopeAware`, `Linear`, `PixelDDA`, `HiZ`; see
        `hybrid_rt.techniques.modes`. A name stands for its default parameters.
    any_hit : bool
        Whether any hit answers a ray and not only its nearest. In all modes but "certified" the
        first hit is the answer, and this changes nothing.
    threads : int, optional
        Default: as many as Numba is set to.

    Returns
    -------
    Marched
        N statuses and answers.

    Raises
    ------
    ArgumentError
        A pyramid of another size than the G-buffer or of the wrong kind, an unknown mode.

    Notes
    -----
    In mode "paper" free space is proven at pixel centres only, so 0.5 to 2 % of the answers are
    wrong by more than a pixel (``hybrid-rt run paper`` measures the rate). "slope" proves it over
    whole pixels, but only for the planes that the pixels show. "linear", "dda" and "hiz" guess a
    thickness, and are wrong wherever it is; "hiz" also answers rays with a miss.

    The same bits come out for any number of threads and any order of the rays. The inner loop
    computes in float32 from a float64 set-up.
    """
    _check.instance("rays", rays, Rays)
    _check.instance("gbuffer", gbuffer, GBuffer)
    _check.choice("any_hit", any_hit, (True, False))
    chosen = modes.named(mode)
    _check_pyramid(pyramid, gbuffer, chosen)
    if isinstance(chosen, SlopeAware):
        return slope.march(rays, gbuffer, pyramid, chosen, threads)
    assert isinstance(pyramid, DepthPyramid)
    if isinstance(chosen, Certified):
        return certified.march(rays, gbuffer, pyramid, chosen, any_hit, threads)
    if isinstance(chosen, Linear):
        return linear.march(rays, gbuffer, pyramid, chosen, threads)
    if isinstance(chosen, PixelDDA):
        return dda.march(rays, gbuffer, pyramid, chosen, threads)
    if isinstance(chosen, HiZ):
        return hiz.march(rays, gbuffer, pyramid, chosen, threads)
    return paper.march(rays, gbuffer, pyramid, chosen, threads)


def _check_pyramid(pyramid: Pyramid, gbuffer: GBuffer, mode: Mode) -> None:
    """Raise unless `pyramid` is one that `mode` can go through, and of the right size."""
    if not (isinstance(mode, SlopeAware) and isinstance(pyramid, SlopePyramid)):
        _check.instance("pyramid", pyramid, DepthPyramid)
    conservative = isinstance(pyramid, DepthPyramid) and pyramid.conservative
    lists = gbuffer.lists if conservative else None
    height, width = gbuffer.depth.shape if lists is None else lists.rest.shape
    whose = "G-buffer" if lists is None else "G-buffer's lists"
    if (pyramid.heights[0], pyramid.widths[0]) != (height, width):
        raise ArgumentError(
            "pyramid",
            f"the pyramid of the {whose}, {width} by {height} pixels at level 0",
            f"one of {pyramid.widths[0]} by {pyramid.heights[0]}",
        )
    if conservative and not isinstance(mode, Certified):
        raise ArgumentError("pyramid", "one of the depths at pixel centres", "a conservative one")
