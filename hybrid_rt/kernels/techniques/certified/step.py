"""Walk the rays that are ready, a ray in each lane."""

from __future__ import annotations

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import called
from hybrid_rt.kernels.techniques.certified.slots import (
    ARRIVED,
    CODE,
    CX,
    CY,
    END,
    ENTRY,
    F32,
    I32,
    INV_X,
    INV_Y,
    LEVEL,
    N_PASSES,
    N_REFILLS,
    N_STEP_VECTORS,
    N_STEPS,
    PASSED,
    STEPS,
    STRIDE,
    SX,
    SY,
    SZ,
    X0,
    Y0,
    Z0,
    S,
    W,
    append,
    edge_at,
    leave,
)
from hybrid_rt.kernels.techniques.screen import (
    EXHAUSTED,
    OFFSCREEN,
)

REFILL = 6
"""Free lanes before rays are put in."""
FEW = 8
"""Lanes with which stepping goes on though other stages have work."""


@called
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
