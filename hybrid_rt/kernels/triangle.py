"""Ray against triangle in float64.

Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection": the vertices are moved so that
the ray starts at 0 and sheared so that it runs along +z; what remains is whether the point (0, 0)
lies in a triangle of the plane. An edge's function is the same number up to its sign from both
triangles that share it, and 0 counts as inside, so no ray passes between two triangles and an edge
belongs to both.

Error: rays and vertices are float32, taken as exact. With e = 2**-53 and r the largest coordinate
of a vertex relative to the origin, the two differences, the shear's quotient and its product err by
no more than e r each, so a sheared vertex lies within 5 e r of its true place in x and in y, and an
edge function has the wrong sign only for a ray that passes the edge's line as closely. t errs by
less than ``4 e r (1 + longest edge**2 / twice the area) / (|direction| * sine)``, with the sine of
the angle between ray and plane (test_grazing_slivers_err_by_no_more_than_stated; the worst of 5600
slivers had 0.7 in place of the 4): 2**-29 of what a tracer in float32 errs by.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels._jit import inlined


@inlined
def frame(d):
    """Return (kx, ky, kz, sx, sy, sz): axes and shear for a direction (3,) that is not zero."""
    x, y, z = abs(d[0]), abs(d[1]), abs(d[2])
    kz = 0
    if y > x:
        kz = 1
    if z > max(x, y):
        kz = 2
    kx = (kz + 1) % 3
    ky = (kz + 2) % 3
    dz = np.float64(d[kz])
    return kx, ky, kz, np.float64(d[kx]) / dz, np.float64(d[ky]) / dz, 1.0 / dz


@inlined
def sheared(o, ray, vertices, i):
    """Return vertex i of (V, 3) in the ray's frame: (x, y) across it, and t along it."""
    kx, ky, kz, sx, sy, sz = ray
    z = np.float64(vertices[i, kz]) - np.float64(o[kz])
    x = np.float64(vertices[i, kx]) - np.float64(o[kx]) - sx * z
    y = np.float64(vertices[i, ky]) - np.float64(o[ky]) - sy * z
    return x, y, sz * z


@inlined
def _edge(vertices, i, j, k):
    return np.float64(vertices[j, k]) - np.float64(vertices[i, k])


@inlined
def normal(vertices, ia, ib, ic):
    """Return ``cross(b - a, c - a)`` in float64; exactly zero for a triangle without area."""
    ux, uy, uz = _edge(vertices, ia, ib, 0), _edge(vertices, ia, ib, 1), _edge(vertices, ia, ib, 2)
    vx, vy, vz = _edge(vertices, ia, ic, 0), _edge(vertices, ia, ic, 1), _edge(vertices, ia, ic, 2)
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@inlined
def has_area(vertices, ia, ib, ic):
    """Whether the triangle has an area: one without is never hit."""
    x, y, z = normal(vertices, ia, ib, ic)
    return x != 0.0 or y != 0.0 or z != 0.0


@inlined
def weights(ax, ay, bx, by, cx, cy):
    """Return (inside, wa, wb, wc) of the point (0, 0) and a triangle of the plane.

    The edges belong to it. The weights of the corners are not divided by their sum; a triangle
    seen edge-on, whose sum is 0, holds no point.
    """
    wa = cx * by - cy * bx
    wb = ax * cy - ay * cx
    wc = bx * ay - by * ax
    outside = (wa < 0 or wb < 0 or wc < 0) and (wa > 0 or wb > 0 or wc > 0)
    return not outside and wa + wb + wc != 0.0, wa, wb, wc


@inlined
def intersect(o, ray, vertices, ia, ib, ic):
    """Return (t, u, v) where a ray with `frame` `ray` meets a triangle; t is NaN where it does not.

    t may be negative: its range is the caller's to check.
    """
    ax, ay, at = sheared(o, ray, vertices, ia)
    bx, by, bt = sheared(o, ray, vertices, ib)
    cx, cy, ct = sheared(o, ray, vertices, ic)
    inside, wa, wb, wc = weights(ax, ay, bx, by, cx, cy)
    if not inside or not has_area(vertices, ia, ib, ic):
        return np.nan, 0.0, 0.0
    whole = wa + wb + wc
    # Not (1 - u - v) for the weight of a: on an edge its rounding would put t = 0 below zero.
    return (wa * at + wb * bt + wc * ct) / whole, wb / whole, wc / whole


@inlined
def _closest_on_edge(px, py, pt, qx, qy, qt):
    """Return (distance, t) of the point of an edge that lies closest to (0, 0)."""
    ex, ey = qx - px, qy - py
    length2 = ex * ex + ey * ey
    s = 0.0
    if length2 > 0.0:
        s = min(max(-(px * ex + py * ey) / length2, 0.0), 1.0)
    return np.hypot(px + s * ex, py + s * ey), pt + s * (qt - pt)


@inlined
def approach(o, ray, vertices, ia, ib, ic):
    """Return (hit, distance, t) of the point of a triangle that lies closest to a ray.

    Closest as seen along the ray: `distance` is measured across the ray's main axis, at most
    sqrt(3) times the true one. A triangle that is hit has distance 0; one that is edge-on or
    without area is not hit, and its distance is that of its edges. Of points equally close, the
    nearest along the ray.
    """
    t, _, _ = intersect(o, ray, vertices, ia, ib, ic)
    if not np.isnan(t):
        return True, 0.0, t
    ax, ay, at = sheared(o, ray, vertices, ia)
    bx, by, bt = sheared(o, ray, vertices, ib)
    cx, cy, ct = sheared(o, ray, vertices, ic)
    distance, t = _closest_on_edge(ax, ay, at, bx, by, bt)
    other, other_t = _closest_on_edge(bx, by, bt, cx, cy, ct)
    if other < distance or (other == distance and other_t < t):
        distance, t = other, other_t
    other, other_t = _closest_on_edge(cx, cy, ct, ax, ay, at)
    if other < distance or (other == distance and other_t < t):
        distance, t = other, other_t
    return False, distance, t
