"""Which tiles a triangle may touch: boxes of vertices, boxes of triangles, bins of tiles.

A vertex's *box* are the pixels whose grown squares may hold its projection: its coordinates with
their error bounds (see `kernels.raster.lists_planes`) and the margin, rounded outwards. The box of
a triangle wholly in front of the near plane is the least that holds those of its vertices.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels._queue import part, take
from hybrid_rt.kernels.raster._order import entry
from hybrid_rt.kernels.raster.bins import TILE_BITS

SLACK = 2.0**-48
"""Relative error of sums of three products and a constant, 32 e; see
`kernels.raster.lists_planes`."""
NEAR_SLACK = 2.0**-20
"""The near plane is moved to the eye by this, relative: a ray may end a rounding beyond it."""

LEFT, RIGHT, ABOVE, BELOW, BEHIND, BEYOND = 1, 2, 4, 8, 16, 64
OUTSIDE = LEFT | RIGHT | ABOVE | BELOW | BEHIND | BEYOND
"""All three vertices on the outer side of one plane: the triangle is not seen. Only parallel lines
of sight have a far plane, to lie beyond."""
UNSURE = 32
"""Not certainly in front of the near plane; the vertex has no box."""

TINY = np.float32(1e-37)
"""A bound that is not zero is at least this, where float32 still has all its digits."""

LANES = 8
MOST = 32767
"""Largest number that a box holds."""


@inlined
def row(m, k, x, y, z):
    """Return (q_k, Q_k): row k of M times (vectors, 1), and the sum of its terms' sizes."""
    a, b, c, d = m[k, 0] * x, m[k, 1] * y, m[k, 2] * z, m[k, 3]
    return a + b + c + d, simd.absolute(a) + simd.absolute(b) + simd.absolute(c) + abs(d)


@inlined
def exact_row(m, k):
    """Is row k of M a constant, which has no error."""
    return m[k, 0] == 0.0 and m[k, 1] == 0.0 and m[k, 2] == 0.0


@inlined
def pixel(x, low, high):
    """Return the number of the pixel that holds a coordinate, kept within low..high."""
    return simd.to_i64(simd.floor(simd.minimum(simd.maximum(x, low), high)))


@inlined
def round_up(depth):
    """Return float32 that are no less than depths."""
    return simd.maximum(simd.to_f32(depth * (1.0 + 2.0**-22)), TINY)


