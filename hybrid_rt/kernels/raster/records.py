"""The second pass of a tiled rasteriser: a record for each triangle, and the bins of them.

Records are in the order of prim_id, so that their numbers can decide ties of depth.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._faces import place_of, vertices_of
from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels._queue import take
from hybrid_rt.kernels._rows import transposed
from hybrid_rt.kernels.raster._order import entry
from hybrid_rt.kernels.raster.bins import put_in_tiles
from hybrid_rt.kernels.raster.cull import (
    PIECES,
    box_of,
    clipped_pieces,
    corners_of,
    new_clip_scratch,
    new_scratch,
    put_lanes,
    turned,
)

LANES = 8
ROW = 8
"""A record is a row of so many int64, a cache line: the three corners, y above x in sub-pixels,
turning so that the inside is positive; the face, and what is below."""
BLOCK = LANES * ROW
FARTHEST, SLOPES = 3, 4
"""The bits in float32 of the depth of the farthest vertex above the face; of ddy above ddx."""
PLANE = 5
"""As float64: depth at the screen's centre, ddx, ddy."""
FACE, SLOPE_X, SLOPE_Y = 6, 8, 9
"""Where the face and the slopes are in the row as int32."""
NOTHING = 0
"""In place of the bits of a nearest depth: the record covers nothing after all."""
LARGEST = float(np.finfo(np.float32).max)
HUGE = 1e300
"""Planes steeper than this would overflow while they are evaluated."""


@inlined
def above(high, low):
    """Return two i32 as one i64."""
    return simd.to_i64(high) << 32 | simd.to_i64(low) & 0xFFFFFFFF


@inlined
def stored(slope):
    """Return the bits of slopes in float32; planes seen edge-on can be steeper than it holds."""
    return simd.bits_i32(simd.to_f32(simd.minimum(simd.maximum(slope, -LARGEST), LARGEST)))


@inlined
def write_records(record, count, face, v0, v1, v2, p, q, r, vertices, eye, frame, near, records):
    """Write the first `count` lanes to consecutive records; return the bits of the nearest depths.

    With n = (b - a) x (c - a) and d = n . (a - eye), the ray eye + z r through a pixel, whose r has
    z_view = 1, meets the plane at z = d / (n . r). So depth = near / z = near (n . r) / d, linear
    in x and y as r is: r = forward + (x - W / 2) right / f - (y - H / 2) up / f. The edges come
    from the float32 vertices before the eye is subtracted, so they are exact in float64, and the
    screen's centre as the reference keeps the sum free of large terms that cancel. The rows of
    `frame` are right / f, -up / f and forward.

    A plane through the eye covers nothing, and has `NOTHING` for its nearest depth.
    """
    live = simd.first(count, LANES)
    ax, ay, az = place_of(vertices, v0, live)
    ux, uy, uz = place_of(vertices, v1, live)
    vx, vy, vz = place_of(vertices, v2, live)
    ux, uy, uz = ux - ax, uy - ay, uz - az
    vx, vy, vz = vx - ax, vy - ay, vz - az
    nx = uy * vz - uz * vy
    ny = uz * vx - ux * vz
    nz = ux * vy - uy * vx
    ax, ay, az = ax - eye[0], ay - eye[1], az - eye[2]
    scale = near / (nx * ax + ny * ay + nz * az)
    ddx = scale * (nx * frame[0, 0] + ny * frame[0, 1] + nz * frame[0, 2])
    ddy = scale * (nx * frame[1, 0] + ny * frame[1, 1] + nz * frame[1, 2])
    centre = scale * (nx * frame[2, 0] + ny * frame[2, 1] + nz * frame[2, 2])
    # False for the NaN and the infinities of a division by zero.
    some = (simd.absolute(centre) < HUGE) & (simd.absolute(ddx) < HUGE)
    some = some & (simd.absolute(ddy) < HUGE)
    za = frame[2, 0] * ax + frame[2, 1] * ay + frame[2, 2] * az
    zb = za + (frame[2, 0] * ux + frame[2, 1] * uy + frame[2, 2] * uz)
    zc = za + (frame[2, 0] * vx + frame[2, 1] * vy + frame[2, 2] * vz)
    farthest = simd.to_f32(near / simd.maximum(simd.maximum(za, zb), zc))
    nearest = simd.to_f32(near / simd.maximum(simd.minimum(simd.minimum(za, zb), zc), near))
    rows = transposed(
        p, q, r, above(simd.bits_i32(farthest), face), above(stored(ddy), stored(ddx)),
        simd.bits_i64(centre), simd.bits_i64(ddx), simd.bits_i64(ddy),
    )  # fmt: skip
    if count >= LANES:
        simd.store(records, record * ROW, rows)
    else:
        simd.store_masked(records, record * ROW, rows, simd.first(count * ROW, BLOCK))
    return simd.select(some, simd.bits_i32(nearest), NOTHING)


@parallel_kernel
def fill_bins(
    share, vertices, faces, eye, m, frame, width, height, near, xy, tiles_x,
    survivors, n_survivors, record_start, cursors, records, bins,
):  # fmt: skip
    """Write the records and the bins that `cull.cull_and_count` has counted.

    records (n * ROW,) int64; bins (entries,) int64, see `hybrid_rt.kernels.raster._order`.
    """
    scratch = new_scratch()
    clip_scratch = new_clip_scratch()
    pieces = np.empty((PIECES, 7), np.int64)
    entries = np.empty(LANES, np.int64)
    c = take(share, 1)
    while c < len(cursors):
        cursor = cursors[c]
        record = np.int64(record_start[c])
        kept, end = survivors[c], n_survivors[c]
        s = 0
        while s < end:
            face = simd.load_masked(kept, s, simd.first(end - s, LANES), -1)
            count = simd.lowest(~simd.bits(face >= 0))
            if count > 0:
                live = simd.first(count, LANES)
                v0, v1, v2 = vertices_of(faces, face, live)
                p, q, r = corners_of(v0, v1, v2, live, xy)
                box = box_of(p, q, r, width, height)
                p, q, r, _ = turned(p, q, r)
                nearest = write_records(
                    record, count, face, v0, v1, v2, p, q, r, vertices, eye, frame, near,
                    records,
                )  # fmt: skip
                numbers = simd.to_i64(simd.iota(LANES)) + record
                simd.store(entries, 0, simd.to_i64(nearest) << 32 | numbers)
                put_lanes(live, p, q, r, box, tiles_x, entries, scratch, cursor, bins)
                record += count
                s += count
                continue
            face = ~kept[s]
            s += 1
            found = clipped_pieces(
                vertices, faces, face, eye, m, near, width, height, clip_scratch, pieces
            )
            for n in range(found):
                a = pieces[n]
                nearest = write_records(
                    record, 1, simd.i32(face, LANES), simd.i32(faces[face, 0], LANES),
                    simd.i32(faces[face, 1], LANES), simd.i32(faces[face, 2], LANES),
                    simd.i64(a[0], LANES), simd.i64(a[1], LANES), simd.i64(a[2], LANES),
                    vertices, eye, frame, near, records,
                )  # fmt: skip
                put_in_tiles(
                    a[0], a[1], a[2], (a[3], a[4], a[5], a[6]), tiles_x,
                    entry(simd.extract(nearest, 0), record), cursor, bins,
                )  # fmt: skip
                record += 1
        c = take(share, 1)
