"""Axes and lenses of cameras, checked."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F64

Vector = tuple[float, float, float]
LARGEST_SHIFT = 2.0**30
"""Pixels; with the axis any farther away, float64 no longer tells sub-pixels."""
ASPECTS = 1e-9, 1e9
"""Between these the pixels of a camera are not all on one line."""


def checked_lens(aspect: Any, shift_px: Any) -> dict[str, Any]:
    """Return what lenses of all kinds have, checked."""
    low, high = ASPECTS
    try:
        x, y = shift_px
    except (TypeError, ValueError) as error:
        got = _check.describe(shift_px)
        raise ArgumentError("shift_px", "two numbers, pixels", got) from error
    shift = []
    for value in (x, y):
        pixels = _check.real("shift_px", value)
        if abs(pixels) > LARGEST_SHIFT:
            raise ArgumentError(
                "shift_px", f"at most {LARGEST_SHIFT:.0f} pixels to each side", f"{pixels:g}"
            )
        shift.append(pixels)
    return {
        "aspect": _check.real("aspect", aspect, above=low, below=high),
        "shift_px": tuple(shift),
    }


def frame_of(eye: Any, target: Any, up: Any) -> tuple[Vector, Vector, Vector, Vector]:
    """Return eye, right, up and forward of a view from one point to another."""
    eye3 = np.array(_check.vector3("eye", eye))
    target3 = np.array(_check.vector3("target", target))
    up3 = np.array(_check.vector3("up", up))
    with np.errstate(over="ignore"):
        forward = target3 - eye3
    distance = math.hypot(*forward)
    if distance == 0.0 or not math.isfinite(distance):
        raise ArgumentError("target", "a point other than eye", _check.describe(target))
    forward = forward / distance
    length = math.hypot(*up3)
    if length == 0.0 or not math.isfinite(length):
        raise ArgumentError("up", "a direction of finite length > 0", _check.describe(up))
    right = np.cross(forward, up3 / length)
    sine = float(np.linalg.norm(right))
    if sine < 1e-9:  # relative: both vectors have unit length here
        raise ArgumentError("up", "a direction not parallel to the view", _check.describe(up))
    right = right / sine
    up3 = np.cross(right, forward)
    return vector_of(eye3), vector_of(right), vector_of(up3), vector_of(forward)


def vector_of(v: F64) -> Vector:
    """Return an array of three as floats."""
    return float(v[0]), float(v[1]), float(v[2])
