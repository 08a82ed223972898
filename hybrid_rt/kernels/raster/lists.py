"""Conservative raster: which primitives touch each pixel square, and how near they can be.

A *grown pixel* (i, j) is the square [i - margin, i + 1 + margin] x [j - margin, j + 1 + margin].
For every grown pixel and every triangle with a point in front of the near plane that projects into
it, the pixel's list holds the triangle with an upper bound of the depth of all such points, or the
pixel's `rest` is at least that bound. Nothing is decided at pixel centres; every decision that
rounding could turn goes to the side of covering.
The planes that decide, and their error bounds, are in `kernels.raster.lists_planes`.

Every pixel's list is sorted by *keys*: the bits of the bound, and below them the complement of the
face's number, so that of equal bounds the smaller number comes first and the order of drawing does
not show. A tile's faces are drawn from near to far all the same, because what is behind all that
its pixels have already left out of their lists changes nothing.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._aligned import aligned
from hybrid_rt.kernels._borrow import borrowed, keep
from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels._queue import take
from hybrid_rt.kernels._rows import transposed
from hybrid_rt.kernels.raster._order import BUCKETS, near_first
from hybrid_rt.kernels.raster.bins import TILE, TILE_BITS
from hybrid_rt.kernels.raster.lists_bins import LANES, round_up
from hybrid_rt.kernels.raster.lists_planes import LIMIT, PLANE, ROWS, set_up

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
    share, corners, tile_start, bins, records, eye, m, frame, sigma, hand, width, height, margin,
    tiles_x, fresh, prim_id, nearest, rest, planes,
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
    tile = take(share, 1)
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
                    corners, chosen, spans, left, top, right, bottom, eye, m, frame, sigma, hand,
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
        tile = take(share, 1)
    keep(owner)
    keep(owner2)
    keep(owner3)
