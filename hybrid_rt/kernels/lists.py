"""Conservative raster: which primitives touch each pixel square, and how near they can be.

A *grown pixel* (i, j) is the square [i - margin, i + 1 + margin] x [j - margin, j + 1 + margin].
For every grown pixel and every triangle with a point in front of the near plane that projects into
it, the pixel's list holds the triangle with an upper bound of the depth of all such points, or the
pixel's `rest` is at least that bound. Nothing is decided at pixel centres; every decision that
rounding could turn goes to the side of covering.

A triangle's points seen from the eye fill a cone. Its faces are the planes through the eye and the
edges, N = q_i x q_j for vertices q = M (p - eye), so that N . (x, y, 1) has one sign inside; this
holds for vertices behind the eye as well (Olano and Greer 1997, "Triangle Scan Conversion using 2D
Homogeneous Coordinates"), and nothing is clipped.

Error bounds. e = 2**-53; a hat marks a computed value. Vertices are float32 and p - eye is rounded
once, so with Q_k = sum over c of abs(M_kc (p - eye)_c)

    abs(q^_k - q_k) <= 4 e Q_k,

and each component of N, a difference of two products of such, errs by no more than
``11 e (Q_i Q_j' + Q_i' Q_j)``; evaluating the linear form adds 4 e of its terms' sizes. `SLACK` =
32 e times the sum of those sizes covers both. The depth plane is near (n . r) / (n . a) with
n = (b - a) x (c - a): the edges are differences of float32, rounded once, so n_k errs by no more
than 4 e times its two products' sizes, whose sum over k is less than abs(b - a) abs(c - a) in sums
of absolute coordinates; SLACK times that, times the sizes of r or of a, covers both scalar
products, their 3 additions included.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel

TILE_BITS = 5
TILE = 1 << TILE_BITS

SLACK = 2.0**-48
"""Relative error of the sums above, 32 e."""
NEAR_SLACK = 2.0**-20
"""The near plane is moved to the eye by this, relative: a ray may end a rounding beyond it."""
EDGE_ON = 1024.0
"""A plane whose distance from the eye is not certain to one part in a thousand has no slope."""
CAP = 1.01
"""Depths above 1 lie before the near plane; the hundredth covers the error of the denominator."""
PLANE_ULPS = 16.0 * 2.0**-24
"""Error of a depth plane in float32, relative to the sizes of its terms: three roundings of what is
stored, two of the differences, four of the sum, one of the comparison."""
TINY = np.float32(1e-37)
"""A bound that is not zero is at least this, where float32 still has all its digits."""

COVER, ALL = 0, 1

# Scratch of one triangle's set-up: three edges (A, B, C, slack), the plane's numerator (A, B, C,
# slack), its denominator, the nearest depth of the vertices, twice the relative error of the
# denominator.
EDGES, PLANE, DENOMINATOR, NEAREST, LOWERED, SETUP = 0, 12, 16, 17, 18, 19


@inlined
def _relative(vertices, v, eye):
    """Return vertex v relative to the eye, in world axes."""
    return (
        np.float64(vertices[v, 0]) - eye[0],
        np.float64(vertices[v, 1]) - eye[1],
        np.float64(vertices[v, 2]) - eye[2],
    )


@inlined
def _edge(vertices, i, j):
    """Return vertex j minus vertex i; float32 inputs, so that one rounding is all its error."""
    return (
        np.float64(vertices[j, 0]) - np.float64(vertices[i, 0]),
        np.float64(vertices[j, 1]) - np.float64(vertices[i, 1]),
        np.float64(vertices[j, 2]) - np.float64(vertices[i, 2]),
    )


@inlined
def _equal(vertices, i, j):
    """Are two vertices in the same place."""
    return (
        vertices[i, 0] == vertices[j, 0]
        and vertices[i, 1] == vertices[j, 1]
        and vertices[i, 2] == vertices[j, 2]
    )


@inlined
def _row(m, k, x, y, z):
    """Return (q_k, Q_k): row k of M times a vector, and the sum of its terms' sizes."""
    a, b, c = m[k, 0] * x, m[k, 1] * y, m[k, 2] * z
    return a + b + c, abs(a) + abs(b) + abs(c)


