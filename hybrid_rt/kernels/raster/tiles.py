"""The second half of a tiled rasteriser: draw the bin of each tile, on its own and on one thread.

The nearest record has a pixel, and among equals the first, so the order of drawing does not matter.
Records are set up LANES at a time, which finds in which rows they can be seen. Then they are drawn
one after the other, a vector of pixels at a time and without a branch on what is covered: guessing
wrong costs more than a vector.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._aligned import aligned
from hybrid_rt.kernels._borrow import borrowed, keep
from hybrid_rt.kernels._jit import inlined, inlined_by_value, parallel_kernel
from hybrid_rt.kernels._queue import part, take
from hybrid_rt.kernels.raster._order import BUCKETS, near_first
from hybrid_rt.kernels.raster.bins import TILE, TILE_BITS
from hybrid_rt.kernels.raster.clip import HALF, ONE, SUBPIXEL_BITS
from hybrid_rt.kernels.raster.cull import LANES, centres
from hybrid_rt.kernels.raster.records import FACE, FARTHEST, NOTHING, PLANE, ROW, SLOPE_X, SLOPE_Y

NARROW = 8
"""Records no wider than this are drawn so many pixels at a time, others LANES, an aligned half of a
tile's row."""
STRIDE = TILE + LANES
"""Pixels in a row of a tile; narrow records run over its right end."""

HALVES, STRIP = 2, 8
STRIPS = TILE // STRIP
"""A tile is cut in blocks, aligned halves of STRIP rows, whose farthest depths are known."""

NOBODY = -1
"""Owner of a pixel that shows nothing yet, or what an earlier batch has drawn."""
COLUMN, FIRST, LAST, EDGE_A, EDGE_B, EDGE_C, SETUP_ROWS = 0, 1, 3, 5, 8, 11, 14
"""What a set-up makes of records, a lane each: the first column of narrow ones, `WIDE` of others;
the first and the last row to be drawn, of narrow ones or of each half; the three edges, as
functions of a pixel of the tile in integers that wrap around."""
WIDE = -1


@inlined
def tile_edge(ax, ay, bx, by, i0, j0, i1, j1):
    """Return A, B, C of edges a -> b in int32, and the mask of those with their boxes outside.

    Pixel (i, j) is inside where A i + B j + C >= 0, as in `bins.edge`; coordinates are float64,
    which holds all products: they are less than 2^50. An edge that its whole box is inside of is
    (0, 0, 0): always passed. Any other straddles the box, so its values in the tile stay below
    39 (|A| + |B|) < 2^31, as the guard band allows; that C wraps around does not matter.
    """
    a, b = ay - by, bx - ax
    top_left = (a > 0.0) | (a == 0.0) & (b > 0.0)
    c = a * (HALF - ax) + b * (HALF - ay) - simd.to_f64(~top_left)
    c = simd.floor(c * (1.0 / ONE))
    left, right, top, bottom = a * i0, a * i1, b * j0, b * j1
    inside = c + simd.minimum(left, right) + simd.minimum(top, bottom) >= 0.0
    outside = c + simd.maximum(left, right) + simd.maximum(top, bottom) < 0.0
    zero = simd.i32(0, LANES)
    return (
        simd.select(inside, zero, simd.to_i32(a)),
        simd.select(inside, zero, simd.to_i32(b)),
        simd.select(inside, zero, simd.to_i32(simd.to_i64(c))),
        outside,
    )


@inlined
def highest_of(a, b, c, left, right):
    """Return the highest value of edges in columns left..right of the first strip of a tile."""
    return c + simd.maximum(a * left, a * right) + simd.maximum(b * np.int32(STRIP - 1), 0)


@inlined
def rows_of(e0, e1, e2, left, right, j0, j1, nearest, farthest, taken0, taken1):
    """Return the first and the last row, of j0..j1, in the strips that records may be seen in.

    e0, e1, e2: their edges; left, right: columns; taken0, taken1: whether these are in the left and
    the right half, of whose strips `farthest` has the depths.
    """
    m0 = highest_of(e0[0], e0[1], e0[2], left, right)
    m1 = highest_of(e1[0], e1[1], e1[2], left, right)
    m2 = highest_of(e2[0], e2[1], e2[2], left, right)
    step0, step1, step2 = e0[1] * np.int32(STRIP), e1[1] * np.int32(STRIP), e2[1] * np.int32(STRIP)
    first, last = simd.i32(TILE, LANES), simd.i32(-1, LANES)
    for strip in range(STRIPS):
        top = np.int32(strip * STRIP)
        bottom = np.int32(top + (STRIP - 1))
        seen = (taken0 & (nearest >= farthest[strip])) | (
            taken1 & (nearest >= farthest[STRIPS + strip])
        )
        seen = seen & ((m0 | m1 | m2) >= 0) & (j0 <= bottom) & (j1 >= top)
        first = simd.select(seen, simd.minimum(first, simd.maximum(j0, top)), first)
        last = simd.select(seen, simd.minimum(j1, bottom), last)
        m0, m1, m2 = m0 + step0, m1 + step1, m2 + step2
    return first, last


