"""The paper's march: nearest depths of a pyramid, then the tilted plane of one or two pixels."""

from __future__ import annotations

from dataclasses import dataclass

from hybrid_rt.base import Point, Screen, register
from hybrid_rt.kernels.techniques.paper import PaperNumbers
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.pyramid import DepthPyramid, build_depth_pyramid
from hybrid_rt.techniques import stepping


@register
@dataclass(frozen=True)
class Paper(stepping.Sampled):
    """The strict march of the paper, "paper".

    Nearest depths of cells, one level coarser after free samples, one finer after a blocked one;
    where a pixel blocks the ray, that pixel's tilted plane and then the previous pixel's decide; if
    neither does, the ray is unresolved. No thickness, no skipped pixel.

    Attributes
    ----------
    samples : int
        Consecutive samples of one level before the level may rise, >= 1. The paper takes 4.
    max_steps : int, optional
        Step budget of a ray. By default 2 (W + H) + 2, which no ray can use up: a blocked sample is
        paid for by an earlier free one, and a free one moves at least one pixel on.

    References
    ----------
    R. M. Pikulsky, "Ray Tracing Algorithm Based on Screen Space Ray Marching", Visnyk VNTU, 2025,
    no. 2, pp. 132-137, doi:10.31649/1997-9266-2025-179-2-132-137.
    """

    name = "paper"
    description = (
        "The paper's strict march through a nearest-depth pyramid, then Embree for unresolved rays"
    )
    reference = "Pikulsky 2025"

    @property
    def reads(self) -> tuple[str, ...]:
        """The depth pyramid."""
        return ("depth pyramid",)

    @classmethod
    def _grid(cls, which: str) -> list[Point]:
        return cls._points(1, 2, 4, 8) if which == "all" else cls._points(4)

    def _read(self, gbuffer: GBuffer, threads: int | None) -> DepthPyramid:
        return build_depth_pyramid(gbuffer, threads=threads)

    def _numbers(self, screen: Screen) -> PaperNumbers:
        return PaperNumbers(*self._budgets(screen.camera), *stepping.levels_of(screen.data))
