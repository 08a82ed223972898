"""The hierarchical-Z march with a thickness, a vignette and a confidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hybrid_rt import _check
from hybrid_rt.base import Point, Screen, register
from hybrid_rt.kernels.techniques.hiz import HiZNumbers
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.pyramid import DepthPyramid, build_depth_pyramid
from hybrid_rt.techniques import stepping
from hybrid_rt.techniques.stepping import DEFAULT_THICKNESS, THICKNESSES, Share

SWITCHES: dict[str, dict[str, Any]] = {
    "exhausted traced": {"exhausted_hits": False},
    "background traced": {"trace_background": True},
    "exhausted and background traced": {"exhausted_hits": False, "trace_background": True},
    "no vignette": {"border": 0.0},
    "threshold 0.5": {"threshold": 0.5},
    "128 steps": {"max_steps": 128},
}
"""What the grid changes of the default, one at a time."""


@register
@dataclass(frozen=True)
class HiZ(stepping.Stepping):
    """March through the nearest-depth pyramid and trust what it finds by a confidence, "hiz".

    One cell is read at a time. Where the ray reaches the far side of the cell in front of its
    nearest depth, it goes there and one level coarser; where it meets that depth inside the cell,
    it goes to that point and one level finer. It stops at a pixel's depth, and the stop is given

        confidence = (1 - smoothstep(0, thickness, |z_ray - z_surface|)) * vignette,

    the vignette falling from 1 to 0 over the image's border. From `threshold` on it is a hit. A
    surface that faces away from the ray, seen from the side that the ray comes from, is never one:
    so a ray does not hit the surface that it leaves.

    Attributes
    ----------
    thickness : float or Share
        Thickness of the surface seen in a pixel, along z_view, world units or a share of the
        scene's diagonal, > 0. The documentation names a range (0 to 1 of the scene's units) and no
        default.
    threshold : float
        Least confidence of a hit, 0 to 1. AMD's hybrid traces below 0.9.
    border : float
        Width of the vignette as a fraction of the image's height, 0 (no vignette) to 1.
    exhausted_hits : bool
        Whether a ray that ran out of steps is judged where it stands, as if it had stopped there.
        Its status is still EXHAUSTED.
    trace_background : bool
        Whether a ray that ends over a pixel with no surface is left to the tracer. If not, it
        counts as a miss.
    max_steps : int
        Cells read, >= 1. "Most rays should terminate after approximately 20 lookups" [1]_.

    Notes
    -----
    Left out: a most detailed level other than 0 (AMD takes 0 for mirrors), the least occupancy of a
    wave, and the overshoot behind a cell's border, by which AMD's march skips pixels at corners.
    The documentation describes the confidence in words only; the two factors are those of the
    formula above.

    References
    ----------
    .. [1] AMD, "FidelityFX Stochastic Screen-Space Reflections" and "FidelityFX Hybrid
       Reflections", documentation of the FidelityFX SDK 1, GPUOpen, 2023.
    .. [2] Y. Uludag, "Hi-Z Screen-Space Cone-Traced Reflections", in GPU Pro 5, 2014.
    """

    name = "hiz"
    description = "Nearest-depth pyramid, trusted by a confidence from a thickness and a vignette"
    reference = "AMD FidelityFX hybrid reflections 2023"
    answers_misses = True

    thickness: float | Share = DEFAULT_THICKNESS
    threshold: float = 0.9
    border: float = 0.05
    exhausted_hits: bool = True
    trace_background: bool = False
    max_steps: int = 32

    def __post_init__(self) -> None:
        stepping.checked_thickness(self.thickness)
        _check.fraction("threshold", self.threshold)
        _check.fraction("border", self.border)
        _check.boolean("exhausted_hits", self.exhausted_hits)
        _check.boolean("trace_background", self.trace_background)
        _check.integer("max_steps", self.max_steps, least=1, most=stepping.MOST)

    @property
    def reads(self) -> tuple[str, ...]:
        """The depth pyramid."""
        return ("depth pyramid",)

    @classmethod
    def _grid(cls, which: str) -> list[Point]:
        usual = cls()
        label = f"thickness {usual.thickness}"
        if which != "all":
            return [Point(label, usual)]
        return [
            *(Point(f"thickness {share}", cls(share)) for share in THICKNESSES),
            *(Point(f"{label}, {words}", cls(**changes)) for words, changes in SWITCHES.items()),
        ]

    def _read(self, gbuffer: GBuffer, threads: int | None) -> DepthPyramid:
        return build_depth_pyramid(gbuffer, threads=threads)

    def _numbers(self, screen: Screen) -> HiZNumbers:
        camera = screen.camera
        return HiZNumbers(
            stepping.length_in(screen, self.thickness),
            camera.far - camera.near if camera.parallel else camera.near,
            camera.parallel,
            float(self.threshold),
            float(self.border),
            bool(self.exhausted_hits),
            bool(self.trace_background),
            int(self.max_steps),
            *stepping.levels_of(screen.data),
        )
