"""What techniques that step ray by ray have in common."""

from __future__ import annotations

import abc
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.base import Point, Screen, Technique
from hybrid_rt.camera.camera import Camera
from hybrid_rt.kernels.arrays import I64
from hybrid_rt.kernels.techniques import driver
from hybrid_rt.kernels.techniques.placing import LANES
from hybrid_rt.raster.pyramid import Pyramid, bits
from hybrid_rt.rays.marched import Marched
from hybrid_rt.rays.rays import Rays

MOST = 2**31 - 1


@dataclass(frozen=True)
class Share:
    """A length as a share of the diagonal of the scene's bounding box.

    Of a scene that is not known it is that of the visible points.

    World units mean nothing to a technique that does not know the scene; a share does.

    Attributes
    ----------
    value : float
        > 0; 0.005 is half a percent.
    """

    value: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", _check.real("value", self.value, above=0.0))

    def __str__(self) -> str:
        return f"{100 * self.value:g} %"


DEFAULT_THICKNESS = Share(0.005)
THICKNESSES = (Share(0.0002), Share(0.001), Share(0.005), Share(0.02))
"""Thicknesses of the grids."""


def checked_thickness(value: Any) -> None:
    """Raise unless `value` is a thickness: a length > 0, world units, or a `Share`."""
    if not isinstance(value, Share):
        _check.real("thickness", value, above=0.0)


def length_in(screen: Screen, length: float | Share) -> float:
    """Return a length in what is on a screen, world units; see `Share`."""
    if not isinstance(length, Share):
        return float(length)
    low, high = screen.gbuffer.bounds
    return length.value * math.dist(low, high)


def checked_steps(max_steps: int | None) -> None:
    """Raise unless `max_steps` is a step budget, or None for one that no ray can use up."""
    if max_steps is not None:
        _check.integer("max_steps", max_steps, least=1, most=MOST)


class Stepping(Technique):
    """A technique whose rays go by steps, through the levels of a pyramid or the depth buffer."""

    @abc.abstractmethod
    def _numbers(self, screen: Screen) -> Any:
        """Return the parameters, as the kernel takes them; their type chooses it."""

    def _march(self, rays: Rays, screen: Screen, any_hit: bool, threads: int | None) -> Marched:
        return self._walked(rays, screen, (), threads)

    def steps_by_level(self, rays: Rays, screen: Screen, *, threads: int | None = None) -> I64:
        """Return how many samples the rays take of each level; as `Technique.steps_by_level`."""
        screen = self._checked(rays, screen, threads)
        if screen.data is None:  # every sample is of the depth buffer itself
            steps = self._walked(rays, screen, (), threads).steps
            return np.asarray(steps.sum(keepdims=True, dtype=np.int64))
        with _threads.limited(threads) as workers:
            counts = np.zeros((workers, len(screen.data) * LANES), np.int64)
            self._walked(rays, screen, counts, threads)
        return np.asarray(counts.reshape(workers, -1, LANES).sum(axis=(0, 2)))

    def _walked(self, rays: Rays, screen: Screen, counts: Any, threads: int | None) -> Marched:
        """March; `counts` as `kernels.techniques.driver.march` has them."""
        marched = Marched.unfilled(len(rays))
        pyramid = () if screen.data is None else screen.data.arrays
        with _threads.limited(threads):
            driver.march(
                rays.arrays, screen.camera.arrays, screen.gbuffer.arrays, pyramid,
                self._numbers(screen), marched.arrays, counts,
            )  # fmt: skip
        return marched


@dataclass(frozen=True)
class Sampled(Stepping):
    """A technique of the paper's kind: so many samples of one level before the level may rise."""

    samples: int = 4
    max_steps: int | None = None

    def __post_init__(self) -> None:
        _check.integer("samples", self.samples, least=1, most=MOST)
        checked_steps(self.max_steps)

    @classmethod
    def _points(cls, *samples: int) -> list[Point]:
        return [Point(f"samples {n}", cls(samples=n)) for n in samples]

    def _budgets(self, camera: Camera) -> tuple[int, int]:
        """Return the samples of a level and the steps of a ray; by default more than any takes."""
        enough = 2 * (camera.width + camera.height) + 2
        return int(self.samples), int(self.max_steps or enough)


def levels_of(pyramid: Pyramid) -> tuple[tuple[int, int], int]:
    """Return what a kernel computes the place of a cell from: `bits`, and the last level."""
    return bits(pyramid.width, pyramid.height), len(pyramid) - 1
