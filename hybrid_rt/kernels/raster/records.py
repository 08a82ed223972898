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
from hybrid_rt.kernels.raster.clip import mapped
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
def depth_of(w, d):
    """Return depths d / w of vertices, 1 for those that are not in front of the near plane."""
    return simd.select(w > d, d / w, 1.0)


@inlined
def write_records(
    record, count, face, v0, v1, v2, p, q, r, vertices, eye, m, frame, sigma, records
):  # fmt: skip
    """Write the first `count` lanes to consecutive records; return the bits of the nearest depths.

    With n = (b - a) x (c - a) and k = n . (a - eye), the plane holds the homogeneous points P,
    relative to the eye, with n . P_xyz = k P_w. The point of the screen x, y from its middle, at a
    depth, is P = sigma (x X + y Y + W) + depth D, with the rows of `frame` (`kernels.arrays`), so

        depth (k D_w - n . D) = sigma (x n . X + y n . Y + n . W - k W_w),

    linear in x and y. Of a pinhole D = (0, 0, 0, 1), and W is the view through the screen's middle:
    depth = near (n . r) / k for the view r through the pixel. The edges come from the float32
    vertices before the eye is subtracted, so they are exact in float64, and the screen's middle as
    the reference keeps the sum free of large terms that cancel.

    A plane that is seen edge-on all over covers nothing, and has `NOTHING` for its nearest depth.
    So has, as a negative number, what lies beyond the far plane.
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
    k = nx * ax + ny * ay + nz * az
    scale = sigma / (k * frame[3, 3] - mapped(frame, 3, nx, ny, nz))
    ddx = scale * mapped(frame, 0, nx, ny, nz)
    ddy = scale * mapped(frame, 1, nx, ny, nz)
    centre = scale * (mapped(frame, 2, nx, ny, nz) - k * frame[2, 3])
    # False for the NaN and the infinities of a division by zero.
    some = (simd.absolute(centre) < HUGE) & (simd.absolute(ddx) < HUGE)
    some = some & (simd.absolute(ddy) < HUGE)
    wa, da = mapped(m, 2, ax, ay, az) + m[2, 3], mapped(m, 3, ax, ay, az) + m[3, 3]
    zb = depth_of(wa + mapped(m, 2, ux, uy, uz), da + mapped(m, 3, ux, uy, uz))
    zc = depth_of(wa + mapped(m, 2, vx, vy, vz), da + mapped(m, 3, vx, vy, vz))
    za = depth_of(wa, da)
    farthest = simd.to_f32(simd.minimum(simd.minimum(za, zb), zc))
    nearest = simd.to_f32(simd.maximum(simd.maximum(za, zb), zc))
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
    share, vertices, faces, eye, m, frame, sigma, width, height, xy, tiles_x,
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
                    record, count, face, v0, v1, v2, p, q, r, vertices, eye, m, frame, sigma,
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
                vertices, faces, face, eye, m, width, height, clip_scratch, pieces
            )
            for n in range(found):
                a = pieces[n]
                nearest = write_records(
                    record, 1, simd.i32(face, LANES), simd.i32(faces[face, 0], LANES),
                    simd.i32(faces[face, 1], LANES), simd.i32(faces[face, 2], LANES),
                    simd.i64(a[0], LANES), simd.i64(a[1], LANES), simd.i64(a[2], LANES),
                    vertices, eye, m, frame, sigma, records,
                )  # fmt: skip
                put_in_tiles(
                    a[0], a[1], a[2], (a[3], a[4], a[5], a[6]), tiles_x,
                    entry(simd.extract(nearest, 0), record), cursor, bins,
                )  # fmt: skip
                record += 1
        c = take(share, 1)
