"""Bins: for each tile of the screen, the triangles that may cover a pixel of it.

They are made in two passes over chunks of triangles, one that counts and one that notes. Between
them `prefix_sums` gives each chunk its place in every bin, so that threads need not wait for each
other and bins are in the order of the triangles.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels._jit import inlined, kernel
from hybrid_rt.kernels.raster.clip import HALF, SUBPIXEL_BITS

TILE_BITS = 5
TILE = 1 << TILE_BITS
"""Pixels along a side of a tile; they stay in the L1 cache (see `kernels.raster.tiles`)."""


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
def put(tile, entry, cursor, bins):
    """Count, or with an entry note, a triangle in a tile."""
    if entry is not None:
        bins[cursor[tile]] = entry
    cursor[tile] += 1


@inlined
def put_in_tiles(p, q, r, box, tiles_x, entry, cursor, bins):
    """Count, or with an entry note, a triangle in each tile that it may cover.

    p, q, r: its corners, y above x in an int64, turning so that the inside is positive; box: its
    pixels (i0, j0, i1, j1). `cursor` (tiles,) int32 is advanced; the same tiles are found in both
    passes, and bins is None in the first.
    """
    i0, j0, i1, j1 = box
    u0, v0, u1, v1 = i0 >> TILE_BITS, j0 >> TILE_BITS, i1 >> TILE_BITS, j1 >> TILE_BITS
    if u0 == u1 or v0 == v1:  # a strip of tiles is crossed by the triangle almost everywhere
        for v in range(v0, v1 + 1):
            for u in range(u0, u1 + 1):
                put(v * tiles_x + u, entry, cursor, bins)
        return
    x0, y0, x1, y1, x2, y2 = np.int32(p), p >> 32, np.int32(q), q >> 32, np.int32(r), r >> 32
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
                put(v * tiles_x + u, entry, cursor, bins)


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
