"""How a march decides: the parameters of each technique, one class for each.

`hybrid_rt.march` and `hybrid_rt.trace_hybrid` take a mode either as its name, with the default
parameters, or as an object of its class.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError
from hybrid_rt.scene.mesh import Scene


@dataclass(frozen=True)
class Paper:
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

    samples: int = 4
    max_steps: int | None = None

    def __post_init__(self) -> None:
        _check.integer("samples", self.samples, least=1, most=2**31 - 1)
        if self.max_steps is not None:
            _check.integer("max_steps", self.max_steps, least=1, most=2**31 - 1)


PROBES = (1, 2, 4, 8, 16)
"""Of 16 rays, how many mode "certified" can be told to march first."""


@dataclass(frozen=True)
class Certified:
    """Answers only what is proven, "certified": never a wrong hit, never a wrong miss.

    Depths of whole pixel squares instead of pixel centres prove free space; where a square may hold
    something as near as the ray, the ray is intersected with the primitives of the pixel's list in
    float64 with error bounds; a ray is answered when nothing nearer than its hit is left, or
    nothing at all up to infinity, its t_far or the scene's bounds. docs/certified.md has the proof.

    It reads a G-buffer with `lists` and a conservative pyramid (`rasterize(..., lists=8)`,
    `build_depth_pyramid(..., conservative=True)`). What of these is missing is made at each call,
    with lists of 8.

    Attributes
    ----------
    max_tests : int
        Budget of exact tests of a ray, >= 1; a ray that needs more is unresolved.
    max_steps : int, optional
        Step budget of a ray. None: 2 (W + H) + 64, W by H the size of the lists, which no ray can
        use up. The default gives up those few that pass behind something near for long and take
        half of the time; ``hybrid-rt run ablation`` measures both budgets.
    hand_over : bool
        Whether `hybrid_rt.trace_hybrid` starts unresolved rays where the proof ended.
    probes : {1, 2, 4, 8, 16}
        Of each 16 consecutive rays so many, evenly spread, are marched first, and the others only
        if the screen answered one of them. It saves marches where the screen has nothing to say.
        No answer changes: a ray that is left out is unresolved, `MarchStatus.SKIPPED`, whether or
        not the screen could have answered it, and goes to the tracer. 16 marches all rays.
    vectors : bool
        Whether rays are marched in the lanes of vectors, several at a time. The answers are the
        same, bit for bit, without; steps are then counted by level too. Without, `probes` must
        be 16. More than 2**31 numbers in an array, of rays, lists or triangles, are too many for
        the lanes: then all rays are marched without.
    """

    max_tests: int = 16
    max_steps: int | None = 64
    hand_over: bool = True
    probes: int = 16
    vectors: bool = True

    def __post_init__(self) -> None:
        _check.integer("max_tests", self.max_tests, least=1, most=2**31 - 1)
        if self.max_steps is not None:
            _check.integer("max_steps", self.max_steps, least=1, most=2**31 - 1)
        _check.instance("hand_over", self.hand_over, bool)
        _check.integer("probes", self.probes, least=1, most=16)
        _check.choice("probes", self.probes, PROBES)
        _check.instance("vectors", self.vectors, bool)
        if not self.vectors and self.probes != 16:
            raise ArgumentError("probes", "16 where vectors=False", str(self.probes))


@dataclass(frozen=True)
class _Thick:
    """A technique that takes every pixel for a slab of some thickness.

    Attributes
    ----------
    thickness : float, optional
        Thickness of the surface seen in a pixel, along z_view, world units, > 0. Where none is
        said, 0.5 % of the diagonal of the scene's bounding box: world units mean nothing to a
        technique that does not know the scene.
    """

    thickness: float | None = None

    def __post_init__(self) -> None:
        if self.thickness is not None:
            _check.real("thickness", self.thickness, above=0.0)

    def thickness_in(self, scene: Scene) -> float:
        """Return the thickness in a scene, world units."""
        if self.thickness is not None:
            return float(self.thickness)
        return DEFAULT_THICKNESS * scene.diagonal


@dataclass(frozen=True)
class Linear(_Thick):
    """March in steps of one length in the world, "linear": the first screen-space reflections.

    At each step the ray's point is projected and its pixel read. A point behind the pixel's
    surface by at most `thickness` is a hit; one farther behind has passed it. The hit is refined by
    halving the last step, keeping the half that ends in the slab.

    Attributes
    ----------
    thickness : float, optional
        World units along z_view; default: 0.5 % of the diagonal of the scene's bounding box.
    stride : float
        Length of a step as a fraction of z_view where the ray starts, > 0. A step parallel to the
        image is then ``stride * focal_px`` pixels long, 1.7 % of the image's height for 0.02 at a
        field of view of 60 degrees, whatever the scene's unit and the start's distance.
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

    stride: float = 0.02
    refinements: int = 4
    max_steps: int = 128

    def __post_init__(self) -> None:
        super().__post_init__()
        _check.real("stride", self.stride, above=0.0)
        _check.integer("refinements", self.refinements, least=0, most=32)
        _check.integer("max_steps", self.max_steps, least=1, most=2**31 - 1)