@inlined
def corner(number, k, records, live, left, top):
    """Return x and y of corner k of records, in sub-pixels from the first pixel of a tile."""
    both = simd.gather(records, number * ROW + k, live, 0)
    return (
        simd.to_i32(both) - np.int32(left << SUBPIXEL_BITS),
        simd.to_i32(both >> 32) - np.int32(top << SUBPIXEL_BITS),
    )


@inlined
def set_up(chosen, count, records, left, top, columns, rows, farthest, setup):
    """Fill `setup` for the first records of `chosen`, LANES at most; return the bits of those seen.

    (left, top) is the first pixel of the tile; columns, rows: of its pixels; farthest: of its
    blocks.
    """
    entries = simd.load(chosen, 0, LANES)
    number, nearest = simd.to_i32(entries), simd.to_i32(entries >> 32)
    live = simd.first(count, LANES)
    x0, y0 = corner(number, 0, records, live, left, top)
    x1, y1 = corner(number, 1, records, live, left, top)
    x2, y2 = corner(number, 2, records, live, left, top)
    i0, i1 = centres(x0, x1, x2, columns - 1)
    j0, j1 = centres(y0, y1, y2, rows - 1)
    narrow = i1 - i0 < NARROW
    i0 = simd.select(narrow, i0, i0 & -LANES)
    i1 = simd.select(narrow, i0 + (NARROW - 1), i1 | (LANES - 1))
    u0, v0, u1, v1 = simd.to_f64(i0), simd.to_f64(j0), simd.to_f64(i1), simd.to_f64(j1)
    x0, y0, x1 = simd.to_f64(x0), simd.to_f64(y0), simd.to_f64(x1)
    y1, x2, y2 = simd.to_f64(y1), simd.to_f64(x2), simd.to_f64(y2)
    a0, b0, c0, out0 = tile_edge(x0, y0, x1, y1, u0, v0, u1, v1)
    a1, b1, c1, out1 = tile_edge(x1, y1, x2, y2, u0, v0, u1, v1)
    a2, b2, c2, out2 = tile_edge(x2, y2, x0, y0, u0, v0, u1, v1)
    e0, e1, e2 = (a0, b0, c0), (a1, b1, c1), (a2, b2, c2)
    # A narrow record is drawn in its own columns, whichever half they are in.
    first0, last0 = rows_of(
        e0, e1, e2, simd.select(narrow, i0, 0), simd.select(narrow, i1, LANES - 1), j0, j1,
        nearest, farthest, i0 < LANES, narrow & (i1 >= LANES),
    )  # fmt: skip
    first1, last1 = rows_of(
        e0, e1, e2, simd.i32(LANES, LANES), simd.i32(TILE - 1, LANES), j0, j1,
        nearest, farthest, simd.mask(False, LANES), ~narrow & (i1 >= LANES),
    )  # fmt: skip
    simd.store(setup, COLUMN * LANES, simd.select(narrow, i0, WIDE))
    simd.store(setup, FIRST * LANES, first0)
    simd.store(setup, (FIRST + 1) * LANES, first1)
    simd.store(setup, LAST * LANES, last0)
    simd.store(setup, (LAST + 1) * LANES, last1)
    simd.store(setup, EDGE_A * LANES, a0)
    simd.store(setup, (EDGE_A + 1) * LANES, a1)
    simd.store(setup, (EDGE_A + 2) * LANES, a2)
    simd.store(setup, EDGE_B * LANES, b0)
    simd.store(setup, (EDGE_B + 1) * LANES, b1)
    simd.store(setup, (EDGE_B + 2) * LANES, b2)
    simd.store(setup, EDGE_C * LANES, c0)
    simd.store(setup, (EDGE_C + 1) * LANES, c1)
    simd.store(setup, (EDGE_C + 2) * LANES, c2)
    seen = (last0 >= first0) | (last1 >= first1)
    return simd.bits(live & seen & ~(out0 | out1 | out2))


