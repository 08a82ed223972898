"""A tiled rasteriser: cull and count, bin, then fill each tile on its own.

Coverage is decided by integer edge functions of vertices snapped to 1/256 pixel, at pixel centres,
with the top-left rule: two triangles at a shared edge never both cover a centre and never leave one
out. Depth comes from the unsnapped plane (see `plane_of`).

Triangles go through in batches of consecutive faces, a batch in chunks, a chunk on one thread.
Each of `lanes` threads takes chunks and tiles in turn (k, k + lanes ...), which spreads the visible
part of a scene evenly. Every triangle that may cover a pixel gets a *record*; records and bins are
in the order of prim_id, so the strict comparison of depths leaves ties to the smallest.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels.clip import (
    HALF,
    MAX_CORNERS,
    NEEDS_CLIP,
    OUT_SCREEN,
    SUBPIXEL_BITS,
    clip_triangle,
)

TILE_BITS = 5
TILE = 1 << TILE_BITS
"""Pixels along a side of a tile; its keys stay in the L1 cache."""
BLOCK = 16
"""Pixels of a row that are drawn together."""
NARROW = 4
"""The same for triangles that are no wider."""
STRIDE = TILE + BLOCK
"""Keys in a row of a tile; blocks run over its right end."""
OLD = (1 << 29) - 1
"""Rank of what an earlier batch has drawn. Record r has OLD - 1 - r: the smallest wins a tie."""

RECORD_INTS = 7
"""x0 y0 x1 y1 x2 y2 in sub-pixels, turning so that the inside is positive; prim_id."""
RECORD_FLOATS = 5
"""Depth at the screen's centre, ddx, ddy, farthest and nearest depth of the vertices."""

