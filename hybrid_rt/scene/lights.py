"""Lights that shadow rays go to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class PointLight:
    """A light at one point.

    Attributes
    ----------
    position : three float, world
    """

    position: Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", _check.point3("position", self.position))


@dataclass(frozen=True)
class AreaLight:
    """A parallelogram that shines to both sides.

    Attributes
    ----------
    corner, edge_u, edge_v : three float, world
        Its points are corner + u edge_u + v edge_v with u and v in (0, 1).
    """

    corner: Vector
    edge_u: Vector
    edge_v: Vector

    def __post_init__(self) -> None:
        for name in ("corner", "edge_u", "edge_v"):
            object.__setattr__(self, name, _check.point3(name, getattr(self, name)))
        u, v = np.array(self.edge_u), np.array(self.edge_v)
        _check.point3("edge_u", np.array(self.corner) + u)
        _check.point3("edge_v", np.array(self.corner) + v)
        _check.point3("edge_v", np.array(self.corner) + u + v)
        if not np.cross(u, v).any():
            raise ArgumentError(
                "edge_v", "an edge that is not parallel to edge_u", _check.describe(self.edge_v)
            )


@dataclass(frozen=True)
class DirectionalLight:
    """A light infinitely far away, such as the sun.

    Attributes
    ----------
    direction : three float, world
        The way in which its light travels: down for a sun overhead. Any length but zero.
    """

    direction: Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _check.vector3("direction", self.direction))
        length = math.hypot(*self.direction)
        if length == 0.0 or not math.isfinite(length):
            raise ArgumentError(
                "direction", "a direction of finite length > 0", _check.describe(self.direction)
            )


Light = PointLight | AreaLight | DirectionalLight