@inlined_by_value
def draw_column(n, i, j, last, edges, x, y, plane, record, depths, owners):
    """Rasterise rows j..last of n columns from i on; the tile begins at (x, y)."""
    (a0, a1, a2), (b0, b1, b2), (c0, c1, c2) = edges
    centre, ddx, ddy, nearest, farthest = plane
    edge0 = simd.iota(n) * a0 + np.int32(c0 + a0 * i + b0 * j)
    edge1 = simd.iota(n) * a1 + np.int32(c1 + a1 * i + b1 * j)
    edge2 = simd.iota(n) * a2 + np.int32(c2 + a2 * i + b2 * j)
    across = (simd.to_f64(simd.iota(n)) + (x + i)) * ddx
    at = j * STRIDE + i
    for row in range(j, last + 1):
        exact = across + (centre + ddy * (row + y))
        depth = simd.maximum(simd.minimum(simd.to_f32(exact), nearest), farthest)
        old, owner = simd.load(depths, at, n), simd.load(owners, at, n)
        wins = (depth > old) | (depth == old) & (owner > record)
        wins = wins & ((edge0 | edge1 | edge2) >= 0)
        # Not stored under a mask, which takes ten times as long on Zen.
        simd.store(depths, at, simd.select(wins, depth, old))
        simd.store(owners, at, simd.select(wins, record, owner))
        edge0, edge1, edge2 = edge0 + b0, edge1 + b1, edge2 + b2
        at += STRIDE


@inlined
def draw(entry, lane, setup, records, planes, x, y, depths, owners):
    """Rasterise a record that is set up in a lane into a tile's depths and owners.

    The tile's first pixel is at (x, y) from the screen's centre.
    """
    edges = (
        (setup[EDGE_A * LANES + lane], setup[(EDGE_A + 1) * LANES + lane],
         setup[(EDGE_A + 2) * LANES + lane]),
        (setup[EDGE_B * LANES + lane], setup[(EDGE_B + 1) * LANES + lane],
         setup[(EDGE_B + 2) * LANES + lane]),
        (setup[EDGE_C * LANES + lane], setup[(EDGE_C + 1) * LANES + lane],
         setup[(EDGE_C + 2) * LANES + lane]),
    )  # fmt: skip
    record = entry & 0xFFFFFFFF
    at = record * ROW
    plane = (
        planes[at + PLANE], planes[at + PLANE + 1], planes[at + PLANE + 2],
        np.int32(entry >> 32).view(np.float32),
        np.int32(records[at + FARTHEST] >> 32).view(np.float32),
    )  # fmt: skip
    column = np.int64(setup[COLUMN * LANES + lane])
    if column != WIDE:
        first = np.int64(setup[FIRST * LANES + lane])
        last = np.int64(setup[LAST * LANES + lane])
        draw_column(NARROW, column, first, last, edges, x, y, plane, record, depths, owners)
        return
    for half in range(HALVES):
        first = np.int64(setup[(FIRST + half) * LANES + lane])
        last = np.int64(setup[(LAST + half) * LANES + lane])
        if first <= last:
            draw_column(
                LANES, half * LANES, first, last, edges, x, y, plane, record, depths, owners
            )


@inlined
def find_farthest(depths, columns, rows, farthest):
    """Find the farthest depths of the blocks of a tile, 0 where a pixel is still empty.

    farthest (HALVES * STRIPS,) int32, their bits, comes out; the farthest of all is returned.
    """
    least = np.int32(2**31 - 1)
    for half in range(HALVES):
        live = simd.first(columns - half * LANES, LANES)
        for strip in range(STRIPS):
            found = simd.f32(np.inf, LANES)
            for j in range(strip * STRIP, min((strip + 1) * STRIP, rows)):
                here = simd.load(depths, j * STRIDE + half * LANES, LANES)
                found = simd.minimum(found, simd.select(live, here, np.inf))
            depth = np.float32(simd.reduce_min(found)).view(np.int32)
            farthest[half * STRIPS + strip] = depth
            least = min(least, depth)
    return least


