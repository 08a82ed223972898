"""A ray and a triangle without any rounding: for the few that float64 cannot decide.

Every float32 is a whole number of 2**-149, so that coordinates are Python's integers here, and
only the quotient t is a `Fraction`.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

Vector = tuple[int, int, int]

SCALE = 2**149


def vector(values: Any) -> Vector:
    """Return three float32 as integers, in units of 2**-149."""
    x, y, z = (_whole(float(value)) for value in values)
    return x, y, z


def _whole(value: float) -> int:
    numerator, denominator = value.as_integer_ratio()
    return numerator * (SCALE // denominator)


def _minus(p: Vector, q: Vector) -> Vector:
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def _dot(p: Vector, q: Vector) -> int:
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def _cross(p: Vector, q: Vector) -> Vector:
    return (
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    )


def has_area(a: Vector, b: Vector, c: Vector) -> bool:
    """Return whether the corners do not lie on a line."""
    return any(_cross(_minus(b, a), _minus(c, a)))


def intersect(
    origin: Vector,
    direction: Vector,
    near: float,
    far: float,
    triangle: tuple[Vector, Vector, Vector],
) -> Fraction | None:
    """Return t where a ray meets a closed triangle, with near <= t <= far, or None.

    A triangle that is edge-on, or has no area, is not met.
    """
    a, b, c = (_minus(corner, origin) for corner in triangle)
    n = _cross(_minus(b, a), _minus(c, a))
    along = _dot(direction, n)
    if along == 0:
        return None
    sides = [_dot(direction, _cross(p, q)) for p, q in ((c, b), (a, c), (b, a))]
    if min(sides) < 0 < max(sides):
        return None
    t = Fraction(_dot(a, n), along)
    inside = t >= Fraction(near) and (far == math.inf or t <= Fraction(far))
    return t if inside else None
