"""Write the results of rays to the rows of the outputs."""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import called, inlined
from hybrid_rt.kernels.techniques.certified.scalar import (
    BEYOND,
)
from hybrid_rt.kernels.techniques.certified.slots import (
    ARRIVED,
    AT_W,
    BEST,
    BEST_X,
    BEST_Y,
    CODE,
    END,
    GW,
    HIGH,
    HOW,
    I32,
    INFINITY,
    LOW,
    RAY,
    SCALE,
    STEPS,
    STRIDE,
    T_FAR,
    T_NEAR,
    S,
    W,
)
from hybrid_rt.kernels.techniques.screen import (
    HIT,
    LARGEST_T,
    MISS,
    UNDECIDED,
)


@called
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
        w = simd.load(slots_d, AT_W * STRIDE + k)
        gw = simd.load(slots_d, GW * STRIDE + k)
        scale = simd.load(slots_d, SCALE * STRIDE + k)
        low = simd.load(slots_d, LOW * STRIDE + k)
        high = simd.load(slots_d, HIGH * STRIDE + k)
        arrived = code == I32(ARRIVED)
        along = high - start
        at_hit = along / (w + along * gw)
        found = best >= I32(0)
        reached = found & (at_hit >= 0.0) & (simd.to_f32(at_hit * scale * BEYOND) <= end)
        how = simd.load(slots_i, HOW * STRIDE + k)
        how = simd.select(found & (how == I32(MISS)), I32(UNDECIDED), how)
        code = simd.select(arrived, simd.select(reached, I32(HIT), how), code)
        hit = code == I32(HIT)
        miss = code == I32(MISS)
        # ray_t, rounded down: what is proven is proven up to here at least.
        s_free = simd.to_f64(s) / scale / BEYOND
        below = 1.0 - s_free * gw
        free = simd.select(below <= 0.0, INFINITY, start + s_free * w / below)
        free = simd.select(miss, stop, simd.minimum(free * (1.0 - 2.0**-22), stop))
        middle = simd.select(hit, simd.minimum(0.5 * (low + high), LARGEST_T), INFINITY)
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
