"""The certified march with a ray in every lane: the answers of `hybrid_rt.kernels.certified`.

A *batch* of rays is set up into rows of plain arrays, *slots*; lanes walk them. In each turn of the
loop all lanes that can take a step take it together. A lane that comes to a pixel with something in
the ray's way waits until a few do, and then the next primitive of each is tested together. A lane
whose ray has ended leaves its result in the slot and is given the next slot, once a few are free.
At last the results of a batch are written to the rows of the outputs.

Every lane computes what `hybrid_rt.kernels.certified` computes, operation by operation, so both
have the same answers, ray for ray and step for step; there are the reasons and the error bounds.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import fetch_add
from hybrid_rt.kernels.certified import (
    BEYOND,
    DEPTH_ULPS,
    HIGH_ULPS,
    NO_SLOPE,
    SHORTEST,
    E,
    U,
)
from hybrid_rt.kernels.lists import (
    DEPTH,
    ERROR,
    PLANE_ROW,
    REFERENCE_X,
    REFERENCE_Y,
    SLOPE_X,
    SLOPE_Y,
)
from hybrid_rt.kernels.screen import (
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
import os
REFILL = 2
"""Free lanes before new rays are put in."""
TOGETHER = 9
LOOK = 9
"""Waiting lanes before their primitives are tested."""

W = simd.WIDTH
STRIDE = BATCH + W  # slots in a row: what is loaded past the last one is not used

# Rows of slots, float32: the ray on the screen, the s at which it ends, its origin along the axes
# of the exact test; then its result: the s up to which it is free, and the end that a hit has set.
X0, Y0, Z0, SX, SY, SZ, INV_X, INV_Y, END, Z_ERROR, OX, OY, OZ, R_S, R_END, F32_ROWS = range(16)
# int32: the ray, the pixel where it starts, the axis kz of the exact test, how it ends if it meets
# nothing; then its result: a status or ARRIVED, best hit and its pixel, steps.
RAY, CX, CY, KZ, HOW, R_CODE, R_BEST, R_X, R_Y, R_STEPS, I32_ROWS = range(11)
# float64: what leads from s to t, limits, the shear of the exact test; bounds of the best hit's t.
SCALE, Z, GZ, T_NEAR, T_FAR, SHEAR_X, SHEAR_Y, SHEAR_Z, R_LOW, R_HIGH, F64_ROWS = range(11)

# Rows of lanes that only tests use, float32: OX, OY, OZ. int32: the primitive tested first and the
# three tested last, and those rows of slots.
L_Z_ERROR, L_OX, L_OY, L_OZ, LANE_F32 = range(5)
L_KZ, L_X, L_Y, L_TESTS, LANE_I32 = range(5)
L_SCALE, L_Z, L_GZ, L_NEAR, L_SHEAR_X, L_SHEAR_Y, L_SHEAR_Z, L_LOW, L_HIGH, LANE_F64 = range(10)

ARRIVED = -1
"""Result of a ray that has come to its end, or to its hit."""

F = np.float32
I = np.int32
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
    return simd.select(tiny, F(0.0), slope), simd.select(tiny, F(0.0), F(1.0) / slope)


@kernel
def set_up(index, live, slot, rays, size, box, slots_f, slots_i, slots_d, how_out, free_out):
    """Fill slots from `slot` on with the rays index (lanes) of `live` that can be walked.

    Return their number. The statuses of the other rays go to how_out (W,) int32, -1 for walked ones,
    and the t that they are free up to goes to free_out (W,) float32.
    """
    origin, direction, t_nears, t_fars = rays
    width, height = size
    m, eye, near, spread, low, high = box
    at = index * I(3)
    ofx = simd.gather(origin, at, live, F(0.0))
    ofy = simd.gather(origin, at + I(1), live, F(0.0))
    ofz = simd.gather(origin, at + I(2), live, F(0.0))
    dfx = simd.gather(direction, at, live, F(0.0))
    dfy = simd.gather(direction, at + I(1), live, F(0.0))
    dfz = simd.gather(direction, at + I(2), live, F(0.0))
    start = simd.to_f64(simd.gather(t_nears, index, live, F(0.0)))
    stop = simd.to_f64(simd.gather(t_fars, index, live, F(0.0)))
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
    how = simd.select(sooner, I(OFFSCREEN), how)
    side = (simd.select(delta_y > 0.0, simd.f64(height), simd.f64(0.0)) - y) / delta_y
    sooner = (delta_y != 0.0) & (side < s_end)
    s_end = simd.select(sooner, side, s_end)
    how = simd.select(sooner, I(OFFSCREEN), how)

    # clip_end
    t_exit = leave_axis(simd.f64(INFINITY), ox, dx, low[0], high[0])
    t_exit = leave_axis(t_exit, oy, dy, low[1], high[1])
    t_exit = leave_axis(t_exit, oz, dz, low[2], high[2])
    t_exit = simd.select(t_exit > -INFINITY, t_exit + 2.0**-40 * simd.absolute(t_exit), t_exit)
    last = simd.minimum(t_exit, stop)
    s_last = (last - start) / (z + (last - start) * gz)
    drawn = (start <= last) & (last < INFINITY) & (s_last >= 0.0) & (s_last * BEYOND < s_end)
    how = simd.select(drawn, I(MISS), how)
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
    how_else = simd.select(placed, how_else, simd.select(in_front, simd.i32(OFFSCREEN), I(NEAR)))
    how_else = simd.select(valid, how_else, I(INVALID))
    simd.store(how_out, 0, simd.select(walks, I(-1), how_else))
    free = simd.to_f32(simd.minimum(start * (1.0 - 2.0**-22), stop))
    free = simd.select(placed, free, F(0.0))
    simd.store(free_out, 0, simd.select(how_else == I(MISS), simd.to_f32(stop), free))

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
    cx = simd.minimum(simd.maximum(simd.to_i32(x0), I(0)), I(width - 1))
    cy = simd.minimum(simd.maximum(simd.to_i32(y0), I(0)), I(height - 1))
    put(slots_i, CX, slot, cx, walks)
    put(slots_i, CY, slot, cy, walks)
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
def take(rows, row, slot, fresh, old):
    """Return lanes with those of `fresh` taken from a row, one slot after the other."""
    return simd.expand(simd.load(rows, row * STRIDE + slot), fresh, old)


@inlined
def edge_at(cell, level, start, inv):
    """Return the s at which lanes reach an edge of a cell; infinity where they never do."""
    at = (simd.to_f32(cell << level) - start) * inv
    return simd.select(inv == F(0.0), F(INFINITY), at)


@inlined
def corner(corners, at, kx, ky, kz, ox, oy, oz, m):
    """Return a vertex of triangles relative to the rays' origins, along their axes."""
    z = simd.to_f64(simd.gather(corners, at + kz, m, F(0.0))) - oz
    x = simd.to_f64(simd.gather(corners, at + kx, m, F(0.0))) - ox
    y = simd.to_f64(simd.gather(corners, at + ky, m, F(0.0))) - oy
    return x, y, z