@parallel_kernel
def box_vertices(share, vertices, eye, m, width, height, margin, boxes, flags, nearest):
    """Find the flags and boxes of all vertices, and how near they are.

    vertices (3 V,) float32 world -> boxes (V,) int64, which hold i0, j0, i1, j1 as int16, the first
    lowest, flags (V,) uint8, and nearest (V,) float32, upper bounds of the depths of vertices that
    are in front of the near plane and its depth for all others.
    """
    n = len(vertices) // 3
    slack_w = 0.0 if exact_row(m, 2) else SLACK
    slack_d = 0.0 if exact_row(m, 3) else SLACK
    right, bottom = width - 1.0, height - 1.0
    beyond_x, beyond_y = min(width, MOST) + 0.0, min(height, MOST) + 0.0
    for group in part(share, (n + LANES - 1) // LANES):
        at = group * LANES
        live = simd.first(n - at, LANES)
        px, py, pz = simd.load_triples(vertices, 3 * at, n - at, LANES)
        x, y, z = simd.to_f64(px) - eye[0], simd.to_f64(py) - eye[1], simd.to_f64(pz) - eye[2]
        q0, s0 = row(m, 0, x, y, z)
        q1, s1 = row(m, 1, x, y, z)
        q2, s2 = row(m, 2, x, y, z)
        q3, s3 = row(m, 3, x, y, z)
        e0, e1, e2, e3 = SLACK * s0, SLACK * s1, slack_w * s2, slack_d * s3
        high = q3 + e3
        close = high * (1.0 - NEAR_SLACK)
        front = q2 - e2 >= close
        # Wholly beside the grown screen, in homogeneous form.
        bits = simd.to_i32(q0 + e0 + margin * (q2 + e2) < 0.0)
        bits = bits | simd.to_i32(q0 - e0 - (width + margin) * (q2 + e2) > 0.0) << 1
        bits = bits | simd.to_i32(q1 + e1 + margin * (q2 + e2) < 0.0) << 2
        bits = bits | simd.to_i32(q1 - e1 - (height + margin) * (q2 + e2) > 0.0) << 3
        bits = bits | simd.to_i32(~(q2 + e2 >= (q3 - e3) * (1.0 - NEAR_SLACK))) << 4
        bits = bits | simd.to_i32(~front) << 5 | simd.to_i32(high < 0.0) << 6
        simd.store_masked(flags, at, bits, live)
        w = simd.select(front, q2, 1.0)
        px, py = q0 / w, q1 / w
        ex = (e0 + simd.absolute(px) * e2) / w + margin
        ey = (e1 + simd.absolute(py) * e2) / w + margin
        # Not by conversion alone: a far corner may not fit an integer.
        box = pixel(px - ex, 0.0, beyond_x)
        box = box | pixel(py - ey, 0.0, beyond_y) << 16
        box = box | (pixel(px + ex, -1.0, right) & 0xFFFF) << 32
        box = box | pixel(py + ey, -1.0, bottom) << 48
        simd.store_masked(boxes, at, box, live)
        simd.store_masked(nearest, at, round_up(high / simd.maximum(q2 - e2, close)), live)


@inlined
def face_box(a, b, c, boxes, flags, width, height):
    """Return (any, i0, j0, i1, j1): the grown pixels that the face of three vertices may touch.

    boxes (V, 4) int16, flags (V,). A face that crosses the near plane gets the whole screen, unless
    it lies beside it.
    """
    if (flags[a] & flags[b] & flags[c] & OUTSIDE) != 0:
        return False, 0, 0, 0, 0
    if ((flags[a] | flags[b] | flags[c]) & UNSURE) != 0:
        return True, 0, 0, width - 1, height - 1
    i0 = min(np.int64(boxes[a, 0]), np.int64(boxes[b, 0]), np.int64(boxes[c, 0]))
    j0 = min(np.int64(boxes[a, 1]), np.int64(boxes[b, 1]), np.int64(boxes[c, 1]))
    i1 = max(np.int64(boxes[a, 2]), np.int64(boxes[b, 2]), np.int64(boxes[c, 2]))
    j1 = max(np.int64(boxes[a, 3]), np.int64(boxes[b, 3]), np.int64(boxes[c, 3]))
    return i0 <= i1 and j0 <= j1, i0, j0, i1, j1


@parallel_kernel
def cull_and_count(
    share, faces, first, last, boxes, flags, nearest, width, height, tiles_x, chunk,
    records, n_survivors, counts,
):  # fmt: skip
    """Find the faces first..last-1 that may touch a pixel, and count them in every tile.

    Out come, for each chunk at its own place, the records (last - first, 2) int64 of the faces: the
    box, packed as those of vertices, and the bits of the nearest depth of the vertices, with the
    number of the face in the lower half; n_survivors (chunks,) int32; counts (chunks, tiles) int32.
    """
    depth_bits = nearest.view(np.int32)
    c = take(share, 1)
    while c < len(counts):
        count = counts[c]
        count[:] = 0
        begin = first + c * chunk
        kept = begin - first
        for face in range(begin, min(begin + chunk, last)):
            p, q, r = faces[face, 0], faces[face, 1], faces[face, 2]
            some, i0, j0, i1, j1 = face_box(p, q, r, boxes, flags, width, height)
            if not some:
                continue
            depth = max(depth_bits[p], depth_bits[q], depth_bits[r])
            records[kept, 0] = i0 | (j0 << 16) | (i1 << 32) | (j1 << 48)
            records[kept, 1] = (np.int64(depth) << 32) | np.int64(face)
            kept += 1
            for v in range(j0 >> TILE_BITS, (j1 >> TILE_BITS) + 1):
                for u in range(i0 >> TILE_BITS, (i1 >> TILE_BITS) + 1):
                    count[v * tiles_x + u] += 1
        n_survivors[c] = kept - (begin - first)
        c = take(share, 1)


@parallel_kernel
def fill_bins(share, records, n_survivors, tiles_x, chunk, cursors, bins):
    """Note the survivors, by their places, in every tile of their box.

    cursors (chunks, tiles) int32, made of the counts by `kernels.raster.bins.prefix_sums`, are
    advanced; bins (entries,) int64, see `kernels.raster._order`.
    """
    c = take(share, 1)
    while c < len(cursors):
        cursor = cursors[c]
        for s in range(c * chunk, c * chunk + n_survivors[c]):
            span = records[s, 0]
            u0, u1 = (span & 0xFFFF) >> TILE_BITS, ((span >> 32) & 0xFFFF) >> TILE_BITS
            v0, v1 = ((span >> 16) & 0xFFFF) >> TILE_BITS, span >> (48 + TILE_BITS)
            for v in range(v0, v1 + 1):
                for u in range(u0, u1 + 1):
                    tile = v * tiles_x + u
                    bins[cursor[tile]] = entry(records[s, 1] >> 32, s)
                    cursor[tile] += 1
        c = take(share, 1)
