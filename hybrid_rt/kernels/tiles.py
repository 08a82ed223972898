"""The second half of a tiled rasteriser: draw the bin of each tile, on its own and on one thread.

The nearest record has a pixel, and among equals the first, so the order of drawing does not matter.
Records are set up LANES at a time, then drawn one after the other, a vector of pixels at a time and
without a branch on what is covered: guessing wrong costs more than a vector.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._aligned import aligned
from hybrid_rt.kernels._borrow import borrowed, keep
from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels._order import BUCKETS, near_first
from hybrid_rt.kernels._queue import fetch_add
from hybrid_rt.kernels.bins import TILE, TILE_BITS
from hybrid_rt.kernels.clip import HALF, ONE, SUBPIXEL_BITS
from hybrid_rt.kernels.cull import LANES, centres
from hybrid_rt.kernels.records import FACE, FARTHEST, NOTHING, PLANE, ROW, SLOPE_X, SLOPE_Y

NARROW = 8
"""Records no wider than this are drawn so many pixels at a time, others LANES, an aligned half of a
tile's row."""
STRIDE = TILE + LANES
"""Pixels in a row of a tile; narrow records run over its right end."""

NOBODY = -1
"""Owner of a pixel that shows nothing yet, or what an earlier batch has drawn."""
COLUMN_0, ROW_0, COLUMN_1, ROW_1, EDGE_A, EDGE_B, EDGE_C, SETUP_ROWS = 0, 1, 2, 3, 4, 7, 10, 13
"""What a set-up makes of records, a lane each: the first and the last pixel of the tile that is
drawn, and the three edges as functions of a pixel, from the first on."""


@inlined
def tile_edge(ax, ay, bx, by, i0, j0, i1, j1):
    """Return A, B, value at (i0, j0) of edges a -> b in int32, and are their boxes outside of them.

    Pixel (i, j) is inside where A i + B j + C >= 0, as in `bins.edge`; coordinates are float64,
    which holds all products: they are less than 2^50. An edge that its whole box is inside of is
    (0, 0, 0): always passed. Any other straddles the box, so its values stay below
    31 (|A| + |B|) < 2^31, as the guard band allows.
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
        simd.select(inside, zero, simd.to_i32(c + left + top)),
        outside,
    )


@inlined
def corner(number, k, records, live, left, top):
    """Return x and y of corner k of records, in sub-pixels from the first pixel of a tile."""
    both = simd.gather(records, number * ROW + k, live, 0)
    return (
        simd.to_i32(both) - np.int32(left << SUBPIXEL_BITS),
        simd.to_i32(both >> 32) - np.int32(top << SUBPIXEL_BITS),
    )


@inlined
def set_up(chosen, count, records, left, top, columns, rows, setup):
    """Fill `setup` for the first records of `chosen`, LANES at most; return the bits of those seen.

    (left, top) is the first pixel of the tile; columns, rows: of its pixels.
    """
    number = simd.to_i32(simd.load(chosen, 0, LANES))
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
    simd.store(setup, COLUMN_0 * LANES, i0)
    simd.store(setup, ROW_0 * LANES, j0)
    simd.store(setup, COLUMN_1 * LANES, i1)
    simd.store(setup, ROW_1 * LANES, j1)
    simd.store(setup, EDGE_A * LANES, a0)
    simd.store(setup, (EDGE_A + 1) * LANES, a1)
    simd.store(setup, (EDGE_A + 2) * LANES, a2)
    simd.store(setup, EDGE_B * LANES, b0)
    simd.store(setup, (EDGE_B + 1) * LANES, b1)
    simd.store(setup, (EDGE_B + 2) * LANES, b2)
    simd.store(setup, EDGE_C * LANES, c0)
    simd.store(setup, (EDGE_C + 1) * LANES, c1)
    simd.store(setup, (EDGE_C + 2) * LANES, c2)
    return simd.bits(live & ~(out0 | out1 | out2))


@inlined
def draw_column(
    n, at, rows, a0, a1, a2, b0, b1, b2, c0, c1, c2, x, y, plane, record, depths, owners
):  # fmt: skip
    """Rasterise `rows` rows of n pixels from pixel `at` on, (x, y) from the screen's centre."""
    centre, ddx, ddy, nearest, farthest = plane
    edge0, edge1, edge2 = simd.iota(n) * a0 + c0, simd.iota(n) * a1 + c1, simd.iota(n) * a2 + c2
    across = (simd.to_f64(simd.iota(n)) + x) * ddx
    for j in range(rows):
        exact = across + (centre + ddy * (j + y))
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
    i0 = np.int64(setup[COLUMN_0 * LANES + lane])
    i1 = np.int64(setup[COLUMN_1 * LANES + lane])
    j0 = np.int64(setup[ROW_0 * LANES + lane])
    rows = setup[ROW_1 * LANES + lane] - j0 + 1
    a0, b0 = setup[EDGE_A * LANES + lane], setup[EDGE_B * LANES + lane]
    a1, b1 = setup[(EDGE_A + 1) * LANES + lane], setup[(EDGE_B + 1) * LANES + lane]
    a2, b2 = setup[(EDGE_A + 2) * LANES + lane], setup[(EDGE_B + 2) * LANES + lane]
    c0 = setup[EDGE_C * LANES + lane]
    c1 = setup[(EDGE_C + 1) * LANES + lane]
    c2 = setup[(EDGE_C + 2) * LANES + lane]
    record = entry & 0xFFFFFFFF
    at = record * ROW
    plane = (
        planes[at + PLANE], planes[at + PLANE + 1], planes[at + PLANE + 2],
        np.int32(entry >> 32).view(np.float32),
        np.int32(records[at + FARTHEST] >> 32).view(np.float32),
    )  # fmt: skip
    if i1 - i0 < NARROW:
        draw_column(
            NARROW, j0 * STRIDE + i0, rows, a0, a1, a2, b0, b1, b2, c0, c1, c2,
            x + i0, y + j0, plane, record, depths, owners,
        )  # fmt: skip
        return
    for i in range(0, i1 - i0 + 1, LANES):
        draw_column(
            LANES, j0 * STRIDE + i0 + i, rows, a0, a1, a2, b0, b1, b2,
            np.int32(c0 + a0 * i), np.int32(c1 + a1 * i), np.int32(c2 + a2 * i),
            x + (i0 + i), y + j0, plane, record, depths, owners,
        )  # fmt: skip


