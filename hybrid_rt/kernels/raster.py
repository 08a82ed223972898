"""The first half of a tiled rasteriser: cull and count, then write records and bins.

Coverage is decided by integer edge functions of vertices snapped to 1/256 pixel, at pixel centres,
with the top-left rule: two triangles at a shared edge never both cover a centre and never leave one
out. Depth comes from the unsnapped plane (see `write_planes`).

Triangles go through in batches of consecutive faces, a batch in chunks, a chunk on one thread,
LANES faces at a time. Each of `workers` threads takes chunks in turn (k, k + workers ...), which
spreads the visible part of a scene evenly. Every triangle that may cover a pixel gets a *record*;
records are in the order of prim_id, so that their numbers can decide ties of depth.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._order import entry
from hybrid_rt.kernels.clip import (
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

TILE_BITS = 5
TILE = 1 << TILE_BITS
"""Pixels along a side of a tile; they stay in the L1 cache (see `hybrid_rt.kernels.tiles`)."""
RECORD_INTS, RECORD_FLOATS = 16, 8
"""A record is 64 bytes, read as int32 or as float64."""
FACE, FARTHEST, SLOPE_X, SLOPE_Y = 6, 7, 8, 9
"""Of int32, behind x0 y0 x1 y1 x2 y2 in sub-pixels, turning so that the inside is positive:
prim_id, and the bits in float32 of the depth of the farthest vertex, of ddx and of ddy."""
PLANE = 5
"""Of float64: depth at the screen's centre, ddx, ddy."""
NOTHING = 0
"""In place of the bits of a nearest depth: the record covers nothing after all."""
LARGEST = float(np.finfo(np.float32).max)
HUGE = 1e300
"""Planes steeper than this would overflow while they are evaluated."""
LANES, PLANE_LANES = 16, 8
"""Faces that are culled together, and whose planes are made together."""
SCREEN_ROWS = 10


@inlined
def edge(ax, ay, bx, by):
    """Return (A, B, C): pixel (i, j) is inside the edge a -> b if A i + B j + C >= 0.

    The edge function at a pixel's centre is E = C' + 256 (A i + B j), one less on an edge that is
    not top or left; so E >= 0 exactly where floor(E / 256) >= 0, which needs eight bits less.
    """
    a = np.int64(ay) - np.int64(by)
    b = np.int64(bx) - np.int64(ax)
    top_left = a > 0 or (a == 0 and b > 0)
    c = a * (HALF - np.int64(ax)) + b * (HALF - np.int64(ay)) - (0 if top_left else 1)
    return a, b, c >> SUBPIXEL_BITS


@inlined
def highest(a, b, c, i0, j0, i1, j1):
    """Return the largest value of an edge function over pixels i0..i1, j0..j1."""
    return c + a * (i1 if a > 0 else i0) + b * (j1 if b > 0 else j0)


@inlined
def doubled_area(x0, y0, x1, y1, x2, y2):
    """Return twice the signed area of a snapped triangle in square sub-pixels."""
    return (np.int64(x1) - x0) * (np.int64(y2) - y0) - (np.int64(y1) - y0) * (np.int64(x2) - x0)


@inlined
def pixel_box(x0, y0, x1, y1, x2, y2, width, height):
    """Return the first and last column and row whose centres the bounding box holds."""
    i0 = max((min(x0, x1, x2) + (HALF - 1)) >> SUBPIXEL_BITS, 0)
    i1 = min((max(x0, x1, x2) - HALF) >> SUBPIXEL_BITS, width - 1)
    j0 = max((min(y0, y1, y2) + (HALF - 1)) >> SUBPIXEL_BITS, 0)
    j1 = min((max(y0, y1, y2) - HALF) >> SUBPIXEL_BITS, height - 1)
    return i0, j0, i1, j1


