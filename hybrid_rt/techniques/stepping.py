"""What techniques that step ray by ray have in common."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.base import Point, Screen, Technique
from hybrid_rt.camera.camera import Camera
from hybrid_rt.kernels.techniques import driver
from hybrid_rt.raster.pyramid import Pyramid
from hybrid_rt.rays.marched import Marched
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene

MOST = 2**31 - 1


@dataclass(frozen=True)
class Share:
    """A length as a share of the diagonal of the scene's bounding box.

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


def length_in(scene: Scene, length: float | Share) -> float:
    """Return a length in a scene, world units."""
    return length.value * scene.diagonal if isinstance(length, Share) else float(length)


def checked_steps(max_steps: int | None) -> None:
    """Raise unless `max_steps` is a step budget, or None for one that no ray can use up."""
    if max_steps is not None:
        _check.integer("max_steps", max_steps, least=1, most=MOST)


@dataclass(frozen=True)
class Sampled(Technique):
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


def march(
    rays: Rays, screen: Screen, pyramid: Pyramid | None, numbers: Any, threads: int | None
) -> Marched:
    """Return what a kernel of `kernels.techniques.driver` says about each ray.

    `pyramid`: what it goes through, None for the depth buffer alone; `numbers`: its parameters.
    """
    marched = Marched.unfilled(len(rays))
    with _threads.limited(threads) as workers:
        steps_by_level = np.zeros((workers, 1 if pyramid is None else len(pyramid)), np.int64)
        driver.march(
            rays.arrays, screen.camera.arrays, screen.gbuffer.arrays,
            () if pyramid is None else pyramid.arrays, numbers, marched.arrays, steps_by_level,
        )  # fmt: skip
    if pyramid is None:  # every sample is of the depth buffer itself
        steps_by_level[0, 0] = marched.steps.sum(dtype=np.int64)
    return replace(marched, steps_by_level=steps_by_level.sum(axis=0))
