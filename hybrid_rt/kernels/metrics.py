"""The float64 judge: how a ray and one named triangle meet."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels.triangle import approach, frame, has_area

MISSED, GRAZED, HIT = 0, 1, 2


@inlined
def _largest(points, i):
    return max(abs(points[i, 0]), abs(points[i, 1]), abs(points[i, 2]))


@inlined
def _touch(i, origin, direction, near, far, vertices, ia, ib, ic, ulps):
    """Return (HIT, GRAZED or MISSED, t, tolerance of t) of ray i and a triangle."""
    if not has_area(vertices, ia, ib, ic):
        return MISSED, 0.0, 0.0
    hit, distance, t = approach(origin[i], frame(direction[i]), vertices, ia, ib, ic)
    largest = max(_largest(vertices, ia), _largest(vertices, ib), _largest(vertices, ic))
    slack = ulps * max(_largest(origin, i), largest)
    x, y, z = np.float64(direction[i, 0]), np.float64(direction[i, 1]), np.float64(direction[i, 2])
    tolerance = ulps * abs(t) + slack / math.sqrt(x * x + y * y + z * z)
    if hit and near <= t and t <= far:
        return HIT, t, tolerance
    if distance <= slack and near - tolerance <= t and t <= far + tolerance:
        return GRAZED, t, tolerance
    return MISSED, 0.0, 0.0


@parallel_kernel
def touch(
    origin, direction, t_near, t_far, prim_id, vertices, faces, ulps, state, t, tolerance
):  # fmt: skip
    """How each of (N, 3) rays meets the triangle `prim_id` (N,) named for it, -1 for none.

    `state` (N,) uint8 is HIT, GRAZED (within `ulps` times the largest coordinate involved) or
    MISSED; `t` and `tolerance` (N,) float64 are 0 where it is MISSED. See `hybrid_rt.metrics`.
    """
    for i in prange(len(origin)):
        s, ti, tol = MISSED, 0.0, 0.0
        if prim_id[i] >= 0:
            ia, ib, ic = faces[prim_id[i], 0], faces[prim_id[i], 1], faces[prim_id[i], 2]
            s, ti, tol = _touch(
                i, origin, direction, t_near[i], t_far[i], vertices, ia, ib, ic, ulps
            )
        state[i], t[i], tolerance[i] = s, ti, tol