@inlined
def face_box(vertices, faces, face, eye, m, near, width, height, margin):
    """Return (any, i0, j0, i1, j1): the grown pixels that the face may touch.

    A face that crosses the near plane gets the whole screen, unless it lies beside it. One with two
    equal corners is a line or a point and is never hit.
    """
    if (
        _equal(vertices, faces[face, 0], faces[face, 1])
        or _equal(vertices, faces[face, 1], faces[face, 2])
        or _equal(vertices, faces[face, 2], faces[face, 0])
    ):
        return False, 0, 0, 0, 0
    low_x = np.inf
    low_y = np.inf
    high_x = -np.inf
    high_y = -np.inf
    perhaps_front = 0
    surely_front = 0
    left, right, above, below = True, True, True, True
    for k in range(3):
        x, y, z = _relative(vertices, faces[face, k], eye)
        q0, s0 = _row(m, 0, x, y, z)
        q1, s1 = _row(m, 1, x, y, z)
        q2, s2 = _row(m, 2, x, y, z)
        e0, e1, e2 = SLACK * s0, SLACK * s1, SLACK * s2
        if q2 + e2 >= near * (1.0 - NEAR_SLACK):
            perhaps_front += 1
        if q2 - e2 >= near * (1.0 - NEAR_SLACK):
            surely_front += 1
            px, py = q0 / q2, q1 / q2
            ex, ey = (e0 + abs(px) * e2) / q2, (e1 + abs(py) * e2) / q2
            low_x, high_x = min(low_x, px - ex), max(high_x, px + ex)
            low_y, high_y = min(low_y, py - ey), max(high_y, py + ey)
        # Wholly beside the grown screen, in homogeneous form.
        left &= q0 + e0 + margin * (q2 + e2) < 0.0
        right &= q0 - e0 - (width + margin) * (q2 + e2) > 0.0
        above &= q1 + e1 + margin * (q2 + e2) < 0.0
        below &= q1 - e1 - (height + margin) * (q2 + e2) > 0.0
    if perhaps_front == 0 or left or right or above or below:
        return False, 0, 0, 0, 0
    if surely_front != 3:
        return True, 0, 0, width - 1, height - 1
    low_x -= margin
    low_y -= margin
    high_x += margin
    high_y += margin
    # Not by conversion alone: a far corner may not fit an integer.
    if high_x < 0.0 or high_y < 0.0 or low_x > width or low_y > height:
        return False, 0, 0, 0, 0
    i0 = int(max(low_x, 0.0))
    j0 = int(max(low_y, 0.0))
    i1 = int(min(high_x, width - 1.0))
    j1 = int(min(high_y, height - 1.0))
    return i0 <= i1 and j0 <= j1, i0, j0, i1, j1


@parallel_kernel
def bin_faces(
    vertices, faces, first, last, eye, m, near, width, height, margin, tiles_x, chunk, cursors, bins
):  # fmt: skip
    """Count, or with room in `bins` note, each face first..last-1 in every tile of its box.

    cursors (chunks, tiles) int32 are advanced: from zero they become counts, from the places that
    `hybrid_rt.kernels.raster.prefix_sums` makes of those they fill bins (entries,) int32.
    """
    note = len(bins) > 0
    for c in prange(len(cursors)):
        begin = first + c * chunk
        for face in range(begin, min(begin + chunk, last)):
            some, i0, j0, i1, j1 = face_box(
                vertices, faces, face, eye, m, near, width, height, margin
            )
            if not some:
                continue
            for v in range(j0 >> TILE_BITS, (j1 >> TILE_BITS) + 1):
                for u in range(i0 >> TILE_BITS, (i1 >> TILE_BITS) + 1):
                    tile = v * tiles_x + u
                    if note:
                        bins[cursors[c, tile]] = face
                    cursors[c, tile] += 1


