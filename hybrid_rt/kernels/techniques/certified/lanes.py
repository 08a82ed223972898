"""The certified march in vectors: the answers of `certified.scalar`.

A *batch* of rays is set up into rows of plain arrays, *slots*. Its rays then go from queue to
queue: `step` walks what is ready, a ray in each lane, until something may be in the ray's way;
`look` goes through the list of the pixel that it has come to; `test` intersects it with a
primitive. Queues hold slots, so that each stage finds its lanes full, whatever other rays do. A
lane of `step` whose ray has left is given the next one, once a few are free. At last the results of
a batch are written to the rows of the outputs.

Every lane computes what `certified.scalar` computes, operation by operation, so both
have the same answers, ray for ray and step for step; there are the reasons and the error bounds.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import fetch_add
from hybrid_rt.kernels.raster.lists import (
    DEPTH,
    ERROR,
    PLANE_ROW,
    REFERENCE_X,
    REFERENCE_Y,
    SLOPE_X,
    SLOPE_Y,
)
from hybrid_rt.kernels.techniques.certified.scalar import (
    BEYOND,
    DEPTH_ULPS,
    HIGH_ULPS,
    NO_SLOPE,
    SHORTEST,
    E,
    U,
)
from hybrid_rt.kernels.techniques.screen import (
    EXHAUSTED,
    HIDDEN,
    HIT,
    INVALID,
    MISS,
    NEAR,
    OFFSCREEN,
    SKIPPED,
    UNDECIDED,
)

BATCH = 512
"""Slots; their rows stay in the L2 cache."""
REFILL = 6
"""Free lanes before rays are put in."""
FEW = 8
"""Lanes with which stepping goes on though other stages have work."""

W = simd.WIDTH
STRIDE = BATCH + W  # slots in a row: what is loaded past the last one is not used

# Rows of slots, float32: the ray on the screen, its end and the s up to which it is free, by how
# much its depth may be too low, its origin along the axes of the exact test.
X0, Y0, Z0, SX, SY, SZ, INV_X, INV_Y, END, S, Z_ERROR, OX, OY, OZ, F32_ROWS = range(15)
# int32: the ray, the axis kz of the exact test, how it ends if it meets nothing; then its state:
# the pixel, level (or PASSED), steps, place in the pixel's list, the primitive tested last, exact
# tests, best hit and its pixel, status or ARRIVED.
RAY, KZ, HOW, CX, CY, LEVEL, STEPS, ENTRY, PRIM, TESTS = range(10)
BEST, BEST_X, BEST_Y, CODE, I32_ROWS = range(10, 15)
# float64: what leads from s to t, limits, the shear of the exact test; bounds of the best hit's t.
SCALE, Z, GZ, T_NEAR, T_FAR, SHEAR_X, SHEAR_Y, SHEAR_Z, LOW, HIGH, F64_ROWS = range(11)

# What a worker counts, int64: of each stage the vectors that it went through and the lanes of them
# that were at work. A step reads the pyramid; a pass leaves a pixel that has been looked at.
# REFILLS are lanes given a ray, RESTS lists gone through to their end. As the fields of MarchWork.
N_STEP_VECTORS, N_STEPS, N_PASSES, N_REFILLS, N_LOOK_VECTORS, N_LOOKS = range(6)
N_ENTRY_VECTORS, N_ENTRIES, N_RESTS, N_PLANE_VECTORS, N_PLANES = range(6, 11)
N_TEST_VECTORS, N_TESTS, COUNTERS = range(11, 14)

# What a busy lane gathers, for those who reckon what a march must read: numbers of the arrays of
# the view and the scene, and rows of slots (one of a test's is read by `look`, those of hits are
# left out). tests/unit/test_certified_simd.py counts them in the sources of the stages.
CELLS_A_STEP, ROWS_A_REFILL = 1, 14
NUMBERS_AN_ENTRY, NUMBERS_A_REST, NUMBERS_A_PLANE, ROWS_A_LOOK = 2, 1, 6, 16
NUMBERS_A_TEST, ROWS_A_TEST = 9, 13

PASSED = -1
"""Level of a ray that nothing in its pixel stops any more."""
ARRIVED = -1
"""Result of a ray that has come to its end, or to its hit."""

F32 = np.float32
I32 = np.int32
INFINITY = np.inf


@inlined
def row_of(m, k, x, y, z):
    """Return row k of a 3x3 matrix times a vector."""
    return m[k, 0] * x + m[k, 1] * y + m[k, 2] * z


@inlined
def finite(x):
    """Return where x is neither infinite nor NaN."""
    return simd.absolute(x) < INFINITY


@inlined
def leave_axis(t_exit, o, d, low, high):
    """Return t_exit drawn in to where a ray leaves low..high along an axis; -inf: never inside."""
    edge = simd.select(d > 0.0, simd.f64(high), simd.f64(low))
    at = simd.minimum((edge - o) / d, t_exit)
    outside = ~((o >= low) & (o <= high))
    return simd.select(d == 0.0, simd.select(outside, -INFINITY, t_exit), at)


@inlined
def slope_of(delta):
    """Return (slope, 1 / slope) of an axis in float32, both 0 for tiny slopes."""
    slope = simd.to_f32(delta)
    tiny = simd.absolute(delta) < NO_SLOPE
    return simd.select(tiny, F32(0.0), slope), simd.select(tiny, F32(0.0), F32(1.0) / slope)


@kernel
def set_up(index, live, slot, rays, size, box, slots_f, slots_i, slots_d, how_out, free_out):
    """Fill slots from `slot` on with the rays index (lanes) of `live` that can be walked.

    Return their number. The statuses of the other rays go to how_out (W,) int32, -1 for walked
    ones, and the t that they are free up to goes to free_out (W,) float32.
    """
    origin, direction, t_nears, t_fars = rays
    width, height = size
    m, eye, near, spread, low, high = box
    at = index * I32(3)
    ofx = simd.gather(origin, at, live, F32(0.0))
    ofy = simd.gather(origin, at + I32(1), live, F32(0.0))
    ofz = simd.gather(origin, at + I32(2), live, F32(0.0))
    dfx = simd.gather(direction, at, live, F32(0.0))
    dfy = simd.gather(direction, at + I32(1), live, F32(0.0))
    dfz = simd.gather(direction, at + I32(2), live, F32(0.0))
    start = simd.to_f64(simd.gather(t_nears, index, live, F32(0.0)))
    stop = simd.to_f64(simd.gather(t_fars, index, live, F32(0.0)))
    ox, oy, oz = simd.to_f64(ofx), simd.to_f64(ofy), simd.to_f64(ofz)
    dx, dy, dz = simd.to_f64(dfx), simd.to_f64(dfy), simd.to_f64(dfz)

    # screen_ray
    length = dx * dx + dy * dy + dz * dz
    valid = finite(ox + oy + oz) & finite(length) & (length > 0.0) & (start < INFINITY)
    valid = valid & (stop >= start) & (start <= INFINITY)
    px, py, pz = ox + start * dx - eye[0], oy + start * dy - eye[1], oz + start * dz - eye[2]
    qx, qy, z = row_of(m, 0, px, py, pz), row_of(m, 1, px, py, pz), row_of(m, 2, px, py, pz)
    in_front = valid & (z >= near)
    x, y = qx / z, qy / z
    placed = in_front & (x >= 0.0) & (x <= width) & (y >= 0.0) & (y <= height)
    gx, gy, gz = row_of(m, 0, dx, dy, dz), row_of(m, 1, dx, dy, dz), row_of(m, 2, dx, dy, dz)
    depth = near / z
    delta_x, delta_y, delta_z = gx - x * gz, gy - y * gz, -depth * gz
    ahead = simd.select(gz > 0.0, 1.0 / gz, INFINITY)
    s_end = simd.select(gz < 0.0, (near - z) / (gz * near), ahead)
    how = simd.select(gz < 0.0, simd.i32(NEAR), simd.i32(MISS))
    side = (simd.select(delta_x > 0.0, simd.f64(width), simd.f64(0.0)) - x) / delta_x
    sooner = (delta_x != 0.0) & (side < s_end)
    s_end = simd.select(sooner, side, s_end)
    how = simd.select(sooner, I32(OFFSCREEN), how)
    side = (simd.select(delta_y > 0.0, simd.f64(height), simd.f64(0.0)) - y) / delta_y
    sooner = (delta_y != 0.0) & (side < s_end)
    s_end = simd.select(sooner, side, s_end)
    how = simd.select(sooner, I32(OFFSCREEN), how)

    # clip_end
    t_exit = leave_axis(simd.f64(INFINITY), ox, dx, low[0], high[0])
    t_exit = leave_axis(t_exit, oy, dy, low[1], high[1])
    t_exit = leave_axis(t_exit, oz, dz, low[2], high[2])
    t_exit = simd.select(t_exit > -INFINITY, t_exit + 2.0**-40 * simd.absolute(t_exit), t_exit)
    last = simd.minimum(t_exit, stop)
    s_last = (last - start) / (z + (last - start) * gz)
    drawn = (start <= last) & (last < INFINITY) & (s_last >= 0.0) & (s_last * BEYOND < s_end)
    how = simd.select(drawn, I32(MISS), how)
    s_end = simd.select(drawn, simd.maximum(s_last, SHORTEST), s_end)
    nothing = last < start

    # trusted
    sizes_x, sizes_y, sizes_z = simd.absolute(dx), simd.absolute(dy), simd.absolute(dz)
    place = simd.absolute(ox) + start * sizes_x + abs(eye[0])
    place = simd.maximum(place, simd.absolute(oy) + start * sizes_y + abs(eye[1]))
    place = simd.maximum(place, simd.absolute(oz) + start * sizes_z + abs(eye[2]))
    motion = simd.maximum(simd.maximum(sizes_x, sizes_y), sizes_z)
    error = 2.0**-50 * spread * simd.maximum(place / z, motion * s_end)
    trusted = (error <= U / 8.0) & (s_end < INFINITY)
    walks = placed & ~nothing & trusted

    # How the others end.
    how_else = simd.select(nothing, simd.i32(MISS), simd.i32(UNDECIDED))
    how_else = simd.select(placed, how_else, simd.select(in_front, simd.i32(OFFSCREEN), I32(NEAR)))
    how_else = simd.select(valid, how_else, I32(INVALID))
    simd.store(how_out, 0, simd.select(walks, I32(-1), how_else))
    free = simd.to_f32(simd.minimum(start * (1.0 - 2.0**-22), stop))
    free = simd.select(placed, free, F32(0.0))
    simd.store(free_out, 0, simd.select(how_else == I32(MISS), simd.to_f32(stop), free))

    # The walk's float32 ray.
    scale = simd.maximum(simd.maximum(simd.absolute(delta_x), simd.absolute(delta_y)), 1.0 / s_end)
    sx, inv_x = slope_of(delta_x / scale)
    sy, inv_y = slope_of(delta_y / scale)
    x0, y0 = simd.to_f32(x), simd.to_f32(y)
    highest = simd.maximum(depth, depth + delta_z * s_end)
    z0 = simd.to_f32(depth - DEPTH_ULPS * U * highest)
    walks = walks & live
    put(slots_f, X0, slot, x0, walks)
    put(slots_f, Y0, slot, y0, walks)
    put(slots_f, Z0, slot, z0, walks)
    put(slots_f, SX, slot, sx, walks)
    put(slots_f, SY, slot, sy, walks)
    put(slots_f, SZ, slot, simd.to_f32(delta_z / scale), walks)
    put(slots_f, INV_X, slot, inv_x, walks)
    put(slots_f, INV_Y, slot, inv_y, walks)
    put(slots_f, END, slot, simd.to_f32(s_end * scale * BEYOND), walks)
    put(slots_f, Z_ERROR, slot, simd.to_f32(HIGH_ULPS * U * highest), walks)
    put(slots_i, RAY, slot, index, walks)
    cx = simd.minimum(simd.maximum(simd.to_i32(x0), I32(0)), I32(width - 1))
    cy = simd.minimum(simd.maximum(simd.to_i32(y0), I32(0)), I32(height - 1))
    put(slots_i, CX, slot, cx, walks)
    put(slots_i, CY, slot, cy, walks)
    simd.store(slots_f, S * STRIDE + slot, simd.f32(0.0))
    for row in (LEVEL, STEPS, TESTS):
        simd.store(slots_i, row * STRIDE + slot, simd.i32(0))
    for row in (PRIM, BEST, CODE):
        simd.store(slots_i, row * STRIDE + slot, simd.i32(-1))
    simd.store(slots_d, LOW * STRIDE + slot, simd.f64(INFINITY))
    put(slots_d, HIGH, slot, stop, walks)
    put(slots_i, HOW, slot, how, walks)
    put(slots_d, SCALE, slot, scale, walks)
    put(slots_d, Z, slot, z, walks)
    put(slots_d, GZ, slot, gz, walks)
    put(slots_d, T_NEAR, slot, start, walks)
    put(slots_d, T_FAR, slot, stop, walks)

    # frame: kz is the longest axis of the direction, kx and ky are the two that follow it.
    second = simd.absolute(dfy) > simd.absolute(dfx)
    longest = simd.maximum(simd.absolute(dfx), simd.absolute(dfy))
    third = simd.absolute(dfz) > longest
    kz = simd.select(third, simd.i32(2), simd.select(second, simd.i32(1), simd.i32(0)))
    put(slots_i, KZ, slot, kz, walks)
    put(slots_f, OX, slot, simd.select(third, ofx, simd.select(second, ofz, ofy)), walks)
    put(slots_f, OY, slot, simd.select(third, ofy, simd.select(second, ofx, ofz)), walks)
    put(slots_f, OZ, slot, simd.select(third, ofz, simd.select(second, ofy, ofx)), walks)
    along = simd.select(third, dz, simd.select(second, dy, dx))
    across = simd.select(third, dx, simd.select(second, dz, dy))
    put(slots_d, SHEAR_X, slot, across / along, walks)
    across = simd.select(third, dy, simd.select(second, dx, dz))
    put(slots_d, SHEAR_Y, slot, across / along, walks)
    put(slots_d, SHEAR_Z, slot, 1.0 / along, walks)
    return simd.count(walks)


@inlined
def put(rows, row, slot, v, m):
    """Write the lanes of m to a row, one slot after the other."""
    simd.store(rows, row * STRIDE + slot, simd.compress(v, m))


@inlined
def edge_at(cell, level, start, inv):
    """Return the s at which lanes reach an edge of a cell; infinity where they never do."""
    at = (simd.to_f32(cell << level) - start) * inv
    return simd.select(inv == F32(0.0), F32(INFINITY), at)


@inlined
def corner(corners, at, kx, ky, kz, ox, oy, oz, m):
    """Return a vertex of triangles relative to the rays' origins, along their axes."""
    z = simd.to_f64(simd.gather(corners, at + kz, m, F32(0.0))) - oz
    x = simd.to_f64(simd.gather(corners, at + kx, m, F32(0.0))) - ox
    y = simd.to_f64(simd.gather(corners, at + ky, m, F32(0.0))) - oy
    return x, y, z


