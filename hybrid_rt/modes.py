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


Mode = Paper

MODES: dict[str, type[Mode]] = {"paper": Paper}
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