@inlined
def farthest_of(depths, columns, rows):
    """Return the farthest depth of a tile, 0 if a pixel is still empty."""
    farthest = simd.f32(np.inf, LANES)
    for j in range(rows):
        for i in range(0, columns, LANES):
            here = simd.load(depths, j * STRIDE + i, LANES)
            farthest = simd.minimum(
                farthest, simd.select(simd.first(columns - i, LANES), here, np.inf)
            )
    return simd.reduce_min(farthest)


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
    tile_start, bins, records, tiles_x, cx, cy, workers, fresh, depth, ddx, ddy, prim_id
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
    taken = np.zeros(1, np.int64)
    for _ in prange(workers):
        pixels = aligned(TILE * STRIDE)
        depths = borrowed(pixels.view(np.float32)[: TILE * STRIDE])
        owners = borrowed(pixels.view(np.int32)[TILE * STRIDE :])
        lanes = aligned(SETUP_ROWS * LANES // 2)
        setup = borrowed(lanes.view(np.int32))
        chosen = np.zeros(LANES, np.int64)
        order = np.empty(most, np.int64)
        heads = np.empty(BUCKETS + 1, np.int32)
        tile = fetch_add(taken.ctypes.data, 1)
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
                    farthest = np.float32(farthest_of(depths, columns, rows))
                    hidden = max(np.int64(farthest.view(np.int32)), NOTHING + 1)
                    count = 0
                    while count < LANES and at < end - start:
                        entry = order[at]
                        at += 1
                        if entry >> 32 >= hidden:
                            chosen[count] = entry
                            count += 1
                    seen = set_up(chosen, count, records, left, top, columns, rows, setup)
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
            tile = fetch_add(taken.ctypes.data, 1)
        keep(pixels)
        keep(lanes)


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
