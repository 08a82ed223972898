"""The slow truth: every ray against every triangle in float64."""

from __future__ import annotations

import math

import numpy as np

from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels._queue import part
from hybrid_rt.kernels.triangle import frame, intersect, normal

LARGEST = float(np.finfo(np.float32).max)


@inlined
def _nearest_of_all(o, d, near, far, vertices, faces):
    """Return (t, prim, u, v) of the nearest hit, of equal ones the first; prim is -1 for none."""
    ray = frame(d)
    best_t, best, best_u, best_v = np.inf, -1, 0.0, 0.0
    for f in range(len(faces)):
        t, u, v = intersect(o, ray, vertices, faces[f, 0], faces[f, 1], faces[f, 2])
        if near <= t and t <= far and t < best_t:
            best_t, best, best_u, best_v = t, f, u, v
    return best_t, best, best_u, best_v


@inlined
def _is_ray(o, d):
    """Whether a ray has a finite origin and a finite direction that is not zero."""
    finite = True
    zero = True
    for k in range(3):
        finite = finite and math.isfinite(o[k]) and math.isfinite(d[k])
        zero = zero and d[k] == 0
    return finite and not zero


@parallel_kernel
def nearest(
    share, origin, direction, t_near, t_far, vertices, faces, t, prim_id, u, v, n_g
):  # fmt: skip
    """Nearest hits of (N, 3) rays among all (F, 3) faces."""
    for i in part(share, len(origin)):
        best = -1
        best_t, best_u, best_v = np.inf, 0.0, 0.0
        gx, gy, gz = 0.0, 0.0, 0.0
        if _is_ray(origin[i], direction[i]):
            best_t, best, best_u, best_v = _nearest_of_all(
                origin[i], direction[i], t_near[i], t_far[i], vertices, faces
            )
        if best >= 0:
            gx, gy, gz = normal(vertices, faces[best, 0], faces[best, 1], faces[best, 2])
            best_t = min(best_t, LARGEST)  # infinity would say that there is no hit
        t[i], prim_id[i], u[i], v[i] = best_t, best, best_u, best_v
        n_g[i, 0], n_g[i, 1], n_g[i, 2] = gx, gy, gz