@kernel
def set_up(vertices, faces, face, eye, m, frame, near, width, height, out):
    """Fill `out` (SETUP,) float64 with a face's edges and plane; return COVER or ALL.

    ALL: the face is seen edge-on, so only its box and its nearest depth bound it.
    """
    ax, ay, az = _relative(vertices, faces[face, 0], eye)
    bx, by, bz = _relative(vertices, faces[face, 1], eye)
    cx, cy, cz = _relative(vertices, faces[face, 2], eye)
    # The nearest depth of what lies in front of the near plane.
    a2, sa2 = _row(m, 2, ax, ay, az)
    b2, sb2 = _row(m, 2, bx, by, bz)
    c2, sc2 = _row(m, 2, cx, cy, cz)
    closest = min(a2 - SLACK * sa2, b2 - SLACK * sb2, c2 - SLACK * sc2)
    out[NEAREST] = near / max(closest, near * (1.0 - NEAR_SLACK))

    ux, uy, uz = _edge(vertices, faces[face, 0], faces[face, 1])
    vx, vy, vz = _edge(vertices, faces[face, 0], faces[face, 2])
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    n_slack = SLACK * (abs(ux) + abs(uy) + abs(uz)) * (abs(vx) + abs(vy) + abs(vz))
    d = nx * ax + ny * ay + nz * az
    d_slack = n_slack * (abs(ax) + abs(ay) + abs(az))
    if not abs(d) > EDGE_ON * d_slack:
        return ALL
    side = 1.0 if d > 0.0 else -1.0
    out[DENOMINATOR] = side * d - d_slack
    out[LOWERED] = 2.0 * d_slack / out[DENOMINATOR]
    reach = 0.0
    for k in range(3):
        value = side * near * (nx * frame[k, 0] + ny * frame[k, 1] + nz * frame[k, 2])
        out[PLANE + k] = value
        size = abs(frame[k, 0]) + abs(frame[k, 1]) + abs(frame[k, 2])
        extent = width if k == 0 else (height if k == 1 else 1.0)
        reach += near * extent * n_slack * size
    out[PLANE + 3] = reach

    a0, sa0 = _row(m, 0, ax, ay, az)
    a1, sa1 = _row(m, 1, ax, ay, az)
    b0, sb0 = _row(m, 0, bx, by, bz)
    b1, sb1 = _row(m, 1, bx, by, bz)
    c0, sc0 = _row(m, 0, cx, cy, cz)
    c1, sc1 = _row(m, 1, cx, cy, cz)
    edge_plane(a0, a1, a2, sa0, sa1, sa2, b0, b1, b2, sb0, sb1, sb2, side, width, height, out, 0)
    edge_plane(b0, b1, b2, sb0, sb1, sb2, c0, c1, c2, sc0, sc1, sc2, side, width, height, out, 4)
    edge_plane(c0, c1, c2, sc0, sc1, sc2, a0, a1, a2, sa0, sa1, sa2, side, width, height, out, 8)
    return COVER


@inlined
def edge_plane(p0, p1, p2, s0, s1, s2, q0, q1, q2, r0, r1, r2, side, width, height, out, at):
    """Write the plane through the eye and an edge, turned inwards, and its slack on the screen."""
    out[at] = side * (p1 * q2 - p2 * q1)
    out[at + 1] = side * (p2 * q0 - p0 * q2)
    out[at + 2] = side * (p0 * q1 - p1 * q0)
    out[at + 3] = SLACK * (
        (s1 * r2 + s2 * r1) * (width + 1) + (s2 * r0 + s0 * r2) * (height + 1) + s0 * r1 + s1 * r0
    )


# A row of what `face_planes` writes: slopes, depth at a reference point, that point, error; padded
# so that no row lies across two cache lines.
SLOPE_X, SLOPE_Y, DEPTH, REFERENCE_X, REFERENCE_Y, ERROR, PLANE_ROW = 0, 1, 2, 3, 4, 5, 8