HUGE = 1e300
"""Planes steeper than this would overflow while they are evaluated."""


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
def lowest(a, b, c, i0, j0, i1, j1):
    """Return the smallest value of an edge function over pixels i0..i1, j0..j1."""
    return c + a * (i0 if a > 0 else i1) + b * (j0 if b > 0 else j1)


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
def bin_triangle(x0, y0, x1, y1, x2, y2, i0, j0, i1, j1, tiles_x, record, cursor, bins):
    """Count, or with record >= 0 note, a positive triangle in each tile it may cover.

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
                if record >= 0:
                    bins[cursor[tile]] = record
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
                if record >= 0:
                    bins[cursor[tile]] = record
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
def plane_of(vertices, faces, face, eye, frame, near, out):
    """Write the depth plane of a triangle and the range of its vertices' depths.

    With n = (b - a) x (c - a) and d = n . (a - eye), the ray eye + z r through a pixel, whose r has
    z_view = 1, meets the plane at z = d / (n . r). So depth = near / z = near (n . r) / d, linear
    in x and y as r is: r = forward + (x - W / 2) right / f - (y - H / 2) up / f. The edges come
    from the float32 vertices before the eye is subtracted, so they are exact in float64, and the
    screen's centre as the reference keeps the sum free of large terms that cancel. The rows of
    `frame` are right / f, -up / f and forward.

    A plane through the eye, or a triangle without area, gets NaN: it covers nothing.
    """
    i = faces[face, 0]
    j = faces[face, 1]
    k = faces[face, 2]
    ax = np.float64(vertices[i, 0])
    ay = np.float64(vertices[i, 1])
    az = np.float64(vertices[i, 2])
    ux = np.float64(vertices[j, 0]) - ax
    uy = np.float64(vertices[j, 1]) - ay
    uz = np.float64(vertices[j, 2]) - az
    vx = np.float64(vertices[k, 0]) - ax
    vy = np.float64(vertices[k, 1]) - ay
    vz = np.float64(vertices[k, 2]) - az
    nx = uy * vz - uz * vy
    ny = uz * vx - ux * vz
    nz = ux * vy - uy * vx
    ax -= eye[0]
    ay -= eye[1]
    az -= eye[2]
    # 0 / 0 and 1 / 0 make the NaN that is wanted.
    scale = near / (nx * ax + ny * ay + nz * az)
    ddx = scale * (nx * frame[0, 0] + ny * frame[0, 1] + nz * frame[0, 2])
    ddy = scale * (nx * frame[1, 0] + ny * frame[1, 1] + nz * frame[1, 2])
    centre = scale * (nx * frame[2, 0] + ny * frame[2, 1] + nz * frame[2, 2])
    if not (abs(centre) < HUGE and abs(ddx) < HUGE and abs(ddy) < HUGE):
        centre = np.nan
    za = frame[2, 0] * ax + frame[2, 1] * ay + frame[2, 2] * az
    zb = za + (frame[2, 0] * ux + frame[2, 1] * uy + frame[2, 2] * uz)
    zc = za + (frame[2, 0] * vx + frame[2, 1] * vy + frame[2, 2] * vz)
    out[0] = centre
    out[1] = ddx
    out[2] = ddy
    out[3] = near / max(za, zb, zc)
    out[4] = near / max(min(za, zb, zc), near)


@parallel_kernel
def cull_and_count(
    vertices, faces, first, last, eye, m, width, height, near, xy, out, tiles_x,
    lanes, chunk, survivors, n_survivors, n_records, counts,
):  # fmt: skip
    """Find the faces first..last-1 that may cover a pixel, and how many records each tile gets.

    xy, out: `hybrid_rt.kernels.clip.transform_vertices`; chunk: faces in a chunk. Out come
    survivors (last - first,) int32, for each chunk at its own place (~face for a face that is to be
    clipped), n_survivors, n_records (chunks,) int32 and counts (chunks, tiles) int32.
    """
    for lane in prange(lanes):
        q = np.empty((MAX_CORNERS + 1, 3), np.float64)
        spare = np.empty((MAX_CORNERS + 1, 3), np.float64)
        corners = np.empty((MAX_CORNERS + 1, 2), np.int32)
        no_bins = np.empty(1, np.int32)
        for c in range(lane, len(counts), lanes):
            counts[c, :] = 0
            begin = first + c * chunk
            kept = begin - first
            records = 0
            for face in range(begin, min(begin + chunk, last)):
                v0 = faces[face, 0]
                v1 = faces[face, 1]
                v2 = faces[face, 2]
                o0 = out[v0]
                o1 = out[v1]
                o2 = out[v2]
                if (o0 & o1 & o2 & OUT_SCREEN) != 0:
                    continue
                if ((o0 | o1 | o2) & NEEDS_CLIP) != 0:
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
                                -1, counts[c], no_bins,
                            )  # fmt: skip
                    if found > 0:
                        survivors[kept] = ~face
                        kept += 1
                        records += found
                    continue
                hit, x0, y0, x1, y1, x2, y2, i0, j0, i1, j1 = oriented(
                    xy[v0, 0], xy[v0, 1], xy[v1, 0], xy[v1, 1], xy[v2, 0], xy[v2, 1],
                    0, width, height,
                )  # fmt: skip
                if hit:
                    survivors[kept] = face
                    kept += 1
                    records += 1
                    bin_triangle(
                        x0, y0, x1, y1, x2, y2, i0, j0, i1, j1, tiles_x, -1, counts[c], no_bins
                    )
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
        if hit and i1 - i0 <= 1 and j1 - j0 <= 1:
            hit = covers_any(x0, y0, x1, y1, x2, y2, i0, j0, i1, j1)
    return hit, x0, y0, x1, y1, x2, y2, i0, j0, i1, j1


@inlined
def covers_any(x0, y0, x1, y1, x2, y2, i0, j0, i1, j1):
    """Is one of the (at most four) centres of the box covered."""
    a0, b0, c0 = edge(x0, y0, x1, y1)
    a1, b1, c1 = edge(x1, y1, x2, y2)
    a2, b2, c2 = edge(x2, y2, x0, y0)
    outside = np.int64(-1)
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            e0 = a0 * i + b0 * j + c0
            e1 = a1 * i + b1 * j + c1
            e2 = a2 * i + b2 * j + c2
            outside &= e0 | e1 | e2
    return outside >= 0


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
def write_record(record, x0, y0, x1, y1, x2, y2, face, ints):
    """Fill the integer half of a record."""
    ints[record, 0] = x0
    ints[record, 1] = y0
    ints[record, 2] = x1
    ints[record, 3] = y1
    ints[record, 4] = x2
    ints[record, 5] = y2
    ints[record, 6] = face


@parallel_kernel
def fill_bins(
    vertices, faces, first, eye, m, frame, width, height, near, xy, tiles_x,
    lanes, chunk, survivors, n_survivors, record_start, cursors, ints, floats, bins,
):  # fmt: skip
    """Write the records and the bins that `cull_and_count` has counted.

    ints (records, RECORD_INTS) int32, floats (records, RECORD_FLOATS) float64, bins (entries,)
    int32 of records. `first` is the first face of the batch.
    """
    for lane in prange(lanes):
        q = np.empty((MAX_CORNERS + 1, 3), np.float64)
        spare = np.empty((MAX_CORNERS + 1, 3), np.float64)
        corners = np.empty((MAX_CORNERS + 1, 2), np.int32)
        for c in range(lane, len(cursors), lanes):
            record = record_start[c]
            for s in range(c * chunk, c * chunk + n_survivors[c]):
                face = survivors[s]
                if face < 0:
                    face = ~face
                    n = clip_triangle(vertices, faces, face, eye, m, near, q, spare, corners)
                    sign = fan_sign(corners, n)
                    for k in range(1, n - 1):
                        hit, x0, y0, x1, y1, x2, y2, i0, j0, i1, j1 = oriented(
                            corners[0, 0], corners[0, 1], corners[k, 0], corners[k, 1],
                            corners[k + 1, 0], corners[k + 1, 1], sign, width, height,
                        )  # fmt: skip
                        if hit:
                            write_record(record, x0, y0, x1, y1, x2, y2, face, ints)
                            plane_of(vertices, faces, face, eye, frame, near, floats[record])
                            bin_triangle(
                                x0, y0, x1, y1, x2, y2, i0, j0, i1, j1, tiles_x,
                                record, cursors[c], bins,
                            )  # fmt: skip
                            record += 1
                    continue
                v0 = faces[face, 0]
                v1 = faces[face, 1]
                v2 = faces[face, 2]
                _, x0, y0, x1, y1, x2, y2, i0, j0, i1, j1 = oriented(
                    xy[v0, 0], xy[v0, 1], xy[v1, 0], xy[v1, 1], xy[v2, 0], xy[v2, 1],
                    0, width, height,
                )  # fmt: skip
                write_record(record, x0, y0, x1, y1, x2, y2, face, ints)
                plane_of(vertices, faces, face, eye, frame, near, floats[record])
                bin_triangle(
                    x0, y0, x1, y1, x2, y2, i0, j0, i1, j1, tiles_x, record, cursors[c], bins
                )
                record += 1


@inlined
def tile_edge(ax, ay, bx, by, i0, j0, i1, j1):
    """Return (A, B, value at (i0, j0), is the box outside of the edge) in int32.

    An edge that the whole box is inside of is (0, 0, 0): always passed. Any other straddles the
    box, so its values stay below 46 (|A| + |B|) < 2^31, as the guard band allows.
    """
    a, b, c = edge(ax, ay, bx, by)
    if lowest(a, b, c, i0, j0, i1, j1) >= 0:
        return np.int32(0), np.int32(0), np.int32(0), False
    if highest(a, b, c, i0, j0, i1, j1) < 0:
        return np.int32(0), np.int32(0), np.int32(0), True
    return np.int32(a), np.int32(b), np.int32(c + a * i0 + b * j0), False


@inlined
def pack(depth, rank):
    """Return a float64 that orders by float32 depth first and by rank (< 2^29) then.

    A float32 leaves the 29 low bits of a float64 empty; the rank goes there.
    """
    return np.int64(np.float64(np.float32(depth)).view(np.int64) | rank).view(np.float64)


@inlined
def unpack(key):
    """Return the depth and the rank that `pack` has put together."""
    bits = np.float64(key).view(np.int64)
    return np.float32(np.int64(bits & ~OLD).view(np.float64)), bits & OLD


@inlined
def draw_pixels(n, e0, e1, e2, a0, a1, a2, row, ddx, x, farthest, nearest, rank, keys):
    """Rasterise `n` pixels of a row; `n` is a constant and nothing branches, for LLVM's vectors."""
    for i in range(n):
        k = np.int32(i)
        f0 = np.int32(e0 + a0 * k)
        f1 = np.int32(e1 + a1 * k)
        f2 = np.int32(e2 + a2 * k)
        d = max(min(row + ddx * (np.float64(k) + x), nearest), farthest)
        new = pack(d, rank) if np.int32(f0 | f1 | f2) >= 0 else 0.0
        # Without the sum LLVM makes this a masked store, ten times slower than a plain one on Zen.
        old = keys[i] + 0.0
        keys[i] = old if old > new else new