@inlined
def largest(x, y, z):
    """Return the largest absolute value of three."""
    return simd.maximum(simd.maximum(simd.absolute(x), simd.absolute(y)), simd.absolute(z))


@inlined
def test_primitives(prim, m, corners, kz, ox, oy, oz, shear_x, shear_y, shear_z, t_near, t_far):
    """Return (missed, hit, lowest t, highest t) of lanes m; neither means undecided.

    As `hybrid_rt.kernels.techniques.certified.scalar.test_primitive`. corners (F * 9,) float32.
    """
    kx = simd.select(kz == I32(2), simd.i32(0), kz + I32(1))
    ky = simd.select(kx == I32(2), simd.i32(0), kx + I32(1))
    at = prim * I32(9)
    x, y, z = corner(corners, at, kx, ky, kz, ox, oy, oz, m)
    r = largest(x, y, z)
    ax, ay, at_ = x - shear_x * z, y - shear_y * z, shear_z * z
    x, y, z = corner(corners, at + I32(3), kx, ky, kz, ox, oy, oz, m)
    r = simd.maximum(r, largest(x, y, z))
    bx, by, bt = x - shear_x * z, y - shear_y * z, shear_z * z
    x, y, z = corner(corners, at + I32(6), kx, ky, kz, ox, oy, oz, m)
    r = simd.maximum(r, largest(x, y, z))
    cx, cy, ct = x - shear_x * z, y - shear_y * z, shear_z * z

    rounding = 8.0 * E * largest(at_, bt, ct)
    latest = simd.maximum(simd.maximum(at_, bt), ct) + rounding
    soonest = simd.minimum(simd.minimum(at_, bt), ct) - rounding
    missed = (latest < t_near) | (soonest > t_far)
    wa = cx * by - cy * bx
    wb = ax * cy - ay * cx
    wc = bx * ay - by * ax
    size = simd.absolute(ax) + simd.absolute(ay) + simd.absolute(bx) + simd.absolute(by)
    size = size + simd.absolute(cx) + simd.absolute(cy)
    slack = 16.0 * E * r * size + 64.0 * (E * r) * (E * r)
    positive = (wa > slack) | (wb > slack) | (wc > slack)
    negative = (wa < -slack) | (wb < -slack) | (wc < -slack)
    missed = missed | (positive & negative)
    sure = (simd.absolute(wa) > slack) & (simd.absolute(wb) > slack) & (simd.absolute(wc) > slack)
    whole = wa + wb + wc
    t = (wa * at_ + wb * bt + wc * ct) / whole
    spread = simd.absolute(at_ - t) + simd.absolute(bt - t) + simd.absolute(ct - t)
    error = slack * spread / (simd.absolute(whole) - 3.0 * slack) + rounding
    low, high = t - error, t + error
    missed = missed | (sure & ((high < t_near) | (low > t_far)))
    hit = sure & ~missed & (low >= t_near) & (high <= t_far)
    return missed, hit, low, high