@dataclass(frozen=True)
class PixelDDA(_Thick):
    """Walk along the ray's line on the screen, "dda", pixel by pixel or every `stride` pixels.

    Samples lie `stride` pixels apart along the line's longer axis, so that no pixel is read twice
    and, at a stride of 1, the pixels read are contiguous. Each stands for the stretch of the ray
    from half a stride before it to half a stride behind it; if the depths of that stretch meet the
    slab from the pixel's surface to `thickness` behind it, the pixel is hit.

    Attributes
    ----------
    thickness : float, optional
        World units along z_view; default: 0.5 % of the diagonal of the scene's bounding box.
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

    stride: int = 1
    jitter: float = 0.0
    max_steps: int | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        _check.integer("stride", self.stride, least=1, most=2**15)
        _check.fraction("jitter", self.jitter)
        if self.max_steps is not None:
            _check.integer("max_steps", self.max_steps, least=1, most=2**31 - 1)


@dataclass(frozen=True)
class HiZ(_Thick):
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
    thickness : float, optional
        World units along z_view; default: 0.5 % of the diagonal of the scene's bounding box. The
        documentation names a range (0 to 1 of the scene's units) and no default.
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

    threshold: float = 0.9
    border: float = 0.05
    exhausted_hits: bool = True
    trace_background: bool = False
    max_steps: int = 32

    def __post_init__(self) -> None:
        super().__post_init__()
        _check.fraction("threshold", self.threshold)
        _check.fraction("border", self.border)
        _check.boolean("exhausted_hits", self.exhausted_hits)
        _check.boolean("trace_background", self.trace_background)
        _check.integer("max_steps", self.max_steps, least=1, most=2**31 - 1)


@dataclass(frozen=True)
class SlopeAware:
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

    samples: int = 4
    max_steps: int | None = None

    def __post_init__(self) -> None:
        _check.integer("samples", self.samples, least=1, most=2**31 - 1)
        if self.max_steps is not None:
            _check.integer("max_steps", self.max_steps, least=1, most=2**31 - 1)


Mode = Paper | Certified | Linear | PixelDDA | HiZ | SlopeAware

MODES: dict[str, type[Mode]] = {
    "paper": Paper,
    "certified": Certified,
    "linear": Linear,
    "dda": PixelDDA,
    "hiz": HiZ,
    "slope": SlopeAware,
}
"""The names that stand for a mode with its default parameters."""

DEFAULT_THICKNESS = 0.005
"""Thickness of a pixel's surface, as a fraction of the diagonal of the scene's bounding box."""


def named(mode: Any) -> Mode:
    """Return the mode that an argument `mode` says: itself, or the one of that name.

    Raises
    ------
    ArgumentError
        Neither a known name nor a mode.
    """
    if isinstance(mode, str) and mode in MODES:
        return MODES[mode]()
    if isinstance(mode, Mode):
        return mode
    names = ", ".join(repr(name) for name in MODES)
    raise ArgumentError("mode", f"one of {names}, or a mode object", _check.describe(mode))