@inlined
def largest(x, y, z):
    """Return the largest absolute value of three."""
    return simd.maximum(simd.maximum(simd.absolute(x), simd.absolute(y)), simd.absolute(z))


@inlined
def test_primitives(prim, m, corners, kz, ox, oy, oz, shear_x, shear_y, shear_z, t_near, t_far):
    """Return (missed, hit, lowest t, highest t) of lanes m; neither means undecided.

    As `hybrid_rt.kernels.certified.test_primitive`. corners (F * 9,) float32.
    """
    kx = simd.select(kz == I(2), simd.i32(0), kz + I(1))
    ky = simd.select(kx == I(2), simd.i32(0), kx + I(1))
    at = prim * I(9)
    x, y, z = corner(corners, at, kx, ky, kz, ox, oy, oz, m)
    r = largest(x, y, z)
    ax, ay, at_ = x - shear_x * z, y - shear_y * z, shear_z * z
    x, y, z = corner(corners, at + I(3), kx, ky, kz, ox, oy, oz, m)
    r = simd.maximum(r, largest(x, y, z))
    bx, by, bt = x - shear_x * z, y - shear_y * z, shear_z * z
    x, y, z = corner(corners, at + I(6), kx, ky, kz, ox, oy, oz, m)
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


@kernel
def walk(
    many, slots_f, slots_i, slots_d, lanes_f, lanes_i, lanes_d, prim_id, nearest, rest, planes,
    shape, cells, bits, corners, max_steps, max_tests, any_hit,
):  # fmt: skip
    """March the rays of slots 0..many-1 to their results; return the number of exact tests.

    prim_id, nearest (H * W * K,), rest (H * W,); cells and bits: a pyramid and the two logarithms of
    its size; lanes_*: scratch.
    """
    width, height, length, top = shape
    row_bits, column_bits = bits
    zero = simd.f32(0.0)
    none = simd.mask(False)
    x0, y0, z0, sx, sy, sz = zero, zero, zero, zero, zero, zero
    inv_x, inv_y, end, s = zero, zero, zero, zero
    cx, cy, level, slot = simd.i32(0), simd.i32(0), simd.i32(0), simd.i32(0)
    code, steps, entry = simd.i32(ARRIVED), simd.i32(0), simd.i32(0)
    best, prim = simd.i32(-1), simd.i32(-1)
    active, looking, testing, passed, ended = none, none, none, none, none
    taken = 0
    tests = 0
    while True:
        busy = active | looking | testing
        idle = W - simd.count(busy)
        if idle == W or (idle >= REFILL and taken < many):
            if simd.any_(ended):
                put_results(
                    ended, slot, s, end, code, steps, best, slots_f, slots_i, slots_d, lanes_i, lanes_d
                )
            fresh = ~busy & (simd.expand(simd.iota(), ~busy, I(W)) < I(min(many - taken, W)))
            x0 = take(slots_f, X0, taken, fresh, x0)
            y0 = take(slots_f, Y0, taken, fresh, y0)
            z0 = take(slots_f, Z0, taken, fresh, z0)
            sx = take(slots_f, SX, taken, fresh, sx)
            sy = take(slots_f, SY, taken, fresh, sy)
            sz = take(slots_f, SZ, taken, fresh, sz)
            inv_x = take(slots_f, INV_X, taken, fresh, inv_x)
            inv_y = take(slots_f, INV_Y, taken, fresh, inv_y)
            end = take(slots_f, END, taken, fresh, end)
            cx = take(slots_i, CX, taken, fresh, cx)
            cy = take(slots_i, CY, taken, fresh, cy)
            slot = simd.expand(simd.iota() + I(taken), fresh, slot)
            s = simd.select(fresh, F(0.0), s)
            level = simd.select(fresh, I(0), level)
            code = simd.select(fresh, I(ARRIVED), code)
            steps = simd.select(fresh, I(0), steps)
            best = simd.select(fresh, I(-1), best)
            prim = simd.select(fresh, I(-1), prim)
            take_for_tests(taken, fresh, slots_f, slots_i, slots_d, lanes_f, lanes_i, lanes_d)
            active = active | fresh
            ended = none
            taken += simd.count(fresh)
            if not simd.any_(active | looking | testing):
                break
        right, down = sx > F(0.0), sy > F(0.0)
        far_x = simd.to_i32(right)
        far_y = simd.to_i32(down)

        if simd.any_(testing) and (
            simd.count(testing) >= TOGETHER or not simd.any_(active | looking)
        ):
            tests += simd.count(testing)
            t_near = simd.load(lanes_d, L_NEAR * W)
            best_low = simd.load(lanes_d, L_LOW * W)
            missed, hit, low, high = test_primitives(
                prim, testing, corners, simd.load(lanes_i, L_KZ * W),
                simd.to_f64(simd.load(lanes_f, L_OX * W)),
                simd.to_f64(simd.load(lanes_f, L_OY * W)),
                simd.to_f64(simd.load(lanes_f, L_OZ * W)),
                simd.load(lanes_d, L_SHEAR_X * W), simd.load(lanes_d, L_SHEAR_Y * W),
                simd.load(lanes_d, L_SHEAR_Z * W), t_near, simd.load(lanes_d, L_HIGH * W),
            )  # fmt: skip
            # A hit that rounding may put before or after the best one is a tie.
            unsure = testing & ~missed & (~hit | ((best >= I(0)) & (high >= best_low)))
            code = simd.select(unsure, I(UNDECIDED), code)
            ended = ended | unsure
            hit = testing & hit & ~missed & ~unsure
            looking = looking | (testing & ~unsure)
            testing = none
            if simd.any_(hit):
                best = simd.select(hit, prim, best)
                simd.store_masked(lanes_i, L_X * W, cx, hit)
                simd.store_masked(lanes_i, L_Y * W, cy, hit)
                simd.store_masked(lanes_d, L_LOW * W, low, hit)
                simd.store_masked(lanes_d, L_HIGH * W, high, hit)
                if any_hit:
                    code = simd.select(hit, I(HIT), code)
                    ended = ended | hit
                    looking = looking & ~hit
                else:
                    along = high - t_near
                    at_hit = along / (
                        simd.load(lanes_d, L_Z * W) + along * simd.load(lanes_d, L_GZ * W)
                    )
                    cut = simd.to_f32(at_hit * simd.load(lanes_d, L_SCALE * W) * BEYOND)
                    # at_hit is negative behind the eye
                    end = simd.select(hit & (at_hit >= 0.0), simd.minimum(cut, end), end)

        if simd.any_(looking) and (simd.count(looking) >= LOOK or not simd.any_(active)):
            at_x = edge_at(cx + far_x, simd.i32(0), x0, inv_x)
            at_y = edge_at(cy + far_y, simd.i32(0), y0, inv_y)
            s_exit = simd.maximum(simd.minimum(simd.minimum(at_x, at_y), end), s)
            z_in, z_out = z0 + sz * s, z0 + sz * s_exit
            lowest = simd.select(sz < F(0.0), z_out, z_in)
            pixel = cy * I(width) + cx
            at = pixel * I(length) + entry
            full = looking & (entry == I(length))
            there = looking & ~full
            found = simd.gather(prim_id, at, there, I(-1))
            bound = simd.gather(nearest, at, there, F(0.0))
            past = there & ((found < I(0)) | (bound < lowest))
            there = there & ~past
            if simd.any_(full):
                others = simd.gather(rest, pixel, full, F(0.0))
                hidden = full & ~(lowest > others)
                code = simd.select(hidden, I(HIDDEN), code)
                ended = ended | hidden
                looking = looking & ~hidden
                past = past | (full & ~hidden)
            looking = looking & ~past
            active = active | past
            passed = passed | past
            entry = simd.select(there, entry + I(1), entry)
            there = there & (found != prim) & (found != best)
            if simd.any_(there):
                row = found * I(PLANE_ROW)
                a = simd.gather(planes, row + I(SLOPE_X), there, F(0.0))
                b = simd.gather(planes, row + I(SLOPE_Y), there, F(0.0))
                c = simd.gather(planes, row + I(DEPTH), there, F(0.0))
                px = simd.gather(planes, row + I(REFERENCE_X), there, F(0.0))
                py = simd.gather(planes, row + I(REFERENCE_Y), there, F(0.0))
                error = simd.gather(planes, row + I(ERROR), there, F(0.0))
                above = z_in - (c + a * (x0 + sx * s - px) + b * (y0 + sy * s - py))
                then = z_out - (c + a * (x0 + sx * s_exit - px) + b * (y0 + sy * s_exit - py))
                front = simd.minimum(above, then) > error
                behind = simd.maximum(above, then) + simd.load(lanes_f, L_Z_ERROR * W) < -error
                there = there & ~(front | behind)
                done = simd.load(lanes_i, L_TESTS * W)
                tired = there & (done == I(max_tests))
                code = simd.select(tired, I(EXHAUSTED), code)
                ended = ended | tired
                looking = looking & ~tired
                there = there & ~tired
                simd.store_masked(lanes_i, L_TESTS * W, done + I(1), there)
                prim = simd.select(there, found, prim)
                testing = testing | there
                looking = looking & ~there

        # One step of every lane that can take one.
        lx, ly = cx >> level, cy >> level
        at_x = edge_at(lx + far_x, level, x0, inv_x)
        at_y = edge_at(ly + far_y, level, y0, inv_y)
        s_exit = simd.maximum(simd.minimum(simd.minimum(at_x, at_y), end), s)
        new = active & ~passed
        tired = new & (steps == I(max_steps))
        code = simd.select(tired, I(EXHAUSTED), code)
        ended = ended | tired
        active = active & ~tired
        new = new & ~tired
        steps = simd.select(new, steps + I(1), steps)
        size = simd.i32(row_bits + column_bits) - (level + level)
        cell = (simd.i32(1) << size) + (ly << (simd.i32(column_bits) - level)) + lx
        near = simd.gather(cells, cell, new, F(0.0))
        lowest = z0 + sz * simd.select(sz < F(0.0), s_exit, s)
        blocked = new & (near > F(0.0)) & ~(lowest > near)
        stops = blocked & (level == I(0))
        entry = simd.select(stops, I(0), entry)
        looking = looking | stops
        active = active & ~stops
        level = simd.select(blocked & ~stops, level - I(1), level)
        free = active & ~blocked
        passed = none
        s = simd.select(free, s_exit, s)
        arrived = free & (s_exit >= end)
        go = free & ~arrived
        across = at_x < at_y
        left_x, left_y = lx << level, ly << level
        last_x = left_x + (simd.i32(1) << level) - I(1)
        last_y = left_y + (simd.i32(1) << level) - I(1)
        next_x = simd.maximum(simd.to_i32(x0 + sx * s), simd.select(right, cx, left_x))
        next_x = simd.minimum(next_x, simd.select(sx < F(0.0), cx, last_x))
        next_y = simd.maximum(simd.to_i32(y0 + sy * s), simd.select(down, cy, left_y))
        next_y = simd.minimum(next_y, simd.select(sy < F(0.0), cy, last_y))
        beyond_x = simd.select(right, last_x + I(1), left_x - I(1))
        beyond_y = simd.select(down, last_y + I(1), left_y - I(1))
        cx = simd.select(go, simd.select(across, beyond_x, next_x), cx)
        cy = simd.select(go, simd.select(across, next_y, beyond_y), cy)
        off = go & ((cx < I(0)) | (cy < I(0)) | (cx >= I(width)) | (cy >= I(height)))
        code = simd.select(off, I(OFFSCREEN), code)
        gone = arrived | off
        ended = ended | gone
        active = active & ~gone
        up = level + I(1)
        other = ((cx >> up) != (lx >> I(1))) | ((cy >> up) != (ly >> I(1)))
        level = simd.select(go & other & (level < I(top)), up, level)
    return tests