@inlined
def at(rows, row, slot, m):
    """Return a row at the slots of lanes m."""
    return simd.gather(rows, slot + I32(row * STRIDE), m, 0)


@inlined
def leave(rows, row, slot, v, m):
    """Write lanes m to their slots of a row."""
    simd.scatter(rows, slot + I32(row * STRIDE), v, m)


@inlined
def append(queue, many, slot, m):
    """Put the slots of lanes m at the end of a queue; return how many there are."""
    simd.store(queue, many, simd.compress(slot, m))
    return many + simd.count(m)


@kernel
def step(
    ready, n_ready, looks, n_looks, more, slots_f, slots_i, shape, cells, bits, max_steps, work,
):  # fmt: skip
    """Walk the rays of `ready` until they end or, going to `looks`, something may be in their way.

    With `more` (others wait) a few that are still on their way may be left in `ready`. Return how
    many are in both queues.
    """
    width, height, _, top = shape
    row_bits, column_bits = bits
    none = simd.mask(False)
    zero = simd.f32(0.0)
    x0, y0, z0, sx, sy, sz = zero, zero, zero, zero, zero, zero
    inv_x, inv_y, end, s = zero, zero, zero, zero
    cx, cy, level, slot = simd.i32(0), simd.i32(0), simd.i32(0), simd.i32(0)
    code, steps = simd.i32(ARRIVED), simd.i32(0)
    active, passed, stopped, ended = none, none, none, none
    taken = 0
    vectors, walked, passes = 0, 0, 0
    while True:
        idle = W - simd.count(active)
        over = taken == n_ready
        leaving = over and idle > W - FEW and (more or n_looks > 0)
        if idle == W or leaving or (idle >= REFILL and not over):
            out = stopped | ended
            if leaving:
                out = out | active
            if simd.any_(out):
                leave(slots_f, S, slot, s, out)
                leave(slots_i, CX, slot, cx, out)
                leave(slots_i, CY, slot, cy, out)
                leave(slots_i, STEPS, slot, steps, out)
                n_looks = append(looks, n_looks, slot, stopped)
                leave(slots_i, ENTRY, slot, simd.i32(0), stopped)
                leave(slots_i, CODE, slot, code, ended)
            if leaving or over:
                work[N_STEP_VECTORS] += vectors
                work[N_STEPS] += walked
                work[N_PASSES] += passes
                work[N_REFILLS] += taken
            if leaving:
                leave(slots_i, LEVEL, slot, level, active)
                return append(ready, 0, slot, active), n_looks
            if over:
                return 0, n_looks
            stopped, ended = none, none
            fresh = ~active
            fresh = fresh & (simd.expand(simd.iota(), fresh, I32(W)) < I32(min(n_ready - taken, W)))
            slot = simd.expand(simd.load(ready, taken), fresh, slot)
            taken += simd.count(fresh)
            x0 = simd.gather(slots_f, slot + I32(X0 * STRIDE), fresh, x0)
            y0 = simd.gather(slots_f, slot + I32(Y0 * STRIDE), fresh, y0)
            z0 = simd.gather(slots_f, slot + I32(Z0 * STRIDE), fresh, z0)
            sx = simd.gather(slots_f, slot + I32(SX * STRIDE), fresh, sx)
            sy = simd.gather(slots_f, slot + I32(SY * STRIDE), fresh, sy)
            sz = simd.gather(slots_f, slot + I32(SZ * STRIDE), fresh, sz)
            inv_x = simd.gather(slots_f, slot + I32(INV_X * STRIDE), fresh, inv_x)
            inv_y = simd.gather(slots_f, slot + I32(INV_Y * STRIDE), fresh, inv_y)
            end = simd.gather(slots_f, slot + I32(END * STRIDE), fresh, end)
            s = simd.gather(slots_f, slot + I32(S * STRIDE), fresh, s)
            cx = simd.gather(slots_i, slot + I32(CX * STRIDE), fresh, cx)
            cy = simd.gather(slots_i, slot + I32(CY * STRIDE), fresh, cy)
            level = simd.gather(slots_i, slot + I32(LEVEL * STRIDE), fresh, level)
            steps = simd.gather(slots_i, slot + I32(STEPS * STRIDE), fresh, steps)
            code = simd.select(fresh, I32(ARRIVED), code)
            passed = fresh & (level == I32(PASSED))
            passes += simd.count(passed)
            level = simd.select(passed, I32(0), level)
            active = active | fresh
        lx, ly = cx >> level, cy >> level
        right, down = sx > F32(0.0), sy > F32(0.0)
        at_x = edge_at(lx + simd.to_i32(right), level, x0, inv_x)
        at_y = edge_at(ly + simd.to_i32(down), level, y0, inv_y)
        s_exit = simd.maximum(simd.minimum(simd.minimum(at_x, at_y), end), s)
        new = active & ~passed
        tired = new & (steps == I32(max_steps))
        code = simd.select(tired, I32(EXHAUSTED), code)
        ended = ended | tired
        active = active & ~tired
        new = new & ~tired
        steps = simd.select(new, steps + I32(1), steps)
        vectors += 1
        walked += simd.count(new)
        size = simd.i32(row_bits + column_bits) - (level + level)
        cell = (simd.i32(1) << size) + (ly << (simd.i32(column_bits) - level)) + lx
        near = simd.gather(cells, cell, new, F32(0.0))
        lowest = z0 + sz * simd.select(sz < F32(0.0), s_exit, s)
        blocked = new & (near > F32(0.0)) & ~(lowest > near)
        stops = blocked & (level == I32(0))
        stopped = stopped | stops
        active = active & ~stops
        level = simd.select(blocked & ~stops, level - I32(1), level)
        free = active & ~blocked
        passed = none
        s = simd.select(free, s_exit, s)
        arrived = free & (s_exit >= end)
        go = free & ~arrived
        across = at_x < at_y
        left_x, left_y = lx << level, ly << level
        last_x = left_x + (simd.i32(1) << level) - I32(1)
        last_y = left_y + (simd.i32(1) << level) - I32(1)
        next_x = simd.maximum(simd.to_i32(x0 + sx * s), simd.select(right, cx, left_x))
        next_x = simd.minimum(next_x, simd.select(sx < F32(0.0), cx, last_x))
        next_y = simd.maximum(simd.to_i32(y0 + sy * s), simd.select(down, cy, left_y))
        next_y = simd.minimum(next_y, simd.select(sy < F32(0.0), cy, last_y))
        beyond_x = simd.select(right, last_x + I32(1), left_x - I32(1))
        beyond_y = simd.select(down, last_y + I32(1), left_y - I32(1))
        cx = simd.select(go, simd.select(across, beyond_x, next_x), cx)
        cy = simd.select(go, simd.select(across, next_y, beyond_y), cy)
        off = go & ((cx < I32(0)) | (cy < I32(0)) | (cx >= I32(width)) | (cy >= I32(height)))
        code = simd.select(off, I32(OFFSCREEN), code)
        gone = arrived | off
        ended = ended | gone
        active = active & ~gone
        up = level + I32(1)
        other = ((cx >> up) != (lx >> I32(1))) | ((cy >> up) != (ly >> I32(1)))
        level = simd.select(go & other & (level < I32(top)), up, level)


