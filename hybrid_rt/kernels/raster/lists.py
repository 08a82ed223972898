"""Conservative raster: which primitives touch each pixel square, and how near they can be.

A *grown pixel* (i, j) is the square [i - margin, i + 1 + margin] x [j - margin, j + 1 + margin].
For every grown pixel and every triangle with a point in front of the near plane that projects into
it, the pixel's list holds the triangle with an upper bound of the depth of all such points, or the
pixel's `rest` is at least that bound. Nothing is decided at pixel centres; every decision that
rounding could turn goes to the side of covering.

A triangle's points seen from the eye fill a cone. Its faces are the planes through the eye and the
edges, N = q_i x q_j for vertices q = M (p - eye), so that N . (x, y, 1) has one sign inside; this
holds for vertices behind the eye as well (Olano and Greer 1997, "Triangle Scan Conversion using 2D
Homogeneous Coordinates"), and nothing is clipped.

Error bounds. e = 2**-53; a hat marks a computed value. Vertices are float32 and p - eye is rounded
once, so with Q_k = sum over c of abs(M_kc (p - eye)_c)

    abs(q^_k - q_k) <= 4 e Q_k,

and each component of N, a difference of two products of such, errs by no more than
``11 e (Q_i Q_j' + Q_i' Q_j)``; evaluating the linear form adds 4 e of its terms' sizes. `SLACK` =
32 e times the sum of those sizes covers both. The depth plane is near (n . r) / (n . a) with
n = (b - a) x (c - a): the edges are differences of float32, rounded once, so n_k errs by no more
than 4 e times its two products' sizes, whose sum over k is less than abs(b - a) abs(c - a) in sums
of absolute coordinates; SLACK times that, times the sizes of r or of a, covers both scalar
products, their 3 additions included.

The sums are taken in parts: what an edge or the plane is at the corner of a block of pixels, plus
what it gains from there to a pixel's centre. The plane is multiplied by the reciprocal of its
denominator. No term of a sum is rounded more than seven times so; with what its coefficient errs
by, 11 e for both, that is 18 e, below the 32 e of SLACK.

Every pixel's list is sorted by *keys*: the bits of the bound, and below them the complement of the
face's number, so that of equal bounds the smaller number comes first and the order of drawing does
not show. A tile's faces are drawn from near to far all the same, because what is behind all that
its pixels have already left out of their lists changes nothing.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._aligned import aligned
from hybrid_rt.kernels._borrow import borrowed, keep
from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels._queue import fetch_add
from hybrid_rt.kernels._rows import transposed
from hybrid_rt.kernels.raster._order import BUCKETS, near_first
from hybrid_rt.kernels.raster.bins import TILE, TILE_BITS
from hybrid_rt.kernels.raster.lists_bins import LANES, SLACK, round_up, row

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

BLOCK_X, BLOCK_Y = 4, 2
"""Pixels of a block, a lane each: the first four are the upper row."""
COLUMNS = TILE // BLOCK_X
BLOCKS = COLUMNS * (TILE // BLOCK_Y)

WHOLE = 8
"""Length of lists that are written a row of a block at a time."""
LINE = WHOLE * BLOCK_X

FULL = np.int32(2**31 - 1)
INVERSE = np.array([0] + [65536 // n + 1 for n in range(1, LANES + 1)], np.int32)
""" t * INVERSE[n] >> 16 is t // n for t < LANES."""


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
def highest(a, b, c, x0, y0, x1, y1):
    """Return the largest of a x + b y + c over x0..x1, y0..y1."""
    return simd.maximum(a * x0, a * x1) + (simd.maximum(b * y0, b * y1) + c)


