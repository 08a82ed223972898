"""Look through the lists of the pixels that rays have come to, and test primitives."""

from __future__ import annotations

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import called, inlined
from hybrid_rt.kernels.raster.lists_planes import (
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
    E,
)
from hybrid_rt.kernels.techniques.certified.slots import (
    AT_W,
    BEST,
    BEST_X,
    BEST_Y,
    CODE,
    CX,
    CY,
    END,
    ENTRY,
    F32,
    GW,
    HIGH,
    I32,
    INV_X,
    INV_Y,
    KZ,
    LEVEL,
    LOW,
    N_ENTRIES,
    N_ENTRY_VECTORS,
    N_LOOK_VECTORS,
    N_LOOKS,
    N_PLANE_VECTORS,
    N_PLANES,
    N_RESTS,
    N_TEST_VECTORS,
    N_TESTS,
    OX,
    OY,
    OZ,
    PASSED,
    PRIM,
    SCALE,
    SHEAR_X,
    SHEAR_Y,
    SHEAR_Z,
    SX,
    SY,
    SZ,
    T_NEAR,
    TESTS,
    X0,
    Y0,
    Z0,
    Z_ERROR,
    S,
    W,
    append,
    at,
    edge_at,
    leave,
)
from hybrid_rt.kernels.techniques.screen import (
    EXHAUSTED,
    HIDDEN,
    HIT,
    UNDECIDED,
)


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


@called
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


@called
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
                at_hit = along / (at(slots_d, AT_W, slot, hit) + along * at(slots_d, GW, slot, hit))
                cut = simd.to_f32(at_hit * at(slots_d, SCALE, slot, hit) * BEYOND)
                # at_hit is negative behind the eye
                sooner = hit & (at_hit >= 0.0)
                end = at(slots_f, END, slot, sooner)
                leave(slots_f, END, slot, simd.minimum(cut, end), sooner)
        n_looks = append(looks, n_looks, slot, on)
    work[N_TEST_VECTORS] += -(-n_tests // W)
    work[N_TESTS] += n_tests
    return n_looks