@inlined
def bin_triangle(x0, y0, x1, y1, x2, y2, i0, j0, i1, j1, tiles_x, entry, cursor, bins):
    """Count, or with entry >= 0 note, a positive triangle in each tile it may cover.

    `cursor` (tiles,) int32 is advanced; the same tiles are found in both passes.
    """
    u0 = i0 >> TILE_BITS
    v0 = j0 >> TILE_BITS
    u1 = i1 >> TILE_BITS
    v1 = j1 >> TILE_BITS
    if u0 == u1 or v0 == v1:  # a strip of tiles is crossed by the triangle almost everywhere
        for v in range(v0, v1 + 1):
            for u in range(u0, u1 + 1):
                tile = v * tiles_x + u
                if entry >= 0:
                    bins[cursor[tile]] = entry
                cursor[tile] += 1
        return
    a0, b0, c0 = edge(x0, y0, x1, y1)
    a1, b1, c1 = edge(x1, y1, x2, y2)
    a2, b2, c2 = edge(x2, y2, x0, y0)
    for v in range(v0, v1 + 1):
        jl = max(v << TILE_BITS, j0)
        jh = min((v << TILE_BITS) + TILE - 1, j1)
        for u in range(u0, u1 + 1):
            il = max(u << TILE_BITS, i0)
            ih = min((u << TILE_BITS) + TILE - 1, i1)
            if (
                highest(a0, b0, c0, il, jl, ih, jh) >= 0
                and highest(a1, b1, c1, il, jl, ih, jh) >= 0
                and highest(a2, b2, c2, il, jl, ih, jh) >= 0
            ):
                tile = v * tiles_x + u
                if entry >= 0:
                    bins[cursor[tile]] = entry
                cursor[tile] += 1


@inlined
def fan_sign(corners, n):
    """Return the sign of the area of a snapped polygon."""
    area = np.int64(0)
    for k in range(1, n - 1):
        area += doubled_area(
            corners[0, 0],
            corners[0, 1],
            corners[k, 0],
            corners[k, 1],
            corners[k + 1, 0],
            corners[k + 1, 1],
        )
    return np.sign(area)


@inlined
def vertices_of(face, live, faces):
    """Return the numbers of the vertices of faces."""
    at = face * 3
    return (
        simd.gather(faces, at, live, 0),
        simd.gather(faces, at + 1, live, 0),
        simd.gather(faces, at + 2, live, 0),
    )


@inlined
def vertex(vertices, v, live):
    """Return the coordinates of vertices in float64."""
    at = v * 3
    return (
        simd.to_f64(simd.gather(vertices, at, live, 0.0)),
        simd.to_f64(simd.gather(vertices, at + 1, live, 0.0)),
        simd.to_f64(simd.gather(vertices, at + 2, live, 0.0)),
    )


@inlined
def stored(slope):
    """Return the bits of slopes in float32; planes seen edge-on can be steeper than it holds."""
    return simd.bits_i32(simd.to_f32(simd.minimum(simd.maximum(slope, -LARGEST), LARGEST)))


@inlined
def write_planes(vertices, faces, face, live, record, eye, frame, near, ints, planes):
    """Write the depth planes of faces to their records; return the bits of the nearest depths.

    With n = (b - a) x (c - a) and d = n . (a - eye), the ray eye + z r through a pixel, whose r has
    z_view = 1, meets the plane at z = d / (n . r). So depth = near / z = near (n . r) / d, linear
    in x and y as r is: r = forward + (x - W / 2) right / f - (y - H / 2) up / f. The edges come
    from the float32 vertices before the eye is subtracted, so they are exact in float64, and the
    screen's centre as the reference keeps the sum free of large terms that cancel. The rows of
    `frame` are right / f, -up / f and forward.

    A plane through the eye covers nothing, and has `NOTHING` for its nearest depth.
    """
    v0, v1, v2 = vertices_of(face, live, faces)
    ax, ay, az = vertex(vertices, v0, live)
    ux, uy, uz = vertex(vertices, v1, live)
    vx, vy, vz = vertex(vertices, v2, live)
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
    nearest = simd.select(some, simd.bits_i32(nearest), NOTHING)
    at = record * RECORD_FLOATS + PLANE
    simd.scatter(planes, at, centre, live)
    simd.scatter(planes, at + 1, ddx, live)
    simd.scatter(planes, at + 2, ddy, live)
    at = record * RECORD_INTS
    simd.scatter(ints, at + FACE, face, live)
    simd.scatter(ints, at + FARTHEST, simd.bits_i32(farthest), live)
    simd.scatter(ints, at + SLOPE_X, stored(ddx), live)
    simd.scatter(ints, at + SLOPE_Y, stored(ddy), live)
    return nearest


