"""The second half of a tiled rasteriser: draw the bin of each tile, on its own and on one thread.

The visible surface of a pixel is one float64 *key*: the depth as float32 and, in the bits that this
leaves empty, the rank of its record. So the nearest record, and among equals the first, is a plain
maximum, which LLVM can make vectors of; the order of drawing does not matter.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels._order import BUCKETS, near_first
from hybrid_rt.kernels._queue import fetch_add
from hybrid_rt.kernels.clip import HALF, SUBPIXEL_BITS
from hybrid_rt.kernels.raster import (
    RECORD_FLOATS,
    RECORD_INTS,
    TILE,
    TILE_BITS,
    edge,
    highest,
    lowest,
)

BLOCK = 16
"""Pixels of a row that are drawn together."""
NARROW = 4
"""The same for triangles that are no wider."""
STRIDE = TILE + BLOCK
"""Keys in a row of a tile; blocks run over its right end."""
OLD = (1 << 29) - 1
"""Rank of what an earlier batch has drawn. Record r has OLD - 1 - r: the smallest wins a tie."""
LANES = 8
LARGEST = float(np.finfo(np.float32).max)
REVISION = 16
"""Records after which a tile finds out again behind which depth nothing can be seen."""


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


@inlined
def farthest_of(keys, columns, rows, lowest_key):
    """Return the farthest depth of a tile, 0 if a pixel is still empty.

    lowest_key (TILE,) float64 is scratch: minima down the columns are independent of each other,
    so they are taken side by side.
    """
    lowest_key[:] = np.inf
    for j in range(rows):
        line = keys[j * STRIDE : j * STRIDE + columns]
        for i in range(columns):
            key = line[i]
            low = lowest_key[i] + 0.0  # see draw_pixels
            lowest_key[i] = low if low < key else key
    farthest = np.inf
    for i in range(columns):
        farthest = min(farthest, lowest_key[i])
    return unpack(farthest)[0]


@inlined
def depth_bits(floats, record):
    """Return a record's nearest depth as the bits of a float32."""
    return np.int64(np.float32(floats[record, 4]).view(np.int32))


@inlined
def write_tile(left, top, right, bottom, fresh, keys, ints, floats, depth, ddx, ddy, prim_id):
    """Write the pixels of a tile that have something new, with `fresh` all of them."""
    for j in range(bottom - top + 1):
        for i in range(0, right - left + 1, LANES):
            bits = simd.bits_i64(simd.load(keys, j * STRIDE + i, LANES))
            rank = simd.to_i32(bits & OLD)
            nearest = simd.to_f32(simd.float_of_bits(bits & ~OLD))
            live = simd.first(right - left + 1 - i, LANES)
            new = live & (nearest > np.float32(0.0)) & (rank != OLD)
            record = (OLD - 1) - rank
            face = simd.gather(ints, record * RECORD_INTS + 6, new, -1)
            # The plane of a triangle seen edge-on can be steeper than float32 holds.
            slope_x = simd.gather(floats, record * RECORD_FLOATS + 1, new, 0.0)
            slope_x = simd.minimum(simd.maximum(slope_x, -LARGEST), LARGEST)
            slope_y = simd.gather(floats, record * RECORD_FLOATS + 2, new, 0.0)
            slope_y = simd.minimum(simd.maximum(slope_y, -LARGEST), LARGEST)
            at = (top + j) * depth.shape[1] + left + i
            written = live if fresh else new
            simd.store_masked(depth, at, nearest, written)
            simd.store_masked(ddx, at, simd.to_f32(slope_x), written)
            simd.store_masked(ddy, at, simd.to_f32(slope_y), written)
            simd.store_masked(prim_id, at, face, written)


@parallel_kernel
def draw_tiles(
    tile_start, bins, ints, floats, tiles_x, cx, cy, workers, fresh, depth, ddx, ddy, prim_id
):  # fmt: skip
    """Draw every bin over what the images (H, W) already hold; (cx, cy) is the screen's centre.

    With `fresh` they hold nothing yet, and all pixels are written.
    """
    height, width = depth.shape
    tiles = len(tile_start) - 1
    most = 0
    for tile in range(tiles):
        most = max(most, tile_start[tile + 1] - tile_start[tile])
    taken = np.zeros(1, np.int64)
    for _ in prange(workers):
        keys = np.empty(TILE * STRIDE, np.float64)
        lowest_key = np.empty(TILE, np.float64)
        order = np.empty(most, np.int32)
        heads = np.empty(BUCKETS + 1, np.int32)
        tile = fetch_add(taken.ctypes.data, 1)
        while tile < tiles:
            start, end = np.int64(tile_start[tile]), np.int64(tile_start[tile + 1])
            if fresh or end > start:
                left = (tile % tiles_x) << TILE_BITS
                top = (tile // tiles_x) << TILE_BITS
                right = min(left + TILE, width) - 1
                bottom = min(top + TILE, height) - 1
                keys[:] = 0.0
                if not fresh:
                    for j in range(bottom - top + 1):
                        for i in range(right - left + 1):
                            old = depth[top + j, left + i]
                            if old > 0.0:
                                keys[j * STRIDE + i] = pack(old, OLD)
                near_first(bins, start, end, depth_bits, floats, order, heads)
                hidden = np.float32(0.0)
                until = REVISION
                for at in range(end - start):
                    record = order[at]
                    if at == until:
                        hidden = farthest_of(keys, right - left + 1, bottom - top + 1, lowest_key)
                        until += REVISION
                    if np.float32(floats[record, 4]) >= hidden:
                        draw(record, ints, floats, left, top, right, bottom, cx, cy, keys)
                write_tile(
                    left, top, right, bottom, fresh, keys, ints, floats, depth, ddx, ddy, prim_id
                )
            tile = fetch_add(taken.ctypes.data, 1)


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