@inlined
def take_for_tests(taken, fresh, slots_f, slots_i, slots_d, lanes_f, lanes_i, lanes_d):
    """Bring what only exact tests need from slots to the lanes of `fresh`."""
    for row in range(LANE_F32):
        simd.store(
            lanes_f, row * W, take(slots_f, Z_ERROR + row, taken, fresh, simd.load(lanes_f, row * W))
        )
    simd.store(
        lanes_i, L_KZ * W, take(slots_i, KZ, taken, fresh, simd.load(lanes_i, L_KZ * W))
    )
    simd.store_masked(lanes_i, L_TESTS * W, simd.i32(0), fresh)
    for row in range(L_NEAR + 1):
        v = take(slots_d, SCALE + row, taken, fresh, simd.load(lanes_d, row * W))
        simd.store(lanes_d, row * W, v)
    for row in range(3):
        v = take(slots_d, SHEAR_X + row, taken, fresh, simd.load(lanes_d, (L_SHEAR_X + row) * W))
        simd.store(lanes_d, (L_SHEAR_X + row) * W, v)
    simd.store_masked(lanes_d, L_LOW * W, simd.f64(INFINITY), fresh)
    v = take(slots_d, T_FAR, taken, fresh, simd.load(lanes_d, L_HIGH * W))
    simd.store(lanes_d, L_HIGH * W, v)


