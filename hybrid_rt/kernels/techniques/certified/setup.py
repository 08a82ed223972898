"""Set the rays of a batch up: from the world to the float32 ray that is walked on the screen."""

from __future__ import annotations

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import called, inlined
from hybrid_rt.kernels.raster.clip import mapped
from hybrid_rt.kernels.techniques.certified.scalar import (
    BEYOND,
    DEPTH_ULPS,
    HIGH_ULPS,
    NO_SLOPE,
    SHORTEST,
    U,
)
from hybrid_rt.kernels.techniques.certified.slots import (
    AT_W,
    BEST,
    CODE,
    CX,
    CY,
    END,
    F32,
    GW,
    HIGH,
    HOW,
    I32,
    INFINITY,
    INV_X,
    INV_Y,
    KZ,
    LEVEL,
    LOW,
    OX,
    OY,
    OZ,
    PRIM,
    RAY,
    SCALE,
    SHEAR_X,
    SHEAR_Y,
    SHEAR_Z,
    STEPS,
    STRIDE,
    SX,
    SY,
    SZ,
    T_FAR,
    T_NEAR,
    TESTS,
    X0,
    Y0,
    Z0,
    Z_ERROR,
    S,
    put,
)
from hybrid_rt.kernels.techniques.placing import finite
from hybrid_rt.kernels.techniques.screen import (
    BEFORE_FAR,
    INVALID,
    MISS,
    NEAR,
    OFFSCREEN,
    UNDECIDED,
)


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


@called
def set_up(index, live, slot, rays, size, box, slots_f, slots_i, slots_d, how_out, free_out):
    """Fill slots from `slot` on with the rays index (lanes) of `live` that can be walked.

    Return their number. The statuses of the other rays go to how_out (W,) int32, -1 for walked
    ones, and the t that they are free up to goes to free_out (W,) float32.
    """
    origin, direction, t_nears, t_fars = rays
    width, height = size
    m, eye, spread, deep, apart, low, high = box
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
    w, d = mapped(m, 2, px, py, pz) + m[2, 3], mapped(m, 3, px, py, pz) + m[3, 3]
    in_front = valid & (w >= d)
    x = (mapped(m, 0, px, py, pz) + m[0, 3]) / w
    y = (mapped(m, 1, px, py, pz) + m[1, 3]) / w
    depth = d / w
    placed = in_front & (x >= 0.0) & (x <= width) & (y >= 0.0) & (y <= height) & (depth > 0.0)
    gx, gy = mapped(m, 0, dx, dy, dz), mapped(m, 1, dx, dy, dz)
    gw, gd = mapped(m, 2, dx, dy, dz), mapped(m, 3, dx, dy, dz)
    delta_x, delta_y, delta_z = gx - x * gw, gy - y * gw, gd - depth * gw
    ahead, closer = gw > 0.0, ~(gw > 0.0) & (gw < gd)
    farther = ~ahead & ~closer & (gd < 0.0)
    s_end = simd.select(ahead, 1.0 / gw, INFINITY)
    s_end = simd.select(closer, (d - w) / (d * gw - w * gd), s_end)
    s_end = simd.select(farther, BEFORE_FAR * (depth / -delta_z), s_end)
    how = simd.select(closer, simd.i32(NEAR), simd.i32(MISS))
    how = simd.select(farther, I32(OFFSCREEN), how)
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
    s_last = (last - start) / (w + (last - start) * gw)
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
    error = 2.0**-50 * simd.maximum((place + apart) / w, motion * s_end)
    highest = simd.maximum(depth, depth + delta_z * s_end)
    trusted = (spread * error <= U / 8.0) & (deep * error <= U / 8.0 * highest)
    trusted = trusted & (s_end < INFINITY)
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
    put(slots_d, AT_W, slot, w, walks)
    put(slots_d, GW, slot, gw, walks)
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
