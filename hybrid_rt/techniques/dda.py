"""The perspective-correct pixel DDA with a thickness."""

from __future__ import annotations

from dataclasses import dataclass

from hybrid_rt import _check
from hybrid_rt.base import Point, Screen, register
from hybrid_rt.kernels.techniques.dda import PixelDDANumbers
from hybrid_rt.techniques import stepping
from hybrid_rt.techniques.stepping import DEFAULT_THICKNESS, THICKNESSES, Share


@register
@dataclass(frozen=True)
class PixelDDA(stepping.Stepping):
    """Walk along the ray's line on the screen, "dda", pixel by pixel or every `stride` pixels.

    Samples lie `stride` pixels apart along the line's longer axis, so that no pixel is read twice
    and, at a stride of 1, the pixels read are contiguous. Each stands for the stretch of the ray
    from half a stride before it to half a stride behind it; if the depths of that stretch meet the
    slab from the pixel's surface to `thickness` behind it, the pixel is hit.

    Attributes
    ----------
    thickness : float or Share
        Thickness of the surface seen in a pixel, along z_view, world units or a share of the
        scene's diagonal, > 0.
    stride : int
        Pixels from sample to sample, >= 1.
    jitter : float
        How far all samples are moved along the ray, in strides, 0 to 1. One number for all rays:
        the paper's may differ from pixel to pixel, which hides banding in a picture.
    max_steps : int, optional
        Samples after which the ray is exhausted, >= 1. By default W + H + 2, which no ray can use
        up.

    References
    ----------
    M. McGuire and M. Mara, "Efficient GPU Screen-Space Ray Tracing", Journal of Computer Graphics
    Techniques 3(4), 2014, pp. 73-85.
    """

    name = "dda"
    description = "Every pixel, or every few, along the ray's line on the screen, and a thickness"
    reference = "McGuire and Mara 2014"

    thickness: float | Share = DEFAULT_THICKNESS
    stride: int = 1
    jitter: float = 0.0
    max_steps: int | None = None

    def __post_init__(self) -> None:
        stepping.checked_thickness(self.thickness)
        _check.integer("stride", self.stride, least=1, most=2**15)
        _check.fraction("jitter", self.jitter)
        stepping.checked_steps(self.max_steps)

    @classmethod
    def _grid(cls, which: str) -> list[Point]:
        grid = [cls(share, stride) for stride in (1, 4, 16) for share in THICKNESSES]
        return [
            Point(f"thickness {each.thickness}, stride {each.stride}", each)
            for each in (grid if which == "all" else [cls()])
        ]

    def _numbers(self, screen: Screen) -> PixelDDANumbers:
        camera = screen.camera
        return PixelDDANumbers(
            *camera.receding(stepping.length_in(screen, self.thickness)),
            int(self.stride),
            float(self.jitter),
            int(self.max_steps or camera.width + camera.height + 2),
        )
