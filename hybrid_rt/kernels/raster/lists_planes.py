"""Faces as planes: what of a triangle is compared with the squares of pixels, and its error.

A triangle's points and their lines of sight fill a cone, or a prism. Its faces are the planes
through the edges along the lines of sight, N = q_i x q_j for vertices q = (x w, y w, w) of
M (p - eye, 1), so that N . (x, y, 1) has one sign inside; this holds for vertices behind the eye as
well (Olano and Greer 1997, "Triangle Scan Conversion using 2D Homogeneous Coordinates"), and
nothing is clipped. Of parallel lines of sight w is 1, and N is the edge's line on the screen.

Error bounds. e = 2**-53; a hat marks a computed value. Vertices are float32 and p - eye is rounded
once, so with Q_k = sum over c of abs(M_kc (p - eye)_c), and abs(M_k3) for the constant,

    abs(q^_k - q_k) <= 5 e Q_k:

the difference, the product and three additions. A row that has nothing but its constant, as w of
parallel lines of sight and d of a pinhole, has no error. Each component of N, a difference of two
products of such, errs by no more than ``13 e (Q_i Q_j' + Q_i' Q_j)``; evaluating the linear form
adds 4 e of its terms' sizes. `SLACK` = 32 e times the sum of those sizes covers both.

The depth plane is sigma (n . (x X + y Y + W) - k W_w) / (k D_w - n . D) with n = (b - a) x (c - a)
and k = n . (a - eye), see `kernels.raster.records`: for a pinhole near (n . r) / k, with the view r
through the place. The edges are differences of float32, rounded once, so n_k errs by no more than
4 e times its two products' sizes, whose sum over k is less than abs(b - a) abs(c - a) in sums of
absolute coordinates; SLACK times that, times the sizes of what n is multiplied with (of k: of
a - eye, times abs(W_w) or abs(D_w), one of which is 0 and the other 1), covers the scalar products,
their additions and the difference of two of them.

The sums are taken in parts: what an edge or the plane is at the corner of a block of pixels, plus
what it gains from there to a pixel's centre. The plane is multiplied by the reciprocal of its
denominator. No term of a sum is rounded more than seven times so; with what its coefficient errs
by, 13 e for both, that is 20 e, below the 32 e of SLACK.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined
from hybrid_rt.kernels._rows import transposed
from hybrid_rt.kernels.raster.clip import mapped
from hybrid_rt.kernels.raster.lists_bins import LANES, SLACK, row

EDGE_ON = 1024.0
"""A plane whose distance from the eye is not certain to one part in a thousand has no slope."""
CAP = 1.01
"""Depths above 1 lie before the near plane; the hundredth covers the error of the denominator."""
PLANE_ULPS = 16.0 * 2.0**-24
"""Error of a depth plane in float32, relative to the sizes of its terms: three roundings of what is
stored, two of the differences, four of the sum, one of the comparison."""
# Rows of LANES float64 that a set-up fills, a lane for each face: three edges (A, B, C), the plane
# (A, B, C), above which the plane's largest value over a square means nearer than the near plane
# all over.
PLANE, LIMIT, ROWS = 9, 12, 13

# What is kept of a face's depth plane for the march, in float32: slopes, depth at a reference
# point, that point, error; padded so that no row lies across two cache lines. In the grown pixels
# of the face's box, and for a place (x, y) off by no more than half of the margin, ``DEPTH +
# SLOPE_X (x - REFERENCE_X) + SLOPE_Y (y - REFERENCE_Y)`` in float32 errs by less than ERROR. Faces
# seen edge-on have NaN; the rows of faces that no tile has drawn stay as they were.
SLOPE_X, SLOPE_Y, DEPTH, REFERENCE_X, REFERENCE_Y, ERROR, PLANE_ROW = 0, 1, 2, 3, 4, 5, 8


@inlined
def put_in(v, b, c, d, e, f, g, h):
    """Return a vector of LANES lanes with seven scalars in all but its first."""
    v = simd.insert(simd.insert(simd.insert(v, 1, b), 2, c), 3, d)
    return simd.insert(simd.insert(simd.insert(simd.insert(v, 4, e), 5, f), 6, g), 7, h)


@inlined
def coordinates(corners, chosen):
    """Return x, y, z of the first corners of LANES faces, of their second and of their third."""
    f0, f1, f2, f3 = 9 * chosen[0], 9 * chosen[1], 9 * chosen[2], 9 * chosen[3]
    f4, f5, f6, f7 = 9 * chosen[4], 9 * chosen[5], 9 * chosen[6], 9 * chosen[7]
    c = transposed(
        simd.load(corners, f0, LANES), simd.load(corners, f1, LANES),
        simd.load(corners, f2, LANES), simd.load(corners, f3, LANES),
        simd.load(corners, f4, LANES), simd.load(corners, f5, LANES),
        simd.load(corners, f6, LANES), simd.load(corners, f7, LANES),
    )  # fmt: skip
    last = put_in(
        simd.f32(corners[f0 + 8], LANES), corners[f1 + 8], corners[f2 + 8], corners[f3 + 8],
        corners[f4 + 8], corners[f5 + 8], corners[f6 + 8], corners[f7 + 8],
    )  # fmt: skip
    return (
        simd.to_f64(simd.part(c, 0, LANES)), simd.to_f64(simd.part(c, 1, LANES)),
        simd.to_f64(simd.part(c, 2, LANES)), simd.to_f64(simd.part(c, 3, LANES)),
        simd.to_f64(simd.part(c, 4, LANES)), simd.to_f64(simd.part(c, 5, LANES)),
        simd.to_f64(simd.part(c, 6, LANES)), simd.to_f64(simd.part(c, 7, LANES)),
        simd.to_f64(last),
    )  # fmt: skip


@inlined
def boxes_of(spans):
    """Return first column, first row, last column and last row of LANES boxes as float64."""
    box = put_in(
        simd.i64(spans[0], LANES), spans[1], spans[2], spans[3], spans[4], spans[5], spans[6],
        spans[7],
    )  # fmt: skip
    return (
        simd.to_f64(simd.to_i32(box & 0xFFFF)), simd.to_f64(simd.to_i32((box >> 16) & 0xFFFF)),
        simd.to_f64(simd.to_i32((box >> 32) & 0xFFFF)), simd.to_f64(simd.to_i32(box >> 48)),
    )  # fmt: skip


@inlined
def size(x, y, z):
    """Return the sum of the sizes of three coordinates."""
    return simd.absolute(x) + simd.absolute(y) + simd.absolute(z)


@inlined
def size_of(frame, row):
    """Return the sum of the sizes of the first three of a row of `frame`."""
    return abs(frame[row, 0]) + abs(frame[row, 1]) + abs(frame[row, 2])


@inlined
def highest(a, b, c, x0, y0, x1, y1):
    """Return the largest of a x + b y + c over x0..x1, y0..y1."""
    return simd.maximum(a * x0, a * x1) + (simd.maximum(b * y0, b * y1) + c)


@inlined
def edge_plane(p0, p1, p2, s0, s1, s2, q0, q1, q2, r0, r1, r2, side, width, height, half):
    """Return the plane through an edge along the lines of sight, turned inwards.

    To the constant is added what it gains over a square of half side `half`, and its slack.
    """
    a = side * (p1 * q2 - p2 * q1)
    b = side * (p2 * q0 - p0 * q2)
    c = side * (p0 * q1 - p1 * q0)
    slack = SLACK * (
        (s1 * r2 + s2 * r1) * (width + 1.0) + (s2 * r0 + s0 * r2) * (height + 1.0)
        + (s0 * r1 + s1 * r0)
    )  # fmt: skip
    return a, b, c + (simd.absolute(a) + simd.absolute(b)) * half + slack


@inlined
def store_planes(a, b, c, reach, lowered, sloped, i0, j0, i1, j1, cx, cy, margin, chosen, planes):
    """Store the rows of `planes` for LANES faces.

    a, b, c: the plane about the screen's centre; reach: its error; lowered: twice the relative
    error of its denominator; i0, j0, i1, j1: the boxes of the faces.
    """
    x, y = 0.5 * (i0 + i1 + 1.0), 0.5 * (j0 + j1 + 1.0)
    at = a * (x - cx) + b * (y - cy) + c
    steep_x, steep_y = simd.absolute(a), simd.absolute(b)
    most = simd.absolute(at) + steep_x * (0.5 * (i1 - i0 + 3.0)) + steep_y * (0.5 * (j1 - j0 + 3.0))
    error = PLANE_ULPS * most + (steep_x + steep_y) * margin + reach + most * lowered
    nothing = simd.f32(0.0, LANES)
    rows = transposed(
        simd.to_f32(a), simd.to_f32(b), simd.to_f32(simd.select(sloped, at, np.nan)),
        simd.to_f32(x), simd.to_f32(y), simd.to_f32(error * (1.0 + 2.0**-20)), nothing, nothing,
    )  # fmt: skip
    simd.store(planes, PLANE_ROW * chosen[0], simd.part(rows, 0, LANES))
    simd.store(planes, PLANE_ROW * chosen[1], simd.part(rows, 1, LANES))
    simd.store(planes, PLANE_ROW * chosen[2], simd.part(rows, 2, LANES))
    simd.store(planes, PLANE_ROW * chosen[3], simd.part(rows, 3, LANES))
    simd.store(planes, PLANE_ROW * chosen[4], simd.part(rows, 4, LANES))
    simd.store(planes, PLANE_ROW * chosen[5], simd.part(rows, 5, LANES))
    simd.store(planes, PLANE_ROW * chosen[6], simd.part(rows, 6, LANES))
    simd.store(planes, PLANE_ROW * chosen[7], simd.part(rows, 7, LANES))


@inlined
def set_up(
    corners, chosen, spans, left, top, right, bottom, eye, m, frame, sigma, hand, width, height,
    margin, cx, cy, rows, planes,
):  # fmt: skip
    """Fill `rows` with the edges and planes of LANES faces; return which may touch a square, bits.

    corners (9 F,) float32, world; chosen, spans (LANES,) int64: the faces and their boxes; left,
    top, right, bottom: the part of the screen that is drawn. Their rows of `planes` are written.
    """
    half = 0.5 + margin
    xa, ya, za, xb, yb, zb, xc, yc, zc = coordinates(corners, chosen)
    ax, ay, az = xa - eye[0], ya - eye[1], za - eye[2]
    bx, by, bz = xb - eye[0], yb - eye[1], zb - eye[2]
    cx_, cy_, cz = xc - eye[0], yc - eye[1], zc - eye[2]
    i0, j0, i1, j1 = boxes_of(spans)
    # A face with two equal corners is a line or a point and is never hit.
    area = ~(
        ((xa == xb) & (ya == yb) & (za == zb))
        | ((xb == xc) & (yb == yc) & (zb == zc))
        | ((xc == xa) & (yc == ya) & (zc == za))
    )
    a0, sa0 = row(m, 0, ax, ay, az)
    a1, sa1 = row(m, 1, ax, ay, az)
    a2, sa2 = row(m, 2, ax, ay, az)
    b0, sb0 = row(m, 0, bx, by, bz)
    b1, sb1 = row(m, 1, bx, by, bz)
    b2, sb2 = row(m, 2, bx, by, bz)
    c0, sc0 = row(m, 0, cx_, cy_, cz)
    c1, sc1 = row(m, 1, cx_, cy_, cz)
    c2, sc2 = row(m, 2, cx_, cy_, cz)
    # Float32 inputs, so that one rounding is all the error of the edges.
    ux, uy, uz = xb - xa, yb - ya, zb - za
    vx, vy, vz = xc - xa, yc - ya, zc - za
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    n_slack = SLACK * size(ux, uy, uz) * size(vx, vy, vz)
    k = nx * ax + ny * ay + nz * az
    k_slack = n_slack * size(ax, ay, az)
    d = k * frame[3, 3] - mapped(frame, 3, nx, ny, nz)
    d_slack = k_slack * abs(frame[3, 3]) + n_slack * size_of(frame, 3)
    sloped = simd.absolute(d) > EDGE_ON * d_slack
    side = simd.select(d > 0.0, simd.f64(1.0, LANES), -1.0)
    scale = 1.0 / simd.select(sloped, side * d - d_slack, 1.0)
    towards = side * sigma
    pa = towards * mapped(frame, 0, nx, ny, nz)
    pb = towards * mapped(frame, 1, nx, ny, nz)
    pc = towards * (mapped(frame, 2, nx, ny, nz) - k * frame[2, 3])
    reach = n_slack * (sigma * (
        width * size_of(frame, 0) + height * size_of(frame, 1) + size_of(frame, 2)
    )) + k_slack * (sigma * abs(frame[2, 3]))  # fmt: skip
    spread = (simd.absolute(pa) + simd.absolute(pb)) * half + reach
    pa, pb = pa * scale, pb * scale
    store_planes(
        pa, pb, pc * scale, reach * scale, 2.0 * d_slack * scale, sloped, i0, j0, i1, j1, cx, cy,
        margin, chosen, planes,
    )  # fmt: skip
    # A face that is seen edge-on is bounded by its box and its nearest depth alone.
    pa = simd.select(sloped, pa, 0.0)
    pb = simd.select(sloped, pb, 0.0)
    pc = simd.select(sloped, (pc + spread) * scale, np.inf)
    limit = simd.select(sloped, CAP + 2.0 * (spread * scale), np.inf)

    # The sense of the outline on the screen: a mirror image turns it.
    side = simd.select(sloped, side * hand, 0.0)
    ea, eb, ec = edge_plane(
        a0, a1, a2, sa0, sa1, sa2, b0, b1, b2, sb0, sb1, sb2, side, width, height, half
    )
    fa, fb, fc = edge_plane(
        b0, b1, b2, sb0, sb1, sb2, c0, c1, c2, sc0, sc1, sc2, side, width, height, half
    )
    ga, gb, gc = edge_plane(
        c0, c1, c2, sc0, sc1, sc2, a0, a1, a2, sa0, sa1, sa2, side, width, height, half
    )
    x0, y0 = simd.maximum(i0, left) + 0.5, simd.maximum(j0, top) + 0.5
    x1, y1 = simd.minimum(i1, right - 1) + 0.5, simd.minimum(j1, bottom - 1) + 0.5
    bound = highest(pa, pb, pc, x0 - cx, y0 - cy, x1 - cx, y1 - cy)
    some = area & (highest(ea, eb, ec, x0, y0, x1, y1) >= 0.0)
    some = some & (highest(fa, fb, fc, x0, y0, x1, y1) >= 0.0)
    some = some & (highest(ga, gb, gc, x0, y0, x1, y1) >= 0.0)
    some = some & (bound > 0.0)

    simd.store(rows, 0 * LANES, ea)
    simd.store(rows, 1 * LANES, eb)
    simd.store(rows, 2 * LANES, ec)
    simd.store(rows, 3 * LANES, fa)
    simd.store(rows, 4 * LANES, fb)
    simd.store(rows, 5 * LANES, fc)
    simd.store(rows, 6 * LANES, ga)
    simd.store(rows, 7 * LANES, gb)
    simd.store(rows, 8 * LANES, gc)
    simd.store(rows, PLANE * LANES, pa)
    simd.store(rows, (PLANE + 1) * LANES, pb)
    simd.store(rows, (PLANE + 2) * LANES, pc)
    simd.store(rows, LIMIT * LANES, limit)
    return simd.bits(some)