@inlined
def centres(a, b, c, last):
    """Return the first and last pixel, of 0..last, with its centre between three coordinates."""
    low = (simd.minimum(simd.minimum(a, b), c) + (HALF - 1)) >> SUBPIXEL_BITS
    high = (simd.maximum(simd.maximum(a, b), c) - HALF) >> SUBPIXEL_BITS
    return simd.maximum(low, 0), simd.minimum(high, last)


@inlined
def to_screen(v0, v1, v2, live, xy, width, height, screen):
    """Project faces; return the bits of those that may cover a pixel and of those to be clipped.

    v0, v1, v2: their vertices. The rows of screen (SCREEN_ROWS * LANES,) int32 are filled, a lane
    for each face: the corners, turning so that the inside is positive, and the pixel box.
    """
    p0 = simd.gather(xy, v0, live, 0)
    p1 = simd.gather(xy, v1, live, 0)
    p2 = simd.gather(xy, v2, live, 0)
    x0, y0 = simd.to_i32(p0), simd.to_i32(p0 >> 32)
    x1, y1 = simd.to_i32(p1), simd.to_i32(p1 >> 32)
    x2, y2 = simd.to_i32(p2), simd.to_i32(p2 >> 32)
    clip = (x0 == CLIPPED) | (x1 == CLIPPED) | (x2 == CLIPPED)
    i0, i1 = centres(x0, x1, x2, width - 1)
    j0, j1 = centres(y0, y1, y2, height - 1)
    # The guard band keeps the products below 2^49: exact in float64.
    area = simd.to_f64(x1 - x0) * simd.to_f64(y2 - y0) - simd.to_f64(y1 - y0) * simd.to_f64(x2 - x0)
    some = live & ~clip & (i0 <= i1) & (j0 <= j1) & (area != 0.0)
    turned = area < 0.0
    x1, x2 = simd.select(turned, x2, x1), simd.select(turned, x1, x2)
    y1, y2 = simd.select(turned, y2, y1), simd.select(turned, y1, y2)
    wide, high = i1 - i0, j1 - j0
    small = (wide <= 1) & (high <= 1)
    if simd.any_(some & small):
        left, top = (i0 << SUBPIXEL_BITS) + HALF, (j0 << SUBPIXEL_BITS) + HALF
        some = some & (
            ~small
            | covers_any(
                x0 - left, y0 - top, x1 - left, y1 - top, x2 - left, y2 - top, wide > 0, high > 0
            )
        )
    simd.store(screen, 0, x0)
    simd.store(screen, LANES, y0)
    simd.store(screen, 2 * LANES, x1)
    simd.store(screen, 3 * LANES, y1)
    simd.store(screen, 4 * LANES, x2)
    simd.store(screen, 5 * LANES, y2)
    simd.store(screen, 6 * LANES, i0)
    simd.store(screen, 7 * LANES, j0)
    simd.store(screen, 8 * LANES, i1)
    simd.store(screen, 9 * LANES, j1)
    return simd.bits(some), simd.bits(live & clip)


@inlined
def small_edge(ax, ay, bx, by):
    """Return 256 E of `edge` at (0, 0), and what it gains to the next pixel in x and in y.

    For edges of a few pixels near (0, 0), in int32.
    """
    a, b = ay - by, bx - ax
    top_left = (a > 0) | (a == 0) & (b > 0)
    return -(a * ax + b * ay) - simd.to_i32(~top_left), a << SUBPIXEL_BITS, b << SUBPIXEL_BITS


