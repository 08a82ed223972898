"""How a march decides: the parameters of each technique, one class for each.

`hybrid_rt.march` and `hybrid_rt.trace_hybrid` take a mode either as its name, with the default
parameters, or as an object of its class.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError


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
        Step budget of a ray. By default 2 (W + H) + 64, which no ray can use up.
    hand_over : bool
        Whether `hybrid_rt.trace_hybrid` starts unresolved rays where the proof ended.
    """

    max_tests: int = 64
    max_steps: int | None = None
    hand_over: bool = True

    def __post_init__(self) -> None:
        _check.integer("max_tests", self.max_tests, least=1, most=2**31 - 1)
        if self.max_steps is not None:
            _check.integer("max_steps", self.max_steps, least=1, most=2**31 - 1)
        _check.instance("hand_over", self.hand_over, bool)


Mode = Paper | Certified

MODES: dict[str, type[Mode]] = {"paper": Paper, "certified": Certified}
"""The names that stand for a mode with its default parameters."""


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