@kernel
def look(
    looks, n_looks, ready, n_ready, tests, slots_f, slots_i, prim_id, nearest, rest, planes, shape,
    max_tests, work,
):  # fmt: skip
    """Go through the lists of the pixels that the rays of `looks` have come to.

    A ray goes to `tests` with a primitive that it may hit, back to `ready` if there is none left,
    or ends. Return how many are in these two queues.
    """
    width, _, length, _ = shape
    n_tests = 0
    rounds, entries, rests, plane_vectors, rows = 0, 0, 0, 0, 0
    for k in range(0, n_looks, W):
        live = simd.first(n_looks - k)
        slot = simd.load(looks, k)
        slot = simd.select(live, slot, I32(0))
        x0, y0 = at(slots_f, X0, slot, live), at(slots_f, Y0, slot, live)
        sx, sy = at(slots_f, SX, slot, live), at(slots_f, SY, slot, live)
        z0, sz = at(slots_f, Z0, slot, live), at(slots_f, SZ, slot, live)
        inv_x, inv_y = at(slots_f, INV_X, slot, live), at(slots_f, INV_Y, slot, live)
        s, end = at(slots_f, S, slot, live), at(slots_f, END, slot, live)
        cx, cy = at(slots_i, CX, slot, live), at(slots_i, CY, slot, live)
        entry = at(slots_i, ENTRY, slot, live)
        prim, best = at(slots_i, PRIM, slot, live), at(slots_i, BEST, slot, live)
        at_x = edge_at(cx + simd.to_i32(sx > F32(0.0)), simd.i32(0), x0, inv_x)
        at_y = edge_at(cy + simd.to_i32(sy > F32(0.0)), simd.i32(0), y0, inv_y)
        s_exit = simd.maximum(simd.minimum(simd.minimum(at_x, at_y), end), s)
        z_in, z_out = z0 + sz * s, z0 + sz * s_exit
        x_in, y_in, x_out, y_out = x0 + sx * s, y0 + sy * s, x0 + sx * s_exit, y0 + sy * s_exit
        z_error = at(slots_f, Z_ERROR, slot, live)
        lowest = simd.select(sz < F32(0.0), z_out, z_in)
        pixel = cy * I32(width) + cx
        seek = live
        past = simd.mask(False)
        found = prim
        while simd.any_(seek):
            full = seek & (entry == I32(length))
            if simd.any_(full):
                rests += simd.count(full)
                others = simd.gather(rest, pixel, full, F32(0.0))
                hidden = full & ~(lowest > others)
                leave(slots_i, CODE, slot, simd.i32(HIDDEN), hidden)
                past = past | (full & ~hidden)
                seek = seek & ~full
            rounds += 1
            entries += simd.count(seek)
            place = pixel * I32(length) + entry
            found = simd.gather(prim_id, place, seek, found)
            bound = simd.gather(nearest, place, seek, F32(0.0))
            beyond = seek & ((found < I32(0)) | (bound < lowest))
            past = past | beyond
            seek = seek & ~beyond
            entry = simd.select(seek, entry + I32(1), entry)
            there = seek & (found != prim) & (found != best)
            if simd.any_(there):
                plane_vectors += 1
                rows += simd.count(there)
                row = found * I32(PLANE_ROW)
                a = simd.gather(planes, row + I32(SLOPE_X), there, F32(0.0))
                b = simd.gather(planes, row + I32(SLOPE_Y), there, F32(0.0))
                c = simd.gather(planes, row + I32(DEPTH), there, F32(0.0))
                px = simd.gather(planes, row + I32(REFERENCE_X), there, F32(0.0))
                py = simd.gather(planes, row + I32(REFERENCE_Y), there, F32(0.0))
                error = simd.gather(planes, row + I32(ERROR), there, F32(0.0))
                above = z_in - (c + a * (x_in - px) + b * (y_in - py))
                then = z_out - (c + a * (x_out - px) + b * (y_out - py))
                front = simd.minimum(above, then) > error
                behind = simd.maximum(above, then) + z_error < -error
                there = there & ~(front | behind)
                if simd.any_(there):
                    seek = seek & ~there
                    done = at(slots_i, TESTS, slot, there)
                    tired = there & (done == I32(max_tests))
                    leave(slots_i, CODE, slot, simd.i32(EXHAUSTED), tired)
                    there = there & ~tired
                    leave(slots_i, TESTS, slot, done + I32(1), there)
                    leave(slots_i, PRIM, slot, found, there)
                    leave(slots_i, ENTRY, slot, entry, there)
                    n_tests = append(tests, n_tests, slot, there)
        leave(slots_i, LEVEL, slot, simd.i32(PASSED), past)
        n_ready = append(ready, n_ready, slot, past)
    work[N_LOOK_VECTORS] += -(-n_looks // W)
    work[N_LOOKS] += n_looks
    work[N_ENTRY_VECTORS] += rounds
    work[N_ENTRIES] += entries
    work[N_RESTS] += rests
    work[N_PLANE_VECTORS] += plane_vectors
    work[N_PLANES] += rows
    return n_ready, n_tests


@kernel
def test(tests, n_tests, looks, slots_f, slots_i, slots_d, corners, any_hit, work):
    """Intersect the rays of `tests` with their primitives; they go on to `looks` or end.

    Return how many are in `looks`.
    """
    n_looks = 0
    for k in range(0, n_tests, W):
        live = simd.first(n_tests - k)
        slot = simd.select(live, simd.load(tests, k), I32(0))
        prim, best = at(slots_i, PRIM, slot, live), at(slots_i, BEST, slot, live)
        t_near = at(slots_d, T_NEAR, slot, live)
        missed, hit, low, high = test_primitives(
            prim, live, corners, at(slots_i, KZ, slot, live),
            simd.to_f64(at(slots_f, OX, slot, live)), simd.to_f64(at(slots_f, OY, slot, live)),
            simd.to_f64(at(slots_f, OZ, slot, live)), at(slots_d, SHEAR_X, slot, live),
            at(slots_d, SHEAR_Y, slot, live), at(slots_d, SHEAR_Z, slot, live),
            t_near, at(slots_d, HIGH, slot, live),
        )  # fmt: skip
        # A hit that rounding may put before or after the best one is a tie.
        tie = (best >= I32(0)) & (high >= at(slots_d, LOW, slot, live))
        unsure = live & ~missed & (~hit | tie)
        leave(slots_i, CODE, slot, simd.i32(UNDECIDED), unsure)
        on = live & ~unsure
        hit = on & hit & ~missed
        if simd.any_(hit):
            leave(slots_i, BEST, slot, prim, hit)
            leave(slots_i, BEST_X, slot, at(slots_i, CX, slot, hit), hit)
            leave(slots_i, BEST_Y, slot, at(slots_i, CY, slot, hit), hit)
            leave(slots_d, LOW, slot, low, hit)
            leave(slots_d, HIGH, slot, high, hit)
            if any_hit:
                leave(slots_i, CODE, slot, simd.i32(HIT), hit)
                on = on & ~hit
            else:
                along = high - t_near
                at_hit = along / (at(slots_d, Z, slot, hit) + along * at(slots_d, GZ, slot, hit))
                cut = simd.to_f32(at_hit * at(slots_d, SCALE, slot, hit) * BEYOND)
                # at_hit is negative behind the eye
                sooner = hit & (at_hit >= 0.0)
                end = at(slots_f, END, slot, sooner)
                leave(slots_f, END, slot, simd.minimum(cut, end), sooner)
        n_looks = append(looks, n_looks, slot, on)
    work[N_TEST_VECTORS] += -(-n_tests // W)
    work[N_TESTS] += n_tests
    return n_looks


@kernel
def walk(
    many, slots_f, slots_i, slots_d, ready, looks, tests, prim_id, nearest, rest, planes,
    shape, cells, bits, corners, max_steps, max_tests, any_hit, work,
):  # fmt: skip
    """March the rays of slots 0..many-1 to their ends; what it took is added to work (COUNTERS,).

    prim_id, nearest (H * W * K,), rest (H * W,); cells and bits: a pyramid and the two logarithms
    of its size; ready, looks, tests: scratch (STRIDE,) int32.
    """
    for k in range(many):
        ready[k] = k
    n_ready, n_looks = many, 0
    while n_ready > 0 or n_looks > 0:
        n_ready, n_looks = step(
            ready, n_ready, looks, n_looks, n_looks > 0, slots_f, slots_i, shape, cells, bits,
            max_steps, work,
        )  # fmt: skip
        n_ready, n_tests = look(
            looks, n_looks, ready, n_ready, tests, slots_f, slots_i, prim_id, nearest, rest,
            planes, shape, max_tests, work,
        )  # fmt: skip
        n_looks = test(tests, n_tests, looks, slots_f, slots_i, slots_d, corners, any_hit, work)


@kernel
def write(many, slots_f, slots_i, slots_d, out):
    """Write the results of slots 0..many-1 to the rows of the outputs."""
    status, resolved, pixel, prim_id, t, t_free, steps = out
    for k in range(0, many, W):
        live = simd.first(many - k)
        i = simd.load(slots_i, RAY * STRIDE + k)
        s = simd.load(slots_f, S * STRIDE + k)
        end = simd.load(slots_f, END * STRIDE + k)
        code = simd.load(slots_i, CODE * STRIDE + k)
        best = simd.load(slots_i, BEST * STRIDE + k)
        start = simd.load(slots_d, T_NEAR * STRIDE + k)
        stop = simd.load(slots_d, T_FAR * STRIDE + k)
        z = simd.load(slots_d, Z * STRIDE + k)
        gz = simd.load(slots_d, GZ * STRIDE + k)
        scale = simd.load(slots_d, SCALE * STRIDE + k)
        low = simd.load(slots_d, LOW * STRIDE + k)
        high = simd.load(slots_d, HIGH * STRIDE + k)
        arrived = code == I32(ARRIVED)
        along = high - start
        at_hit = along / (z + along * gz)
        found = best >= I32(0)
        reached = found & (at_hit >= 0.0) & (simd.to_f32(at_hit * scale * BEYOND) <= end)
        how = simd.load(slots_i, HOW * STRIDE + k)
        how = simd.select(found & (how == I32(MISS)), I32(UNDECIDED), how)
        code = simd.select(arrived, simd.select(reached, I32(HIT), how), code)
        hit = code == I32(HIT)
        miss = code == I32(MISS)
        # ray_t, rounded down: what is proven is proven up to here at least.
        s_free = simd.to_f64(s) / scale / BEYOND
        below = 1.0 - s_free * gz
        free = simd.select(below <= 0.0, INFINITY, start + s_free * z / below)
        free = simd.select(miss, stop, simd.minimum(free * (1.0 - 2.0**-22), stop))
        middle = simd.select(hit, 0.5 * (low + high), INFINITY)
        simd.scatter(prim_id, i, simd.select(hit, best, I32(-1)), live)
        simd.scatter(t, i, simd.to_f32(middle), live)
        simd.scatter(t_free, i, simd.to_f32(free), live)
        simd.scatter(steps, i, simd.load(slots_i, STEPS * STRIDE + k), live)
        x = simd.select(hit, simd.load(slots_i, BEST_X * STRIDE + k), I32(-1))
        y = simd.select(hit, simd.load(slots_i, BEST_Y * STRIDE + k), I32(-1))
        simd.scatter(pixel, i + i, x, live)
        simd.scatter(pixel, i + i + I32(1), y, live)
        simd.scatter(status, i, code, live)
        simd.scatter(resolved, i, hit | miss, live)


@kernel
def march_some(
    order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits, corners,
    max_steps, max_tests, any_hit, slots_f, slots_i, slots_d, ready, looks, tried, out, work,
):  # fmt: skip
    """March the rays order[:many]. `order` has W more rows than are used."""
    how = np.empty(W, np.int32)
    free = np.empty(W, np.float32)
    filled = 0
    for k in range(0, many, W):
        placed = set_up(
            simd.load(order, k), simd.first(many - k), filled, rays, size, box,
            slots_f, slots_i, slots_d, how, free,
        )  # fmt: skip
        filled += placed
        if placed < min(W, many - k):
            for lane in range(min(W, many - k)):
                if how[lane] >= 0:
                    unmarched(order[k + lane], how[lane], free[lane], out)
        if filled > BATCH - W or k + W >= many:
            walk(
                filled, slots_f, slots_i, slots_d, ready, looks, tried,
                prim_id, nearest, rest, planes, shape, cells, bits, corners,
                max_steps, max_tests, any_hit, work,
            )  # fmt: skip
            write(filled, slots_f, slots_i, slots_d, out)
            filled = 0


@inlined
def unmarched(i, how, free, out):
    """Write the row of a ray that was not walked."""
    status, resolved, pixel, prim_id, t, t_free, steps = out
    status[i] = how
    resolved[i] = how == MISS
    pixel[i, 0], pixel[i, 1] = -1, -1
    prim_id[i] = -1
    t[i] = np.inf
    steps[i] = 0
    t_free[i] = free


CHUNK = 1024
GROUP = 16


@parallel_kernel
def march(
    workers, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits, corners,
    max_steps, max_tests, any_hit, probes, out, work,
):  # fmt: skip
    """March rays (N, 3); outputs (N,), work (workers, COUNTERS).

    Of each GROUP of rays `probes` are marched first, and the others only if one of these was
    resolved.
    """
    count = len(rays[2])
    taken = np.zeros(1, np.int64)
    for worker in prange(workers):
        slots_f = np.zeros(F32_ROWS * STRIDE, np.float32)
        slots_i = np.zeros(I32_ROWS * STRIDE, np.int32)
        slots_d = np.zeros(F64_ROWS * STRIDE, np.float64)
        ready = np.zeros(STRIDE, np.int32)
        looks = np.zeros(STRIDE, np.int32)
        tried = np.zeros(STRIDE, np.int32)
        order = np.zeros(CHUNK + W, np.int32)
        resolved = out[1]
        apart = GROUP // probes
        first = fetch_add(taken.ctypes.data, CHUNK)
        while first < count:
            last = min(count, first + CHUNK)
            many = 0
            for i in range(first + apart // 2, last, apart):
                order[many] = i
                many += 1
            march_some(
                order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits,
                corners, max_steps, max_tests, any_hit,
                slots_f, slots_i, slots_d, ready, looks, tried, out, work[worker],
            )  # fmt: skip
            many = 0
            for group in range(first, last, GROUP):
                end = min(group + GROUP, last)
                hopeful = group + apart // 2 >= end
                for i in range(group + apart // 2, end, apart):
                    hopeful |= resolved[i]
                for i in range(group, end):
                    if (i - group) % apart == apart // 2:
                        continue
                    if hopeful:
                        order[many] = i
                        many += 1
                    else:
                        unmarched(i, SKIPPED, F32(0.0), out)
            march_some(
                order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits,
                corners, max_steps, max_tests, any_hit,
                slots_f, slots_i, slots_d, ready, looks, tried, out, work[worker],
            )  # fmt: skip
            first = fetch_add(taken.ctypes.data, CHUNK)