@inlined
def draw(record, ints, floats, left, top, right, bottom, cx, cy, keys):
    """Rasterise one record into the keys (TILE * STRIDE,) float64 of a tile."""
    x0 = ints[record, 0]
    y0 = ints[record, 1]
    x1 = ints[record, 2]
    y1 = ints[record, 3]
    x2 = ints[record, 4]
    y2 = ints[record, 5]
    i0 = max((min(x0, x1, x2) + (HALF - 1)) >> SUBPIXEL_BITS, left)
    i1 = min((max(x0, x1, x2) - HALF) >> SUBPIXEL_BITS, right)
    j0 = max((min(y0, y1, y2) + (HALF - 1)) >> SUBPIXEL_BITS, top)
    j1 = min((max(y0, y1, y2) - HALF) >> SUBPIXEL_BITS, bottom)
    narrow = i1 - i0 < NARROW
    i1 = i0 + ((i1 - i0) | ((NARROW if narrow else BLOCK) - 1))
    a0, b0, e0, out0 = tile_edge(x0, y0, x1, y1, i0, j0, i1, j1)
    a1, b1, e1, out1 = tile_edge(x1, y1, x2, y2, i0, j0, i1, j1)
    a2, b2, e2, out2 = tile_edge(x2, y2, x0, y0, i0, j0, i1, j1)
    centre = floats[record, 0]
    if out0 or out1 or out2 or np.isnan(centre):
        return
    ddx = floats[record, 1]
    ddy = floats[record, 2]
    farthest = floats[record, 3]
    nearest = floats[record, 4]
    rank = OLD - 1 - record
    x = i0 + 0.5 - cx
    if narrow:
        for j in range(j1 - j0 + 1):
            start = (j0 - top + j) * STRIDE + (i0 - left)
            draw_pixels(
                NARROW, np.int32(e0 + b0 * j), np.int32(e1 + b1 * j), np.int32(e2 + b2 * j),
                a0, a1, a2, centre + ddy * ((j0 + j) + 0.5 - cy), ddx, x, farthest, nearest, rank,
                keys[start : start + NARROW],
            )  # fmt: skip
        return
    # What an edge gains at most and at least over a block.
    most0 = np.int32(max(a0, 0) * (BLOCK - 1))
    most1 = np.int32(max(a1, 0) * (BLOCK - 1))
    most2 = np.int32(max(a2, 0) * (BLOCK - 1))
    least0 = np.int32(min(a0, 0) * (BLOCK - 1))
    least1 = np.int32(min(a1, 0) * (BLOCK - 1))
    least2 = np.int32(min(a2, 0) * (BLOCK - 1))
    # Column by column: what a block is, empty, full or mixed, changes seldom on the way down.
    for i in range(0, i1 - i0 + 1, BLOCK):
        for j in range(j1 - j0 + 1):
            f0 = np.int32(e0 + a0 * i + b0 * j)
            f1 = np.int32(e1 + a1 * i + b1 * j)
            f2 = np.int32(e2 + a2 * i + b2 * j)
            if (np.int32(f0 + most0) | np.int32(f1 + most1) | np.int32(f2 + most2)) < 0:
                continue
            row = centre + ddy * ((j0 + j) + 0.5 - cy)
            start = (j0 - top + j) * STRIDE + (i0 - left) + i
            block = keys[start : start + BLOCK]
            if (np.int32(f0 + least0) | np.int32(f1 + least1) | np.int32(f2 + least2)) >= 0:
                zero = np.int32(0)
                draw_pixels(
                    BLOCK, zero, zero, zero, zero, zero, zero,
                    row, ddx, x + i, farthest, nearest, rank, block,
                )  # fmt: skip
            else:
                draw_pixels(
                    BLOCK, f0, f1, f2, a0, a1, a2,
                    row, ddx, x + i, farthest, nearest, rank, block,
                )  # fmt: skip