@inlined
def edge_plane(p0, p1, p2, s0, s1, s2, q0, q1, q2, r0, r1, r2, side, width, height, half):
    """Return the plane through the eye and an edge, turned inwards.

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
    corners, chosen, spans, left, top, right, bottom, eye, m, frame, near, width, height, margin,
    cx, cy, rows, planes,
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
    d = nx * ax + ny * ay + nz * az
    d_slack = n_slack * size(ax, ay, az)
    sloped = simd.absolute(d) > EDGE_ON * d_slack
    side = simd.select(d > 0.0, simd.f64(1.0, LANES), -1.0)
    scale = 1.0 / simd.select(sloped, side * d - d_slack, 1.0)
    towards = side * near
    pa = towards * (nx * frame[0, 0] + ny * frame[0, 1] + nz * frame[0, 2])
    pb = towards * (nx * frame[1, 0] + ny * frame[1, 1] + nz * frame[1, 2])
    pc = towards * (nx * frame[2, 0] + ny * frame[2, 1] + nz * frame[2, 2])
    reach = n_slack * (near * (
        width * (abs(frame[0, 0]) + abs(frame[0, 1]) + abs(frame[0, 2]))
        + height * (abs(frame[1, 0]) + abs(frame[1, 1]) + abs(frame[1, 2]))
        + (abs(frame[2, 0]) + abs(frame[2, 1]) + abs(frame[2, 2]))
    ))  # fmt: skip
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

    side = simd.select(sloped, side, 0.0)
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


@inlined
def insert(new, block, length, keys, filled, farthest):
    """Put keys, 0 for none, into the lists of a block's pixels; what falls out raises the rest.

    The larger of the key and what stands in a place stays, the smaller goes on. How many places are
    filled is known before the first is read; where to stop would not be, and wrong guesses of that
    cost more than the places that could be left out.
    """
    base = block * (length + 1) * LANES
    n = filled[block]
    last = simd.i64(0, LANES)
    if n > length:
        last = simd.load(keys, base + length * LANES, LANES)
    if simd.any_(new > last):
        for k in range(n):
            old = simd.load(keys, base + k * LANES, LANES)
            last = simd.maximum(old, new)
            new = simd.minimum(old, new)
            simd.store(keys, base + k * LANES, last)
        if n <= length:
            simd.store(keys, base + n * LANES, new)
            filled[block] = n + 1
        else:
            farthest[block] = np.int32(simd.reduce_min(last) >> 32)


@inlined
def within(span, left, top, right, bottom):
    """Return the part of a box that lies in a tile."""
    i0, j0 = max(span & 0xFFFF, left), max((span >> 16) & 0xFFFF, top)
    return i0, j0, min((span >> 32) & 0xFFFF, right - 1), min(span >> 48, bottom - 1)


@inlined
def hidden(left, top, i0, j0, i1, j1, farthest):
    """Return the bits of a bound that is below what all pixels of a box have left out."""
    low = simd.i32(FULL, COLUMNS)
    for v in range((j0 - top) >> 1, ((j1 - top) >> 1) + 1):
        low = simd.minimum(low, simd.load(farthest, v * COLUMNS, COLUMNS))
    column = simd.iota(COLUMNS)
    there = (column >= ((i0 - left) >> 2)) & (column <= ((i1 - left) >> 2))
    return simd.reduce_min(simd.select(there, low, FULL))


@inlined
def draw(
    face, nearest, lane, rows, left, top, i0, j0, i1, j1, cx, cy, length, keys, filled, farthest,
    places, starts,
):  # fmt: skip
    """Insert a face into the lists of those pixels i0..i1, j0..j1 of a tile that it may touch.

    Blocks go in groups of up to LANES: the box in one, if it has no more, or a row of it.
    """
    a0, b0, c0 = rows[lane], rows[LANES + lane], rows[2 * LANES + lane]
    a1, b1, c1 = rows[3 * LANES + lane], rows[4 * LANES + lane], rows[5 * LANES + lane]
    a2, b2, c2 = rows[6 * LANES + lane], rows[7 * LANES + lane], rows[8 * LANES + lane]
    pa, pb, pc = (
        rows[PLANE * LANES + lane], rows[(PLANE + 1) * LANES + lane],
        rows[(PLANE + 2) * LANES + lane],
    )  # fmt: skip
    limit = rows[LIMIT * LANES + lane]
    number = simd.iota(LANES)
    x = simd.to_f64(number & 3) + 0.5
    y = simd.to_f64(number >> 2) + 0.5
    within0, within1, within2 = a0 * x + b0 * y, a1 * x + b1 * y, a2 * x + b2 * y
    within_p = pa * x + pb * y
    most0 = max(0.5 * a0, 3.5 * a0) + max(0.5 * b0, 1.5 * b0)
    most1 = max(0.5 * a1, 3.5 * a1) + max(0.5 * b1, 1.5 * b1)
    most2 = max(0.5 * a2, 3.5 * a2) + max(0.5 * b2, 1.5 * b2)
    low_bits = np.int64(~face) & np.int64(0xFFFFFFFF)

    u0, v0 = (i0 - left) >> 2, (j0 - top) >> 1
    wide, high = ((i1 - left) >> 2) - u0 + 1, ((j1 - top) >> 1) - v0 + 1
    together = wide * high <= LANES
    count = wide * high if together else wide
    down = (number * (INVERSE[wide] if together else np.int32(0))) >> 16
    u = number - down * np.int32(wide) + np.int32(u0)
    xs = simd.to_f64((u << 2) + np.int32(left))
    columns = np.int32((np.int64(2) << (i1 - left)) - (np.int64(1) << (i0 - left)))
    columns_of = ((simd.i32(columns, LANES) >> (u << 2)) & 15) * np.int32(17)
    for group in range(1 if together else high):
        v = down + np.int32(v0 + group)
        line = (v << 1) + np.int32(top)
        ys = simd.to_f64(line)
        e0, e1, e2 = a0 * xs + (b0 * ys + c0), a1 * xs + (b1 * ys + c1), a2 * xs + (b2 * ys + c2)
        simd.store(starts, 0, e0)
        simd.store(starts, LANES, e1)
        simd.store(starts, 2 * LANES, e2)
        simd.store(starts, 3 * LANES, pa * (xs - cx) + (pb * (ys - cy) + pc))
        lines_of = (simd.to_i32(line >= np.int32(j0)) * np.int32(0x0F)) | (
            simd.to_i32(line < np.int32(j1)) * np.int32(0xF0)
        )
        simd.store(places, 0, columns_of & lines_of)
        simd.store(places, LANES, v * np.int32(COLUMNS) + u)
        blocks = simd.bits((e0 + most0 >= 0.0) & (e1 + most1 >= 0.0) & (e2 + most2 >= 0.0))
        blocks &= (np.int64(1) << count) - 1
        while blocks != 0:
            at = simd.lowest(blocks)
            blocks &= blocks - 1
            bound = within_p + starts[3 * LANES + at]
            inside = (
                (within0 + starts[at] >= 0.0)
                & (within1 + starts[LANES + at] >= 0.0)
                & (within2 + starts[2 * LANES + at] >= 0.0)
                # Neither beyond infinity nor nearer than the near plane, all over the square.
                & (bound > 0.0)
                & (bound <= limit)
                & simd.mask_of_bits(places[at], LANES)
            )
            depth = simd.bits_i32(simd.minimum(round_up(bound), nearest))
            new = simd.select(inside, (simd.to_i64(depth) << 32) | low_bits, 0)
            insert(new, np.int64(places[LANES + at]), length, keys, filled, farthest)


@inlined
def read_tile(left, top, right, bottom, prim_id, nearest, rest, words, floats):
    """Read a tile's lists, as earlier batches have left them."""
    length = prim_id.shape[2]
    for j in range(top, bottom):
        for i in range(left, right):
            at = ((j - top) >> 1) * COLUMNS + ((i - left) >> 2)
            at = at * (length + 1) * LANES + ((j - top) & 1) * BLOCK_X + ((i - left) & 3)
            for k in range(length):
                words[2 * (at + k * LANES)] = ~prim_id[j, i, k]
                floats[2 * (at + k * LANES) + 1] = nearest[j, i, k]
            floats[2 * (at + length * LANES) + 1] = rest[j, i]


