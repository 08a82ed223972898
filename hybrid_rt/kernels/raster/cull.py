"""The first pass of a tiled rasteriser: which faces may cover a pixel, and how many each tile gets.

Coverage is decided by integer edge functions of vertices snapped to 1/256 pixel, at pixel centres,
with the top-left rule: two triangles at a shared edge never both cover a centre and never leave one
out.

Triangles go through in batches of consecutive faces, a batch in chunks, a chunk on one thread,
LANES faces at a time. Threads take chunks as they come, which
spreads the visible part of a scene evenly.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import called, inlined, parallel_kernel
from hybrid_rt.kernels._queue import take
from hybrid_rt.kernels.raster.bins import TILE_BITS, put, put_in_tiles
from hybrid_rt.kernels.raster.clip import (
    CLIPPED,
    HALF,
    MAX_CORNERS,
    OUT_BOTTOM,
    OUT_LEFT,
    OUT_RIGHT,
    OUT_TOP,
    SUBPIXEL_BITS,
    clip_triangle,
)

LANES = 16
PIECES = MAX_CORNERS - 2
"""Triangles that a clipped one falls into, at most."""
SCRATCH_ROWS = 8


@inlined
def packed(x, y):
    """Return a corner as `clip.transform_vertices` packs it."""
    return np.int64(x) & 0xFFFFFFFF | np.int64(y) << 32


@inlined
def centres(a, b, c, last):
    """Return the first and last pixel, of 0..last, with its centre between three coordinates."""
    low = (simd.minimum(simd.minimum(a, b), c) + (HALF - 1)) >> SUBPIXEL_BITS
    high = (simd.maximum(simd.maximum(a, b), c) - HALF) >> SUBPIXEL_BITS
    return simd.maximum(low, 0), simd.minimum(high, last)


@inlined
def corners_of(v0, v1, v2, live, xy):
    """Return the corners of faces with the vertices v0, v1, v2, y above x in i64."""
    return (
        simd.gather(xy, v0, live, 0),
        simd.gather(xy, v1, live, 0),
        simd.gather(xy, v2, live, 0),
    )


@inlined
def box_of(p, q, r, width, height):
    """Return the pixel boxes (i0, j0, i1, j1) of triangles; empty: i1 < i0 or j1 < j0."""
    i0, i1 = centres(simd.to_i32(p), simd.to_i32(q), simd.to_i32(r), width - 1)
    j0, j1 = centres(simd.to_i32(p >> 32), simd.to_i32(q >> 32), simd.to_i32(r >> 32), height - 1)
    return i0, j0, i1, j1


@inlined
def turned(p, q, r):
    """Return the corners turning so that the inside is positive, and the mask of those with any."""
    x0, y0 = simd.to_i32(p), simd.to_i32(p >> 32)
    ux, uy = simd.to_i32(q) - x0, simd.to_i32(q >> 32) - y0
    vx, vy = simd.to_i32(r) - x0, simd.to_i32(r >> 32) - y0
    # The guard band keeps the products below 2^49: exact in float64.
    area = simd.to_f64(ux) * simd.to_f64(vy) - simd.to_f64(uy) * simd.to_f64(vx)
    turn = area < 0.0
    return p, simd.select(turn, r, q), simd.select(turn, q, r), area != 0.0


@inlined
def small_edge(ax, ay, bx, by):
    """Return 256 E of `bins.edge` at (0, 0), and what it gains to the next pixel in x and in y.

    For edges of a few pixels near (0, 0), in int32.
    """
    a, b = ay - by, bx - ax
    top_left = (a > 0) | (a == 0) & (b > 0)
    return -(a * ax + b * ay) - simd.to_i32(~top_left), a << SUBPIXEL_BITS, b << SUBPIXEL_BITS


@inlined
def covers_any(p, q, r, box):
    """Return the mask of faces that cover a pixel of their box, if it is no larger than 2x2."""
    i0, j0, i1, j1 = box
    left, top = (i0 << SUBPIXEL_BITS) + HALF, (j0 << SUBPIXEL_BITS) + HALF
    x0, y0 = simd.to_i32(p) - left, simd.to_i32(p >> 32) - top
    x1, y1 = simd.to_i32(q) - left, simd.to_i32(q >> 32) - top
    x2, y2 = simd.to_i32(r) - left, simd.to_i32(r >> 32) - top
    wide, high = i1 > i0, j1 > j0
    e0, a0, b0 = small_edge(x0, y0, x1, y1)
    e1, a1, b1 = small_edge(x1, y1, x2, y2)
    e2, a2, b2 = small_edge(x2, y2, x0, y0)
    upper = (e0 | e1 | e2) >= 0
    upper = upper | wide & (((e0 + a0) | (e1 + a1) | (e2 + a2)) >= 0)
    e0, e1, e2 = e0 + b0, e1 + b1, e2 + b2
    lower = (e0 | e1 | e2) >= 0
    lower = lower | wide & (((e0 + a0) | (e1 + a1) | (e2 + a2)) >= 0)
    return upper | high & lower


@inlined
def new_scratch():
    """Return room for the lanes that `put_lanes` takes one by one."""
    return np.empty(3 * LANES, np.int64), np.empty(5 * LANES, np.int32)


@inlined
def lane_of(entries, k):
    """Return the entry of a lane, None if there are none."""
    if entries is None:
        return None
    return entries[k]


@inlined
def put_lanes(some, p, q, r, box, tiles_x, entries, scratch, cursor, bins):
    """Count, or note, faces `some` with their corners and boxes; see `bins.put_in_tiles`.

    entries (LANES,) int64: one for each lane, None to count.
    """
    i0, j0, i1, j1 = box
    corners, boxes = scratch
    u, v = i0 >> TILE_BITS, j0 >> TILE_BITS
    alone = (u == i1 >> TILE_BITS) & (v == j1 >> TILE_BITS)
    simd.store(boxes, 4 * LANES, v * tiles_x + u)
    left = simd.bits(some & alone)
    while left != 0:
        k = simd.lowest(left)
        left &= left - 1
        put(boxes[4 * LANES + k], lane_of(entries, k), cursor, bins)
    left = simd.bits(some & ~alone)
    if left == 0:
        return
    simd.store(corners, 0, p)
    simd.store(corners, LANES, q)
    simd.store(corners, 2 * LANES, r)
    simd.store(boxes, 0, i0)
    simd.store(boxes, LANES, j0)
    simd.store(boxes, 2 * LANES, i1)
    simd.store(boxes, 3 * LANES, j1)
    while left != 0:
        k = simd.lowest(left)
        left &= left - 1
        put_in_tiles(
            corners[k], corners[LANES + k], corners[2 * LANES + k],
            (boxes[k], boxes[LANES + k], boxes[2 * LANES + k], boxes[3 * LANES + k]),
            tiles_x, lane_of(entries, k), cursor, bins,
        )  # fmt: skip


@inlined
def beside(point, width, height):
    """Return the sides of the screen that a vertex lies outside of."""
    x = np.int32(point)
    y = np.int32(point >> 32)
    if x == CLIPPED:
        return np.int64(y)
    across = OUT_LEFT if x < 0 else OUT_RIGHT if x > width << SUBPIXEL_BITS else 0
    down = OUT_TOP if y < 0 else OUT_BOTTOM if y > height << SUBPIXEL_BITS else 0
    return np.int64(across | down)


@inlined
def doubled_area(p, q, r):
    """Return twice the signed area of a snapped triangle (x, y), (x, y), (x, y), sub-pixels."""
    return (np.int64(q[0]) - p[0]) * (np.int64(r[1]) - p[1]) - (np.int64(q[1]) - p[1]) * (
        np.int64(r[0]) - p[0]
    )


@inlined
def new_clip_scratch():
    """Return room for `clipped_pieces`."""
    corners = MAX_CORNERS + 1
    return (
        np.empty((corners, 4), np.float64),
        np.empty((corners, 4), np.float64),
        np.empty((corners, 2), np.int32),
    )


@called
def clipped_pieces(vertices, faces, face, eye, m, width, height, scratch, pieces):
    """Clip a face and cut it into triangles that may cover a pixel; return how many.

    pieces (PIECES, 7) int64 come out: the corners, packed and turning so that the inside is
    positive, and i0, j0, i1, j1 of the pixel box.
    """
    q, spare, corners = scratch
    n = clip_triangle(vertices, faces, face, eye, m, q, spare, corners)
    total = np.int64(0)
    for k in range(1, n - 1):
        total += doubled_area(corners[0], corners[k], corners[k + 1])
    found = 0
    for k in range(1, n - 1):
        a, b, c = corners[0], corners[k], corners[k + 1]
        area = doubled_area(a, b, c)
        # A dent of snapping turns the other way.
        if area == 0 or ((area > 0) != (total > 0) and total != 0):
            continue
        if area < 0:
            b, c = c, b
        i0 = max((min(a[0], b[0], c[0]) + (HALF - 1)) >> SUBPIXEL_BITS, 0)
        i1 = min((max(a[0], b[0], c[0]) - HALF) >> SUBPIXEL_BITS, width - 1)
        j0 = max((min(a[1], b[1], c[1]) + (HALF - 1)) >> SUBPIXEL_BITS, 0)
        j1 = min((max(a[1], b[1], c[1]) - HALF) >> SUBPIXEL_BITS, height - 1)
        if i0 <= i1 and j0 <= j1:
            piece = pieces[found]
            piece[0], piece[1], piece[2] = (
                packed(a[0], a[1]),
                packed(b[0], b[1]),
                packed(c[0], c[1]),
            )
            piece[3], piece[4], piece[5], piece[6] = i0, j0, i1, j1
            found += 1
    return found


@parallel_kernel
def cull_and_count(
    share, vertices, faces, first, last, eye, m, width, height, xy, tiles_x,
    chunk, survivors, n_survivors, n_records, counts,
):  # fmt: skip
    """Find the faces first..last-1 that may cover a pixel, and how many records each tile gets.

    xy: `kernels.raster.clip.transform_vertices`; chunk: faces in a chunk. Out come survivors
    (chunks, chunk + LANES) int32, a row for each chunk with an end that vectors write over, in
    which ~face is a face to be clipped; n_survivors, n_records (chunks,) int32 and counts (chunks,
    tiles) int32.
    """
    scratch = new_scratch()
    clip_scratch = new_clip_scratch()
    pieces = np.empty((PIECES, 7), np.int64)
    c = take(share, 1)
    while c < len(counts):
        count = counts[c]
        count[:] = 0
        begin = first + c * chunk
        end = min(begin + chunk, last)
        kept = survivors[c]
        n_kept = 0
        records = 0
        for at in range(begin, end, LANES):
            live = simd.first(end - at, LANES)
            v0, v1, v2 = simd.load_triples(faces, 3 * at, end - at, LANES)
            p, q, r = corners_of(v0, v1, v2, live, xy)
            clip = simd.to_i32(p) == CLIPPED
            clip = clip | (simd.to_i32(q) == CLIPPED) | (simd.to_i32(r) == CLIPPED)
            clip = clip & live
            box = box_of(p, q, r, width, height)
            i0, j0, i1, j1 = box
            some = live & ~clip & (i0 <= i1) & (j0 <= j1)
            if not simd.any_(some | clip):
                continue
            p, q, r, inside = turned(p, q, r)
            some = some & inside
            small = some & (i1 - i0 <= 1) & (j1 - j0 <= 1)
            if simd.any_(small):
                some = some & (~small | covers_any(p, q, r, box))
            put_lanes(some, p, q, r, box, tiles_x, None, scratch, count, None)
            records += simd.count(some)
            cut = 0
            left = simd.bits(clip)
            while left != 0:
                k = simd.lowest(left)
                left &= left - 1
                face = at + k
                if (
                    beside(xy[faces[face, 0]], width, height)
                    & beside(xy[faces[face, 1]], width, height)
                    & beside(xy[faces[face, 2]], width, height)
                ) != 0:
                    continue
                found = clipped_pieces(
                    vertices, faces, face, eye, m, width, height, clip_scratch, pieces
                )
                for n in range(found):
                    a = pieces[n]
                    put_in_tiles(
                        a[0], a[1], a[2], (a[3], a[4], a[5], a[6]), tiles_x, None, count, None
                    )
                if found > 0:
                    cut |= 1 << k
                    records += found
            clip = simd.mask_of_bits(cut, LANES)
            some = some | clip
            face = simd.iota(LANES) + at
            simd.store(kept, n_kept, simd.compress(simd.select(clip, ~face, face), some))
            n_kept += simd.count(some)
        n_survivors[c] = n_kept
        n_records[c] = records
        c = take(share, 1)