@inlined
def put_results(ended, slot, s, end, code, steps, best, slots_f, slots_i, slots_d, lanes_i, lanes_d):
    """Leave the results of the lanes of `ended` in their slots."""
    simd.scatter(slots_f, slot + I(R_S * STRIDE), s, ended)
    simd.scatter(slots_f, slot + I(R_END * STRIDE), end, ended)
    simd.scatter(slots_i, slot + I(R_CODE * STRIDE), code, ended)
    simd.scatter(slots_i, slot + I(R_STEPS * STRIDE), steps, ended)
    left = simd.bits(ended & (best >= I(0)))
    simd.scatter(slots_i, slot + I(R_BEST * STRIDE), best, ended)
    while left:
        lane = simd.lowest(left)
        left &= left - 1
        at = simd.extract(slot, lane)
        slots_i[R_X * STRIDE + at] = lanes_i[L_X * W + lane]
        slots_i[R_Y * STRIDE + at] = lanes_i[L_Y * W + lane]
        slots_d[R_LOW * STRIDE + at] = lanes_d[L_LOW * W + lane]
        slots_d[R_HIGH * STRIDE + at] = lanes_d[L_HIGH * W + lane]


@kernel
def write(many, slots_f, slots_i, slots_d, out):
    """Write the results of slots 0..many-1 to the rows of the outputs."""
    status, resolved, pixel, prim_id, t, t_free, steps = out
    for k in range(0, many, W):
        live = simd.first(many - k)
        i = simd.load(slots_i, RAY * STRIDE + k)
        s = simd.load(slots_f, R_S * STRIDE + k)
        end = simd.load(slots_f, R_END * STRIDE + k)
        code = simd.load(slots_i, R_CODE * STRIDE + k)
        best = simd.load(slots_i, R_BEST * STRIDE + k)
        start = simd.load(slots_d, T_NEAR * STRIDE + k)
        stop = simd.load(slots_d, T_FAR * STRIDE + k)
        z = simd.load(slots_d, Z * STRIDE + k)
        gz = simd.load(slots_d, GZ * STRIDE + k)
        scale = simd.load(slots_d, SCALE * STRIDE + k)
        low = simd.load(slots_d, R_LOW * STRIDE + k)
        high = simd.load(slots_d, R_HIGH * STRIDE + k)
        arrived = code == I(ARRIVED)
        along = high - start
        at_hit = along / (z + along * gz)
        found = best >= I(0)
        reached = found & (at_hit >= 0.0) & (simd.to_f32(at_hit * scale * BEYOND) <= end)
        how = simd.load(slots_i, HOW * STRIDE + k)
        how = simd.select(found & (how == I(MISS)), I(UNDECIDED), how)
        code = simd.select(arrived, simd.select(reached, I(HIT), how), code)
        hit = code == I(HIT)
        miss = code == I(MISS)
        # ray_t, rounded down: what is proven is proven up to here at least.
        s_free = simd.to_f64(s) / scale / BEYOND
        below = 1.0 - s_free * gz
        free = simd.select(below <= 0.0, INFINITY, start + s_free * z / below)
        free = simd.select(miss, stop, simd.minimum(free * (1.0 - 2.0**-22), stop))
        middle = simd.select(hit, 0.5 * (low + high), INFINITY)
        simd.scatter(prim_id, i, simd.select(hit, best, I(-1)), live)
        simd.scatter(t, i, simd.to_f32(middle), live)
        simd.scatter(t_free, i, simd.to_f32(free), live)
        simd.scatter(steps, i, simd.load(slots_i, R_STEPS * STRIDE + k), live)
        x = simd.select(hit, simd.load(slots_i, R_X * STRIDE + k), I(-1))
        y = simd.select(hit, simd.load(slots_i, R_Y * STRIDE + k), I(-1))
        simd.scatter(pixel, i + i, x, live)
        simd.scatter(pixel, i + i + I(1), y, live)
        simd.scatter(status, i, code, live)
        simd.scatter(resolved, i, hit | miss, live)