@parallel_kernel
def draw_tiles(tile_start, bins, ints, floats, tiles_x, cx, cy, lanes, depth, ddx, ddy, prim_id):
    """Draw every bin over what the images (H, W) already hold; (cx, cy) is the screen's centre."""
    height, width = depth.shape
    tiles = len(tile_start) - 1
    largest = np.float64(np.finfo(np.float32).max)
    for lane in prange(lanes):
        keys = np.empty(TILE * STRIDE, np.float64)
        for tile in range(lane, tiles, lanes):
            if tile_start[tile] == tile_start[tile + 1]:
                continue
            left = (tile % tiles_x) << TILE_BITS
            top = (tile // tiles_x) << TILE_BITS
            right = min(left + TILE, width) - 1
            bottom = min(top + TILE, height) - 1
            keys[:] = 0.0
            for j in range(bottom - top + 1):
                for i in range(right - left + 1):
                    old = depth[top + j, left + i]
                    if old > 0.0:
                        keys[j * STRIDE + i] = pack(old, OLD)
            for at in range(tile_start[tile], tile_start[tile + 1]):
                draw(bins[at], ints, floats, left, top, right, bottom, cx, cy, keys)
            for j in range(bottom - top + 1):
                for i in range(right - left + 1):
                    new, rank = unpack(keys[j * STRIDE + i])
                    if new > 0.0 and rank != OLD:
                        record = OLD - 1 - rank
                        depth[top + j, left + i] = new
                        prim_id[top + j, left + i] = ints[record, 6]
                        # The plane of a triangle seen edge-on can be steeper than float32 holds.
                        ddx[top + j, left + i] = min(max(floats[record, 1], -largest), largest)
                        ddy[top + j, left + i] = min(max(floats[record, 2], -largest), largest)


@parallel_kernel
def quad_differences(depth, ddx, ddy):
    """Replace ddx, ddy (H, W) by differences of depth within aligned quads of 2x2 pixels."""
    height, width = depth.shape
    for j in prange(height):
        # The last row of an odd height pairs with the one before it.
        j0 = min(j & ~1, max(height - 2, 0))
        j1 = min(j0 + 1, height - 1)
        for i in range(width):
            i0 = min(i & ~1, max(width - 2, 0))
            i1 = min(i0 + 1, width - 1)
            ddx[j, i] = depth[j, i1] - depth[j, i0]
            ddy[j, i] = depth[j1, i] - depth[j0, i]
