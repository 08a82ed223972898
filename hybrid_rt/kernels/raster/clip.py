"""From world vertices to fixed-point screen coordinates, and the clipping that keeps them finite.

A vertex is ``q = M (p - eye, 1)`` in float64, (x w, y w, w, d), as `kernels.arrays.ViewArrays` has
it: x_px = q0 / q2, y_px = q1 / q2 and, in front of the near plane, q2 >= q3. Screen coordinates are
snapped to 1/256 pixel. The guard band bounds them, so that every edge function of
`kernels.raster.bins` fits its integers; it is wide enough that clipping against it is rare.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import called, inlined, parallel_kernel
from hybrid_rt.kernels._queue import part

SUBPIXEL_BITS = 8
ONE = 1 << SUBPIXEL_BITS
HALF = ONE >> 1

GUARD_LOW = -16384.0
"""Smallest screen coordinate in pixels that is snapped without clipping."""
GUARD_HIGH = 49152.0
"""Largest one; the screen itself ends at 32768."""

OUT_LEFT, OUT_RIGHT, OUT_TOP, OUT_BOTTOM, OUT_NEAR = 1, 2, 4, 8, 16
CLIPPED = -(1 << 31)
"""In place of a coordinate: the vertex is one that triangles are to be clipped at."""
LANES = 8

MAX_CORNERS = 8
"""A triangle cut by five planes has at most eight corners."""


@inlined
def mapped(m, k, x, y, z):
    """Return row k of a map, without its constant, times a vector or vectors."""
    return m[k, 0] * x + m[k, 1] * y + m[k, 2] * z


@inlined
def project(p0, p1, p2, eye, m):
    """Return q = M (p - eye, 1) of a world point in float64, or of a vector of points."""
    r0, r1, r2 = p0 - eye[0], p1 - eye[1], p2 - eye[2]
    return (
        mapped(m, 0, r0, r1, r2) + m[0, 3],
        mapped(m, 1, r0, r1, r2) + m[1, 3],
        mapped(m, 2, r0, r1, r2) + m[2, 3],
        mapped(m, 3, r0, r1, r2) + m[3, 3],
    )


@inlined
def snap(x):
    """Return a screen coordinate in units of 1/256 pixel; halves go up."""
    return np.int32(np.floor(x * ONE + 0.5))


@parallel_kernel
def transform_vertices(share, vertices, eye, m, width, height, xy):
    """Snap all vertices: (V, 3) float32 world -> xy (V,) int64, y above x.

    A vertex nearer than the near plane or beyond the guard band has `CLIPPED` for x and, for y,
    the sides of the screen that it lies outside of.
    """
    n = len(vertices)
    w, h = np.float64(width), np.float64(height)
    for group in part(share, (n + LANES - 1) // LANES):
        at = group * LANES
        live = simd.first(n - at, LANES)
        px, py, pz = simd.load_triples(vertices, 3 * at, n - at, LANES)
        q0, q1, q2, q3 = project(simd.to_f64(px), simd.to_f64(py), simd.to_f64(pz), eye, m)
        # Written so that a NaN, which finite input cannot make, would be clipped away.
        front = q2 >= q3
        x, y = q0 / q2, q1 / q2
        plain = front & (x >= GUARD_LOW) & (x <= GUARD_HIGH) & (y >= GUARD_LOW) & (y <= GUARD_HIGH)
        # Tests in homogeneous form hold on both sides of the eye's plane.
        sides = simd.to_i64(q0 < 0.0) | simd.to_i64(q0 > w * q2) << 1
        sides = sides | simd.to_i64(q1 < 0.0) << 2 | simd.to_i64(q1 > h * q2) << 3
        sides = sides | simd.to_i64(~front) << 4
        sx = simd.to_i64(simd.floor(x * ONE + 0.5)) & 0xFFFFFFFF
        sy = simd.to_i64(simd.floor(y * ONE + 0.5))
        packed = simd.select(plain, sx | sy << 32, sides << 32 | np.int64(CLIPPED & 0xFFFFFFFF))
        simd.store_masked(xy, at, packed, live)


@inlined
def _distance(plane, q0, q1, q2, q3):
    """Return the signed distance of q, up to scale, inside the clip plane number `plane`."""
    if plane == 0:
        return q2 - q3
    if plane == 1:
        return q0 - GUARD_LOW * q2
    if plane == 2:
        return GUARD_HIGH * q2 - q0
    if plane == 3:
        return q1 - GUARD_LOW * q2
    return GUARD_HIGH * q2 - q1


@inlined
def _before(q, a, b):
    """Is corner `a` before corner `b` in the lexicographic order of coordinates."""
    if q[a, 0] != q[b, 0]:
        return q[a, 0] < q[b, 0]
    if q[a, 1] != q[b, 1]:
        return q[a, 1] < q[b, 1]
    if q[a, 2] != q[b, 2]:
        return q[a, 2] < q[b, 2]
    return q[a, 3] < q[b, 3]


@called
def clip_plane(plane, q, n, result):
    """Clip the convex polygon q[:n] against one plane into `result`; return its corner count.

    A cut edge is interpolated from its lexicographically first end whichever way it is walked, so
    both triangles at an edge get the same bits and stay watertight.
    """
    count = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        di = _distance(plane, q[i, 0], q[i, 1], q[i, 2], q[i, 3])
        dj = _distance(plane, q[j, 0], q[j, 1], q[j, 2], q[j, 3])
        if di >= 0.0:
            result[count, 0] = q[i, 0]
            result[count, 1] = q[i, 1]
            result[count, 2] = q[i, 2]
            result[count, 3] = q[i, 3]
            count += 1
        if (di >= 0.0) != (dj >= 0.0):
            if _before(q, i, j):
                a, b, da, db = i, j, di, dj
            else:
                a, b, da, db = j, i, dj, di
            t = da / (da - db)
            result[count, 0] = q[a, 0] + t * (q[b, 0] - q[a, 0])
            result[count, 1] = q[a, 1] + t * (q[b, 1] - q[a, 1])
            result[count, 3] = q[a, 3] + t * (q[b, 3] - q[a, 3])
            # On the near plane w = d.
            result[count, 2] = result[count, 3] if plane == 0 else q[a, 2] + t * (q[b, 2] - q[a, 2])
            count += 1
    return count


@inlined
def _doubled_area(p, a, b, c):
    return np.int64(p[b, 0] - p[a, 0]) * np.int64(p[c, 1] - p[a, 1]) - np.int64(
        p[b, 1] - p[a, 1]
    ) * np.int64(p[c, 0] - p[a, 0])


@called
def clip_triangle(vertices, faces, face, eye, m, q, spare, corners):
    """Clip one triangle; return how many corners its snapped polygon has.

    q, spare (MAX_CORNERS + 1, 4) float64 are scratch; corners (MAX_CORNERS + 1, 2) int32 comes out
    with a first corner from which the polygon can be cut into a fan.
    """
    for k in range(3):
        v = faces[face, k]
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        q[k, 0], q[k, 1], q[k, 2], q[k, 3] = project(
            np.float64(x), np.float64(y), np.float64(z), eye, m
        )
    n = 3
    for plane in range(5):
        n = clip_plane(plane, q, n, spare)
        q, spare = spare, q
        if n < 3:
            return 0
    for k in range(n):
        # Interpolation may end a rounding error outside of the guard band.
        spare[k, 0] = snap(min(max(q[k, 0] / q[k, 2], GUARD_LOW), GUARD_HIGH))
        spare[k, 1] = snap(min(max(q[k, 1] / q[k, 2], GUARD_LOW), GUARD_HIGH))
    root = _fan_root(spare, n)
    for k in range(n):
        at = (root + k) % n
        corners[k, 0] = np.int32(spare[at, 0])
        corners[k, 1] = np.int32(spare[at, 1])
    return n


@inlined
def _fan_root(p, n):
    """Return a corner from which all triangles of the fan turn one way, 0 if there is none.

    Snapping can dent a convex polygon by a fraction of a sub-pixel; a fan from a wrong corner would
    then cover a bit of the neighbour.
    """
    for root in range(n):
        positive = False
        negative = False
        for k in range(1, n - 1):
            area = _doubled_area(p, root, (root + k) % n, (root + k + 1) % n)
            positive |= area > 0
            negative |= area < 0
        if not (positive and negative):
            return root
    return 0