@inlined
def covers_any(x0, y0, x1, y1, x2, y2, wide, high):
    """Is a centre of the box covered: (0, 0), with `wide` the one beside it, with `high` below."""
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
def bin_lane(lane, screen, tiles_x, entry, cursor, bins):
    """Count, or with entry >= 0 note, a face that `to_screen` has seen."""
    bin_triangle(
        screen[lane], screen[LANES + lane], screen[2 * LANES + lane],
        screen[3 * LANES + lane], screen[4 * LANES + lane], screen[5 * LANES + lane],
        screen[6 * LANES + lane], screen[7 * LANES + lane], screen[8 * LANES + lane],
        screen[9 * LANES + lane], tiles_x, entry, cursor, bins,
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


@parallel_kernel
def cull_and_count(
    vertices, faces, first, last, eye, m, width, height, near, xy, tiles_x,
    workers, chunk, survivors, n_survivors, n_records, counts,
):  # fmt: skip
    """Find the faces first..last-1 that may cover a pixel, and how many records each tile gets.

    xy: `hybrid_rt.kernels.clip.transform_vertices`; chunk: faces in a chunk. Out come survivors
    (last - first,) int32, for each chunk at its own place (~face for a face that is to be clipped),
    n_survivors, n_records (chunks,) int32 and counts (chunks, tiles) int32.
    """
    for worker in prange(workers):
        q = np.empty((MAX_CORNERS + 1, 3), np.float64)
        spare = np.empty((MAX_CORNERS + 1, 3), np.float64)
        corners = np.empty((MAX_CORNERS + 1, 2), np.int32)
        no_bins = np.empty(1, np.int64)
        screen = np.empty(SCREEN_ROWS * LANES, np.int32)
        for c in range(worker, len(counts), workers):
            count = counts[c]
            count[:] = 0
            begin = first + c * chunk
            end = min(begin + chunk, last)
            kept = begin - first
            records = 0
            for at in range(begin, end, LANES):
                v0, v1, v2 = simd.load_triples(faces, 3 * at, end - at, LANES)
                seen, clip = to_screen(
                    v0, v1, v2, simd.first(end - at, LANES), xy, width, height, screen
                )
                some = seen | clip
                while some != 0:
                    k = simd.lowest(some)
                    some &= some - 1
                    face = at + k
                    if (seen >> k) & 1 != 0:
                        survivors[kept] = face
                        kept += 1
                        records += 1
                        bin_lane(k, screen, tiles_x, -1, count, no_bins)
                        continue
                    if (
                        beside(xy[faces[face, 0]], width, height)
                        & beside(xy[faces[face, 1]], width, height)
                        & beside(xy[faces[face, 2]], width, height)
                    ) != 0:
                        continue
                    n = clip_triangle(vertices, faces, face, eye, m, near, q, spare, corners)
                    sign = fan_sign(corners, n)
                    found = 0
                    for k in range(1, n - 1):
                        hit, x0, y0, x1, y1, x2, y2, i0, j0, i1, j1 = oriented(
                            corners[0, 0], corners[0, 1], corners[k, 0], corners[k, 1],
                            corners[k + 1, 0], corners[k + 1, 1], sign, width, height,
                        )  # fmt: skip
                        if hit:
                            found += 1
                            bin_triangle(
                                x0, y0, x1, y1, x2, y2, i0, j0, i1, j1, tiles_x,
                                -1, count, no_bins,
                            )  # fmt: skip
                    if found > 0:
                        survivors[kept] = ~face
                        kept += 1
                        records += found
            n_survivors[c] = kept - (begin - first)
            n_records[c] = records


@inlined
def oriented(x0, y0, x1, y1, x2, y2, sign, width, height):
    """Return (may it cover a pixel, the corners turned to a positive area, the pixel box).

    With a sign, triangles of the other sign are refused.
    """
    i0, j0, i1, j1 = pixel_box(x0, y0, x1, y1, x2, y2, width, height)
    hit = i0 <= i1 and j0 <= j1
    if hit:
        area = doubled_area(x0, y0, x1, y1, x2, y2)
        hit = area != 0 and not (sign > 0 and area < 0) and not (sign < 0 and area > 0)
        if area < 0:
            x1, y1, x2, y2 = x2, y2, x1, y1
    return hit, x0, y0, x1, y1, x2, y2, i0, j0, i1, j1


@kernel
def prefix_sums(n_records, counts, record_start, tile_start):
    """Turn counts into places: where a chunk's records and a chunk's part of a bin begin.

    counts (chunks, tiles) int32 becomes the cursors; record_start (chunks + 1,) and tile_start
    (tiles + 1,) int32 come out.
    """
    chunks, tiles = counts.shape
    total = np.int32(0)
    for c in range(chunks):
        record_start[c] = total
        total += n_records[c]
    record_start[chunks] = total
    tile_start[:] = 0
    for c in range(chunks):
        for t in range(tiles):
            tile_start[t + 1] += counts[c, t]
    for t in range(tiles):
        tile_start[t + 1] += tile_start[t]
    run = tile_start.copy()
    for c in range(chunks):
        for t in range(tiles):
            n = counts[c, t]
            counts[c, t] = run[t]
            run[t] += n


@inlined
def write_corners(record, x0, y0, x1, y1, x2, y2, ints):
    """Fill the corners of a record."""
    ints[record, 0] = x0
    ints[record, 1] = y0
    ints[record, 2] = x1
    ints[record, 3] = y1
    ints[record, 4] = x2
    ints[record, 5] = y2


@inlined
def write_records(
    chosen, places, count, vertices, faces, eye, frame, near, ints, planes, nearest
):  # fmt: skip
    """Write all of the records but their corners: faces `chosen` to `places`, (LANES,) int32.

    nearest (LANES,) int32 comes out: the bits of the depths of the nearest vertices.
    """
    for k in range(0, LANES, PLANE_LANES):
        found = write_planes(
            vertices, faces, simd.load(chosen, k, PLANE_LANES), simd.first(count - k, PLANE_LANES),
            simd.load(places, k, PLANE_LANES), eye, frame, near, ints, planes,
        )  # fmt: skip
        simd.store(nearest, k, found)


@parallel_kernel
def fill_bins(
    vertices, faces, first, eye, m, frame, width, height, near, xy, tiles_x,
    workers, chunk, survivors, n_survivors, record_start, cursors, ints, planes, bins,
):  # fmt: skip
    """Write the records and the bins that `cull_and_count` has counted.

    ints (records, RECORD_INTS) int32, planes the same as float64, bins (entries,) int64, see
    `hybrid_rt.kernels._order`. `first` is the first face of the batch.
    """
    for worker in prange(workers):
        q = np.empty((MAX_CORNERS + 1, 3), np.float64)
        spare = np.empty((MAX_CORNERS + 1, 3), np.float64)
        corners = np.empty((MAX_CORNERS + 1, 2), np.int32)
        screen = np.empty(SCREEN_ROWS * LANES, np.int32)
        chosen = np.zeros(LANES, np.int32)
        places = np.zeros(LANES, np.int32)
        nearest = np.zeros(LANES, np.int32)
        for c in range(worker, len(cursors), workers):
            cursor = cursors[c]
            record = record_start[c]
            s = c * chunk
            end = s + n_survivors[c]
            while s < end:
                count = 0
                while s < end and count < LANES and survivors[s] >= 0:
                    chosen[count] = survivors[s]
                    places[count] = record
                    record += 1
                    count += 1
                    s += 1
                if count > 0:
                    live = simd.first(count, LANES)
                    v0, v1, v2 = vertices_of(simd.load(chosen, 0, LANES), live, faces)
                    to_screen(v0, v1, v2, live, xy, width, height, screen)
                    write_records(
                        chosen, places, count, vertices, faces, eye, frame, near, ints, planes,
                        nearest,
                    )  # fmt: skip
                    for k in range(count):
                        place = places[k]
                        write_corners(
                            place, screen[k], screen[LANES + k], screen[2 * LANES + k],
                            screen[3 * LANES + k], screen[4 * LANES + k],
                            screen[5 * LANES + k], ints,
                        )  # fmt: skip
                        bin_lane(k, screen, tiles_x, entry(nearest[k], place), cursor, bins)
                    continue
                face = ~survivors[s]
                s += 1
                n = clip_triangle(vertices, faces, face, eye, m, near, q, spare, corners)
                sign = fan_sign(corners, n)
                for k in range(1, n - 1):
                    hit, x0, y0, x1, y1, x2, y2, i0, j0, i1, j1 = oriented(
                        corners[0, 0], corners[0, 1], corners[k, 0], corners[k, 1],
                        corners[k + 1, 0], corners[k + 1, 1], sign, width, height,
                    )  # fmt: skip
                    if hit:
                        chosen[0] = face
                        places[0] = record
                        write_records(
                            chosen, places, 1, vertices, faces, eye, frame, near, ints, planes,
                            nearest,
                        )  # fmt: skip
                        write_corners(record, x0, y0, x1, y1, x2, y2, ints)
                        bin_triangle(
                            x0, y0, x1, y1, x2, y2, i0, j0, i1, j1, tiles_x,
                            entry(nearest[0], record), cursor, bins,
                        )  # fmt: skip
                        record += 1