@kernel
def march_some(
    order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits, corners,
    max_steps, max_tests, any_hit, slots_f, slots_i, slots_d, lanes_f, lanes_i, lanes_d, out,
):  # fmt: skip
    """March the rays order[:many]; return exact tests. order must have W more rows than are used."""
    status, resolved, pixel, prim_id_out, t, t_free, steps = out
    how = np.empty(W, np.int32)
    free = np.empty(W, np.float32)
    tests = 0
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
            tests += walk(
                filled, slots_f, slots_i, slots_d, lanes_f, lanes_i, lanes_d,
                prim_id, nearest, rest, planes, shape, cells, bits, corners,
                max_steps, max_tests, any_hit,
            )  # fmt: skip
            write(filled, slots_f, slots_i, slots_d, out)
            filled = 0
    return tests


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
    max_steps, max_tests, any_hit, probes, out, tests,
):  # fmt: skip
    """March rays (N, 3); outputs (N,), tests (workers,).

    Of each GROUP of rays `probes` are marched first, and the others only if one of these was
    resolved.
    """
    count = len(rays[2])
    taken = np.zeros(1, np.int64)
    for worker in prange(workers):
        slots_f = np.zeros(F32_ROWS * STRIDE, np.float32)
        slots_i = np.zeros(I32_ROWS * STRIDE, np.int32)
        slots_d = np.zeros(F64_ROWS * STRIDE, np.float64)
        lanes_f = np.zeros(LANE_F32 * W, np.float32)
        lanes_i = np.zeros(LANE_I32 * W, np.int32)
        lanes_d = np.zeros(LANE_F64 * W, np.float64)
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
            tests[worker] += march_some(
                order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits,
                corners, max_steps, max_tests, any_hit,
                slots_f, slots_i, slots_d, lanes_f, lanes_i, lanes_d, out,
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
                        unmarched(i, SKIPPED, F(0.0), out)
            tests[worker] += march_some(
                order, many, rays, size, box, prim_id, nearest, rest, planes, shape, cells, bits,
                corners, max_steps, max_tests, any_hit,
                slots_f, slots_i, slots_d, lanes_f, lanes_i, lanes_d, out,
            )  # fmt: skip
            first = fetch_add(taken.ctypes.data, CHUNK)