@inlined
def write_block(i, j, start, keys, prim_id, nearest, rest):
    """Write the lists of length WHOLE of a whole block; its keys begin at `start`."""
    k0, k1 = simd.load(keys, start, LANES), simd.load(keys, start + LANES, LANES)
    k2, k3 = simd.load(keys, start + 2 * LANES, LANES), simd.load(keys, start + 3 * LANES, LANES)
    k4, k5 = simd.load(keys, start + 4 * LANES, LANES), simd.load(keys, start + 5 * LANES, LANES)
    k6, k7 = simd.load(keys, start + 6 * LANES, LANES), simd.load(keys, start + 7 * LANES, LANES)
    ids = ~transposed(
        simd.to_i32(k0), simd.to_i32(k1), simd.to_i32(k2), simd.to_i32(k3),
        simd.to_i32(k4), simd.to_i32(k5), simd.to_i32(k6), simd.to_i32(k7),
    )  # fmt: skip
    depths = transposed(
        simd.to_i32(k0 >> 32), simd.to_i32(k1 >> 32), simd.to_i32(k2 >> 32),
        simd.to_i32(k3 >> 32), simd.to_i32(k4 >> 32), simd.to_i32(k5 >> 32),
        simd.to_i32(k6 >> 32), simd.to_i32(k7 >> 32),
    )  # fmt: skip
    bounds = simd.float_of_bits(depths)
    other = simd.float_of_bits(simd.to_i32(simd.load(keys, start + WHOLE * LANES, LANES) >> 32))
    width = rest.shape[1]
    upper, lower = j * width + i, (j + 1) * width + i
    simd.store(prim_id, WHOLE * upper, simd.part(ids, 0, LINE))
    simd.store(prim_id, WHOLE * lower, simd.part(ids, 1, LINE))
    simd.store(nearest, WHOLE * upper, simd.part(bounds, 0, LINE))
    simd.store(nearest, WHOLE * lower, simd.part(bounds, 1, LINE))
    simd.store(rest, upper, simd.part(other, 0, BLOCK_X))
    simd.store(rest, lower, simd.part(other, 1, BLOCK_X))