@inlined
def write_tile(
    left, top, columns, rows, fresh, depths, owners, ints, depth, ddx, ddy, prim_id
):  # fmt: skip
    """Write the pixels of a tile that have something new, with `fresh` all of them."""
    for j in range(rows):
        for i in range(0, columns, LANES):
            nearest = simd.load(depths, j * STRIDE + i, LANES)
            owner = simd.load(owners, j * STRIDE + i, LANES)
            live = simd.first(columns - i, LANES)
            new = live & (owner != NOBODY)
            record = owner * (2 * ROW)
            face = simd.gather(ints, record + FACE, new, -1)
            slope_x = simd.float_of_bits(simd.gather(ints, record + SLOPE_X, new, 0))
            slope_y = simd.float_of_bits(simd.gather(ints, record + SLOPE_Y, new, 0))
            at = (top + j) * depth.shape[1] + left + i
            written = live if fresh else new
            if simd.all_(written):
                simd.store(depth, at, nearest)
                simd.store(ddx, at, slope_x)
                simd.store(ddy, at, slope_y)
                simd.store(prim_id, at, face)
            else:
                simd.store_masked(depth, at, nearest, written)
                simd.store_masked(ddx, at, slope_x, written)
                simd.store_masked(ddy, at, slope_y, written)
                simd.store_masked(prim_id, at, face, written)


@parallel_kernel
def draw_tiles(
    share, tile_start, bins, records, tiles_x, cx, cy, fresh, depth, ddx, ddy, prim_id
):  # fmt: skip
    """Draw every bin over what the images (H, W) already hold; (cx, cy) is the screen's centre.

    Bins and records are those of `records.fill_bins`. With `fresh` the images hold nothing yet,
    and all pixels are written.
    """
    height, width = depth.shape
    tiles = len(tile_start) - 1
    most = 0
    for tile in range(tiles):
        most = max(most, tile_start[tile + 1] - tile_start[tile])
    ints, planes = borrowed(records.view(np.int32)), borrowed(records.view(np.float64))
    records = borrowed(records)
    depth, ddx, ddy, prim_id = borrowed(depth), borrowed(ddx), borrowed(ddy), borrowed(prim_id)
    pixels = aligned(TILE * STRIDE)
    depths = borrowed(pixels.view(np.float32)[: TILE * STRIDE])
    owners = borrowed(pixels.view(np.int32)[TILE * STRIDE :])
    lanes = aligned(SETUP_ROWS * LANES // 2)
    farthest = np.empty(HALVES * STRIPS, np.int32)
    setup = borrowed(lanes.view(np.int32))
    chosen = np.zeros(LANES, np.int64)
    order = np.empty(most, np.int64)
    heads = np.empty(BUCKETS + 1, np.int32)
    tile = take(share, 1)
    while tile < tiles:
        start, end = np.int64(tile_start[tile]), np.int64(tile_start[tile + 1])
        if fresh or end > start:
            left = (tile % tiles_x) << TILE_BITS
            top = (tile // tiles_x) << TILE_BITS
            columns, rows = min(TILE, width - left), min(TILE, height - top)
            depths[:] = np.float32(0.0)
            owners[:] = NOBODY
            if not fresh:
                for j in range(rows):
                    for i in range(columns):
                        depths[j * STRIDE + i] = depth[top + j, left + i]
            near_first(bins, start, end, order, heads)
            at = np.int64(0)
            while at < end - start:
                hidden = max(find_farthest(depths, columns, rows, farthest), NOTHING + 1)
                count = 0
                while count < LANES and at < end - start:
                    entry = order[at]
                    at += 1
                    if entry >> 32 >= hidden:
                        chosen[count] = entry
                        count += 1
                seen = set_up(chosen, count, records, left, top, columns, rows, farthest, setup)
                while seen != 0:
                    lane = simd.lowest(seen)
                    seen &= seen - 1
                    draw(
                        chosen[lane], lane, setup, records, planes, left + 0.5 - cx,
                        top + 0.5 - cy, depths, owners,
                    )  # fmt: skip
            write_tile(
                left, top, columns, rows, fresh, depths, owners, ints,
                depth, ddx, ddy, prim_id,
            )  # fmt: skip
        tile = take(share, 1)
    keep(pixels)
    keep(lanes)


@parallel_kernel
def quad_differences(share, depth, ddx, ddy):
    """Replace ddx, ddy (H, W) by differences of depth within aligned quads of 2x2 pixels."""
    height, width = depth.shape
    for j in part(share, height):
        # The last row of an odd height pairs with the one before it.
        j0 = min(j & ~1, max(height - 2, 0))
        j1 = min(j0 + 1, height - 1)
        for i in range(width):
            i0 = min(i & ~1, max(width - 2, 0))
            i1 = min(i0 + 1, width - 1)
            ddx[j, i] = depth[j, i1] - depth[j, i0]
            ddy[j, i] = depth[j1, i] - depth[j0, i]
