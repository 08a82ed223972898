"""The linear march: steps of one length in the world, and a thickness."""

from __future__ import annotations

from dataclasses import dataclass

from hybrid_rt import _check
from hybrid_rt.base import Point, Screen, register
from hybrid_rt.kernels.techniques.linear import LinearNumbers
from hybrid_rt.techniques import stepping
from hybrid_rt.techniques.stepping import DEFAULT_THICKNESS, THICKNESSES, Share


@register
@dataclass(frozen=True)
class Linear(stepping.Stepping):
    """March in steps of one length in the world, "linear": the first screen-space reflections.

    At each step the ray's point is projected and its pixel read. A point behind the pixel's
    surface by at most `thickness` is a hit; one farther behind has passed it. The hit is refined by
    halving the last step, keeping the half that ends in the slab.

    Attributes
    ----------
    thickness : float or Share
        Thickness of the surface seen in a pixel, along z_view, world units or a share of the
        scene's diagonal, > 0.
    stride : float
        Length of a step as a fraction of z_view where the ray starts, > 0. A step parallel to the
        image is then ``stride * focal_px`` pixels long, 1.7 % of the image's height for 0.02 at a
        field of view of 60 degrees, whatever the scene's unit and the start's distance. Of an
        orthographic camera, as a fraction of what the image's height shows.
    refinements : int
        Halvings, 0 to 32.
    max_steps : int
        Steps, refinements not counted, after which the ray is exhausted, >= 1.

    Notes
    -----
    What lies between two steps is never read, so thin things are missed, and a ray that moves more
    than the thickness behind a surface in one step goes through it.

    References
    ----------
    .. [1] T. Sousa, N. Kasyan and N. Schulz, "Secrets of CryENGINE 3 Graphics Technology",
       SIGGRAPH 2011, Advances in Real-Time Rendering in Games (real-time local reflections).
    .. [2] T. Stachowiak and Y. Uludag, "Stochastic Screen-Space Reflections", SIGGRAPH 2015,
       Advances in Real-Time Rendering in Games, which gives the linear march and what replaces it.
    """

    name = "linear"
    description = "Equal steps in the world and a thickness, then halving the last step"
    reference = "Sousa et al. 2011, Stachowiak 2015"

    thickness: float | Share = DEFAULT_THICKNESS
    stride: float = 0.02
    refinements: int = 4
    max_steps: int = 128

    def __post_init__(self) -> None:
        stepping.checked_thickness(self.thickness)
        _check.real("stride", self.stride, above=0.0)
        _check.integer("refinements", self.refinements, least=0, most=32)
        _check.integer("max_steps", self.max_steps, least=1, most=stepping.MOST)

    @classmethod
    def _grid(cls, which: str) -> list[Point]:
        usual = cls()
        if which != "all":
            return [Point(_label(usual), usual)]
        # A finer stride gets more steps, so that all reach as far.
        reach = usual.stride * usual.max_steps
        points = [
            Point(_label(each), each)
            for stride in (0.005, 0.02, 0.05)
            for share in THICKNESSES
            for each in [cls(share, stride, max_steps=round(reach / stride))]
        ]
        return [*points, Point(f"thickness {usual.thickness}, unrefined", cls(refinements=0))]

    def _numbers(self, screen: Screen) -> LinearNumbers:
        camera = screen.camera
        return LinearNumbers(
            *camera.receding(stepping.length_in(screen, self.thickness)),
            float(self.stride) * camera.stride_unit,
            int(self.refinements),
            int(self.max_steps),
        )


def _label(linear: Linear) -> str:
    return f"thickness {linear.thickness}, stride {100 * linear.stride:g} %"