@parallel_kernel
def face_planes(vertices, faces, eye, m, frame, near, width, height, margin, chunk, planes):
    """Write float32 depth planes (F, PLANE_ROW) of all faces that may touch a pixel.

    In the grown pixels of the face's box, and for a place (x, y) that is off by no more than half
    of the margin, ``DEPTH + SLOPE_X (x - REFERENCE_X) + SLOPE_Y (y - REFERENCE_Y)`` in float32 errs
    by less than ERROR. Faces seen edge-on, or beside the screen, have NaN.
    """
    for c in prange(-(-len(faces) // chunk)):
        setup = np.empty(SETUP, np.float64)
        for face in range(c * chunk, min((c + 1) * chunk, len(faces))):
            row = planes[face]
            row[DEPTH] = np.nan
            some, i0, j0, i1, j1 = face_box(
                vertices, faces, face, eye, m, near, width, height, margin
            )
            if not some:
                continue
            kind = set_up(vertices, faces, face, eye, m, frame, near, width, height, setup)
            if kind != COVER:
                continue
            x, y = 0.5 * (i0 + i1 + 1), 0.5 * (j0 + j1 + 1)
            reach_x, reach_y = 0.5 * (i1 - i0 + 3), 0.5 * (j1 - j0 + 3)
            # set_up has lowered the denominator by its error, no more than a thousandth of it.
            d = setup[DENOMINATOR]
            a, b = setup[PLANE] / d, setup[PLANE + 1] / d
            at = a * (x - 0.5 * width) + b * (y - 0.5 * height) + setup[PLANE + 2] / d
            size = abs(at) + abs(a) * reach_x + abs(b) * reach_y
            error = PLANE_ULPS * size + (abs(a) + abs(b)) * margin + setup[PLANE + 3] / d
            error += size * setup[LOWERED]
            row[SLOPE_X], row[SLOPE_Y], row[DEPTH] = a, b, at
            row[REFERENCE_X], row[REFERENCE_Y] = x, y
            row[ERROR] = error * (1.0 + 2.0**-20)


@inlined
def inside_edge(out, at, x, y, half):
    """May a square of half side `half` around (x, y) hold a point inside of an edge."""
    a, b = out[at], out[at + 1]
    return a * x + b * y + out[at + 2] + (abs(a) + abs(b)) * half + out[at + 3] >= 0.0


@inlined
def round_up(depth):
    """Return a float32 that is no less than a depth."""
    return max(np.float32(depth * (1.0 + 2.0**-22)), TINY)


@inlined
def insert(face, bound, ids, bounds, rest, at):
    """Put a face into the list of pixel `at`, nearest first; what falls out raises `rest`."""
    k = ids.shape[1]
    if bound <= bounds[at, k - 1]:
        rest[at] = max(rest[at], bound)
        return
    rest[at] = max(rest[at], bounds[at, k - 1])
    j = k - 1
    while j > 0 and bounds[at, j - 1] < bound:
        bounds[at, j] = bounds[at, j - 1]
        ids[at, j] = ids[at, j - 1]
        j -= 1
    bounds[at, j] = bound
    ids[at, j] = face


@inlined
def draw(face, kind, setup, left, top, i0, j0, i1, j1, half, cx, cy, ids, bounds, rest):
    """Insert a face into the lists of those pixels i0..i1, j0..j1 of a tile that it may touch.

    (cx, cy) is the screen's centre, about which the plane is given.
    """
    nearest = setup[NEAREST]
    for j in range(j0, j1 + 1):
        y = j + 0.5
        for i in range(i0, i1 + 1):
            x = i + 0.5
            bound = nearest
            if kind == COVER:
                if not (
                    inside_edge(setup, EDGES, x, y, half)
                    and inside_edge(setup, EDGES + 4, x, y, half)
                    and inside_edge(setup, EDGES + 8, x, y, half)
                ):
                    continue
                a, b = setup[PLANE], setup[PLANE + 1]
                middle = a * (x - cx) + b * (y - cy) + setup[PLANE + 2]
                spread = (abs(a) + abs(b)) * half + setup[PLANE + 3]
                high = (middle + spread) / setup[DENOMINATOR]
                if high <= 0.0 or middle - spread > CAP * setup[DENOMINATOR]:
                    continue  # beyond infinity, or nearer than the near plane, all over the square
                bound = min(bound, high)
            insert(face, round_up(bound), ids, bounds, rest, (j - top) * TILE + (i - left))


@parallel_kernel
def fill_lists(
    vertices, faces, tile_start, bins, eye, m, frame, near, width, height, margin, tiles_x, lanes,
    prim_id, nearest, rest,
):  # fmt: skip
    """Insert every bin's faces into the lists of its tile.

    prim_id (H, W, K) int32, nearest (H, W, K) and rest (H, W) float32 hold what earlier batches
    have left: -1, 0 and 0 at first.
    """
    length = prim_id.shape[2]
    tiles = len(tile_start) - 1
    half = 0.5 + margin
    for lane in prange(lanes):
        ids = np.empty((TILE * TILE, length), np.int32)
        bounds = np.empty((TILE * TILE, length), np.float32)
        others = np.empty(TILE * TILE, np.float32)
        setup = np.empty(SETUP, np.float64)
        for tile in range(lane, tiles, lanes):
            if tile_start[tile] == tile_start[tile + 1]:
                continue
            left = (tile % tiles_x) << TILE_BITS
            top = (tile // tiles_x) << TILE_BITS
            right = min(left + TILE, width)
            bottom = min(top + TILE, height)
            for j in range(top, bottom):
                for i in range(left, right):
                    at = (j - top) * TILE + (i - left)
                    others[at] = rest[j, i]
                    for k in range(length):
                        ids[at, k] = prim_id[j, i, k]
                        bounds[at, k] = nearest[j, i, k]
            for entry in range(tile_start[tile], tile_start[tile + 1]):
                face = bins[entry]
                _, i0, j0, i1, j1 = face_box(
                    vertices, faces, face, eye, m, near, width, height, margin
                )
                kind = set_up(vertices, faces, face, eye, m, frame, near, width, height, setup)
                draw(
                    face, kind, setup, left, top,
                    max(i0, left), max(j0, top), min(i1, right - 1), min(j1, bottom - 1),
                    half, 0.5 * width, 0.5 * height, ids, bounds, others,
                )  # fmt: skip
            for j in range(top, bottom):
                for i in range(left, right):
                    at = (j - top) * TILE + (i - left)
                    rest[j, i] = others[at]
                    for k in range(length):
                        prim_id[j, i, k] = ids[at, k]
                        nearest[j, i, k] = bounds[at, k]
