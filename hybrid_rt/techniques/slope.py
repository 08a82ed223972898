"""The paper's march through planes that bound tilted pixels."""

from __future__ import annotations

from dataclasses import dataclass

from hybrid_rt.base import Point, Screen, register
from hybrid_rt.kernels.techniques.slope import SlopeNumbers
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.slope_pyramid import SlopePyramid, build_slope_pyramid
from hybrid_rt.techniques import stepping


@register
@dataclass(frozen=True)
class SlopeAware(stepping.Sampled):
    """The paper's march over planes instead of depths, "slope".

    A cell holds a plane in front of all its pixels' tilted planes (`SlopePyramid`), so a floor seen
    at a glancing angle does not block the rays that leave it. A ray in front of a cell's plane from
    its entry to its exit is free there; a pixel is its own tilted plane, and where the ray meets
    that inside the pixel from the observer's side, the pixel is the answer. Nothing else is: no
    thickness, no skipped pixel.

    Attributes
    ----------
    samples, max_steps
        As in `Paper`.

    References
    ----------
    The march: as `Paper`. The planes are this project's.
    """

    name = "slope"
    description = (
        "The paper's march over planes that bound tilted pixels: as strict, less often blocked"
    )
    reference = "this project"

    @property
    def reads(self) -> tuple[str, ...]:
        """The pyramid of planes."""
        return ("slope pyramid",)

    @classmethod
    def _grid(cls, which: str) -> list[Point]:
        return cls._points(1, 4) if which == "all" else cls._points(4)

    def _read(self, gbuffer: GBuffer, threads: int | None) -> SlopePyramid:
        return build_slope_pyramid(gbuffer, threads=threads)

    def _numbers(self, screen: Screen) -> SlopeNumbers:
        return SlopeNumbers(*self._budgets(screen.camera), *stepping.levels_of(screen.data))
