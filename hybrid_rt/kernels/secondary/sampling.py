"""Directions about a surface normal, in float64; vectors are tuples of three."""

from __future__ import annotations

import math

from hybrid_rt.kernels._jit import inlined


@inlined
def dot(a, b):
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a, b):
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def scaled(a, k):
    """Return k a."""
    return a[0] * k, a[1] * k, a[2] * k


@inlined
def minus(a, b):
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def tangents(n):
    """Return two vectors that make an orthonormal frame with the unit vector n.

    T. Duff et al., "Building an orthonormal basis, revisited", JCGT 6 (1), 2017.
    """
    sign = math.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return (
        (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]),
        (b, sign + n[1] * n[1] * a, -n[1]),
    )


@inlined
def from_frame(p, s, t, n):
    """Return the vector of components p in the frame (s, t, n)."""
    return (
        p[0] * s[0] + p[1] * t[0] + p[2] * n[0],
        p[0] * s[1] + p[1] * t[1] + p[2] * n[1],
        p[0] * s[2] + p[1] * t[2] + p[2] * n[2],
    )


@inlined
def cosine_hemisphere(n, u1, u2):
    """Return a direction about n of density cos / pi (Malley's method)."""
    s, t = tangents(n)
    radius, angle = math.sqrt(u1), 2.0 * math.pi * u2
    local = radius * math.cos(angle), radius * math.sin(angle), math.sqrt(1.0 - u1)
    return from_frame(local, s, t, n)


@inlined
def ggx_visible_normal(v, alpha, u1, u2):
    """Return a normal of the isotropic GGX distribution as visible from v, in the local frame.

    E. Heitz, "Sampling the GGX distribution of visible normals", JCGT 7 (4), 2018, listing 1.
    """
    vx, vy, vz = alpha * v[0], alpha * v[1], v[2]
    across = vx * vx + vy * vy
    inv = 1.0 / math.sqrt(across + vz * vz)
    vh = vx * inv, vy * inv, vz * inv
    t1 = (1.0, 0.0, 0.0)
    if across > 0.0:
        k = 1.0 / math.sqrt(across)
        t1 = (-vy * k, vx * k, 0.0)
    t2 = cross(vh, t1)
    radius, angle = math.sqrt(u1), 2.0 * math.pi * u2
    p1, p2 = radius * math.cos(angle), radius * math.sin(angle)
    s = 0.5 * (1.0 + vh[2])
    p2 = (1.0 - s) * math.sqrt(1.0 - p1 * p1) + s * p2
    nh = from_frame((p1, p2, math.sqrt(max(0.0, 1.0 - p1 * p1 - p2 * p2))), t1, t2, vh)
    mx, my, mz = alpha * nh[0], alpha * nh[1], max(0.0, nh[2])
    inv = 1.0 / math.sqrt(mx * mx + my * my + mz * mz)
    return mx * inv, my * inv, mz * inv


@inlined
def ggx_reflection(d, n, alpha, u1, u2):
    """Return the unit vector d, that comes to a surface, reflected at a visible GGX normal."""
    s, t = tangents(n)
    v = -dot(d, s), -dot(d, t), max(-dot(d, n), 0.0)
    m = from_frame(ggx_visible_normal(v, alpha, u1, u2), s, t, n)
    return minus(d, scaled(m, 2.0 * dot(d, m)))
