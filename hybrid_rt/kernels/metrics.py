"""The float64 judge: how a ray and one named triangle meet."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels.triangle import approach, frame, has_area

MISSED, GRAZED, HIT = 0, 1, 2


@inlined
def _largest(p):
    return max(abs(p[0]), abs(p[1]), abs(p[2]))


@inlined
def _touch(o, d, near, far, a, b, c, ulps):
    """Return (HIT, GRAZED or MISSED, t, tolerance of t) of a ray and a triangle."""
    if not has_area(a, b, c):
        return MISSED, 0.0, 0.0
    hit, distance, t = approach(o, frame(d), a, b, c)
    slack = ulps * max(_largest(o), _largest(a), _largest(b), _largest(c))
    x, y, z = np.float64(d[0]), np.float64(d[1]), np.float64(d[2])
    length = math.sqrt(x * x + y * y + z * z)
    tolerance = ulps * abs(t) + slack / length
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
            face = faces[prim_id[i]]
            s, ti, tol = _touch(
                origin[i], direction[i], t_near[i], t_far[i],
                vertices[face[0]], vertices[face[1]], vertices[face[2]], ulps,
            )  # fmt: skip
        state[i], t[i], tolerance[i] = s, ti, tol