@inlined
def write_tile(left, top, right, bottom, keys, words, floats, filled, prim_id, nearest, rest):
    """Write a finished tile's lists to the arrays; words and floats are the halves of the keys."""
    length = prim_id.shape[2]
    for block in range(BLOCKS):
        i0, j0 = left + (block % COLUMNS) * BLOCK_X, top + (block // COLUMNS) * BLOCK_Y
        start = block * (length + 1) * LANES
        for k in range(filled[block], length + 1):
            simd.store(keys, start + k * LANES, simd.i64(0, LANES))
        if length == WHOLE and i0 + BLOCK_X <= right and j0 + BLOCK_Y <= bottom:
            write_block(i0, j0, start, keys, prim_id, nearest, rest)
        else:
            for j in range(j0, min(j0 + BLOCK_Y, bottom)):
                for i in range(i0, min(i0 + BLOCK_X, right)):
                    at = start + (j - j0) * BLOCK_X + (i - i0)
                    for k in range(length):
                        prim_id[j, i, k] = ~words[2 * (at + k * LANES)]
                        nearest[j, i, k] = floats[2 * (at + k * LANES) + 1]
                    rest[j, i] = floats[2 * (at + length * LANES) + 1]


@parallel_kernel
def fill_lists(
    corners, tile_start, bins, records, eye, m, frame, near, width, height, margin, tiles_x,
    workers, fresh, prim_id, nearest, rest, planes,
):  # fmt: skip
    """Insert every bin's faces into the lists of its tile.

    prim_id (H, W, K) int32, nearest (H, W, K) and rest (H, W) float32 hold what earlier batches
    have left; with `fresh` they hold nothing yet and all is written. planes (F, PLANE_ROW) float32:
    each tile writes the rows of the faces that it draws, all tiles the same.
    """
    length = prim_id.shape[2]
    tiles = len(tile_start) - 1
    cx, cy = 0.5 * width, 0.5 * height
    most = 0
    for tile in range(tiles):
        most = max(most, tile_start[tile + 1] - tile_start[tile])
    taken = np.zeros(1, np.int64)
    for _ in prange(workers):
        owner = aligned(BLOCKS * (length + 1) * LANES)
        keys = borrowed(owner)
        words, floats = keys.view(np.int32), keys.view(np.float32)
        rows = aligned(ROWS * LANES).view(np.float64)
        starts = aligned(4 * LANES).view(np.float64)
        places = aligned(LANES).view(np.int32)
        chosen, spans = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
        near_bits = np.zeros(LANES, np.int32)
        nears = near_bits.view(np.float32)
        owner2 = aligned(BLOCKS // 2).view(np.int32)
        farthest = borrowed(owner2)
        owner3 = np.empty(BLOCKS, np.int64)
        filled = borrowed(owner3)
        order = np.empty(most, np.int64)
        heads = np.empty(BUCKETS + 1, np.int32)
        tile = fetch_add(taken.ctypes.data, 1)
        while tile < tiles:
            start, end = np.int64(tile_start[tile]), np.int64(tile_start[tile + 1])
            if fresh or end > start:
                left = (tile % tiles_x) << TILE_BITS
                top = (tile // tiles_x) << TILE_BITS
                right = min(left + TILE, width)
                bottom = min(top + TILE, height)
                farthest[:] = 0
                if fresh:
                    filled[:] = 0
                else:
                    filled[:] = length + 1
                    read_tile(left, top, right, bottom, prim_id, nearest, rest, words, floats)
                near_first(bins, start, end, order, heads)
                at = np.int64(0)
                while at < end - start:
                    count = 0
                    while count < LANES and at < end - start:
                        s = order[at] & 0xFFFFFFFF
                        at += 1
                        span, word = records[s, 0], records[s, 1]
                        i0, j0, i1, j1 = within(span, left, top, right, bottom)
                        if word >> 32 < hidden(left, top, i0, j0, i1, j1, farthest):
                            continue
                        chosen[count], spans[count] = word & 0xFFFFFFFF, span
                        near_bits[count] = word >> 32
                        count += 1
                    if count == 0:
                        break
                    for lane in range(count, LANES):
                        chosen[lane], spans[lane] = chosen[0], spans[0]
                    some = set_up(
                        corners, chosen, spans, left, top, right, bottom, eye, m, frame, near,
                        width, height, margin, cx, cy, rows, planes,
                    )  # fmt: skip
                    some &= (np.int64(1) << count) - 1
                    while some != 0:
                        lane = simd.lowest(some)
                        some &= some - 1
                        i0, j0, i1, j1 = within(spans[lane], left, top, right, bottom)
                        draw(
                            chosen[lane], nears[lane], lane, rows, left, top, i0, j0, i1, j1,
                            cx, cy, length, keys, filled, farthest, places, starts,
                        )  # fmt: skip
                write_tile(
                    left, top, right, bottom, keys, words, floats, filled, prim_id, nearest, rest
                )
            tile = fetch_add(taken.ctypes.data, 1)
        keep(owner)
        keep(owner2)
        keep(owner3)
