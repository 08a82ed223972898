"""Rays on the screen, a ray in each lane: from the world to start, deltas and end.

A view maps p - eye to (x w, y w, w, d) with depth = d / w, see `kernels.arrays.ViewArrays`. On the
screen a ray is ``(x, y, depth)(s) = start + s * delta`` with ``s = (t - t_near) / w(t)``: for
q(t) = M (o + t d - eye, 1) and q at t_near = (x w, y w, w, depth w),

    x(s) = x + s (qd_x - x qd_w),   depth(s) = depth + s (qd_d - depth qd_w),
    t - t_near = s w / (1 - s qd_w).

A pinhole has w = z_view and qd_d = 0: no end point is needed, and all stays finite as t goes to
infinity (s = 1 / qd_w, depth = 0). Parallel lines of sight have w = 1 and qd_w = 0, so s is
t - t_near; the far plane, depth = 0, is a border of the view then.

Directions are scaled by a power of two first, so that their length plays no part in float32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined
from hybrid_rt.kernels.raster.clip import mapped
from hybrid_rt.kernels.techniques.screen import (
    BEFORE_FAR,
    INVALID,
    MISS,
    NEAR,
    OFFSCREEN,
)

LANES = 2 * simd.WIDTH
"""Rays that are marched at a time: two registers of them, so that one does not wait for the other.
"""
INF = np.inf
NORMAL_BITS = 52
"""Where the exponent of a float64 begins."""
EXPONENTS = 0x7FF
TO_HALF = 2045
"""The exponent's bits of a number and of the power of two that brings it to [1/2, 1) add up to it.
"""


class ScreenRays(NamedTuple):
    """Rays on the screen, float64, a ray in each lane; `length` is that of its direction.

    `status`, i32, is how a ray ends if it meets nothing before `s_end`, the largest s inside of the
    view volume; where a ray cannot even start, s_end is negative and `status` says why. `t_near`
    and the length are those of the direction multiplied by `scale`, a power of two.
    """

    status: object
    x: object
    y: object
    depth: object
    dx: object
    dy: object
    dz: object
    s_end: object
    w: object
    gw: object
    length: object
    t_near: object
    scale: object


@inlined
def finite(x):
    """Return where x is neither infinite nor NaN."""
    return simd.absolute(x) < INF


@inlined
def scales_of(dx, dy, dz):
    """Return the powers of two, float64, that bring the largest components to [1/2, 1).

    Return their reciprocals as well.
    """
    largest = simd.maximum(simd.maximum(simd.absolute(dx), simd.absolute(dy)), simd.absolute(dz))
    exponent = (simd.bits_i64(largest) >> NORMAL_BITS) & EXPONENTS
    scale = simd.float_of_bits((simd.i64(TO_HALF, LANES) - exponent) << NORMAL_BITS)
    inverse = simd.float_of_bits((exponent + 1) << NORMAL_BITS)
    sound = (largest > 0.0) & (largest < INF)
    return simd.select(sound, scale, 1.0), simd.select(sound, inverse, 1.0)


@inlined
def screen_rays(ox, oy, oz, dx, dy, dz, t_near, t_far, view, width, height):
    """Return rays of the world, f32 vectors, on a screen; paper: "Initialise"."""
    m, eye = view.m, view.eye
    ox, oy, oz = simd.to_f64(ox), simd.to_f64(oy), simd.to_f64(oz)
    dx, dy, dz = simd.to_f64(dx), simd.to_f64(dy), simd.to_f64(dz)
    scale, inverse = scales_of(dx, dy, dz)
    dx, dy, dz = dx * scale, dy * scale, dz * scale
    t_near, t_far = simd.to_f64(t_near) * inverse, simd.to_f64(t_far) * inverse
    square = dx * dx + dy * dy + dz * dz
    valid = finite(ox + oy + oz) & finite(square) & (square > 0.0)
    valid = valid & (t_near < INF) & (t_far >= t_near)
    px, py, pz = ox + t_near * dx - eye[0], oy + t_near * dy - eye[1], oz + t_near * dz - eye[2]
    w, d = mapped(m, 2, px, py, pz) + m[2, 3], mapped(m, 3, px, py, pz) + m[3, 3]
    in_front = w >= d
    x = (mapped(m, 0, px, py, pz) + m[0, 3]) / w
    y = (mapped(m, 1, px, py, pz) + m[1, 3]) / w
    depth = d / w
    # Depth is 0 at the far plane.
    inside = (x >= 0.0) & (x <= width) & (y >= 0.0) & (y <= height) & (depth > 0.0)
    gx, gy = mapped(m, 0, dx, dy, dz), mapped(m, 1, dx, dy, dz)
    gw, gd = mapped(m, 2, dx, dy, dz), mapped(m, 3, dx, dy, dz)
    delta_x, delta_y, delta_z = gx - x * gw, gy - y * gw, gd - depth * gw
    # At infinity, at the near plane or at the far plane: one division for all, each its own.
    away = gw > 0.0
    towards = ~away & (gw < gd)
    farther = ~away & ~towards & (gd < 0.0)
    numerator = simd.select(towards, d - w, simd.select(farther, depth, 1.0))
    denominator = simd.select(towards, d * gw - w * gd, simd.select(farther, -delta_z, gw))
    s_end = numerator / denominator
    s_end = simd.select(farther, BEFORE_FAR * s_end, s_end)
    s_end = simd.select(away | towards | farther, s_end, INF)
    status = simd.select(towards, simd.i32(NEAR, LANES), simd.i32(MISS, LANES))
    status = simd.select(farther, OFFSCREEN, status)
    if simd.any_(t_far < INF):
        s_far = (t_far - t_near) / (w + (t_far - t_near) * gw)
        # Negative: t_far lies behind the eye.
        sooner = (t_far < INF) & (s_far >= 0.0) & (s_far < s_end)
        s_end, status = simd.select(sooner, s_far, s_end), simd.select(sooner, MISS, status)
    s_side = (simd.select(delta_x > 0.0, simd.f64(width, LANES), 0.0) - x) / delta_x
    sooner = (delta_x != 0.0) & (s_side < s_end)
    s_end, status = simd.select(sooner, s_side, s_end), simd.select(sooner, OFFSCREEN, status)
    s_side = (simd.select(delta_y > 0.0, simd.f64(height, LANES), 0.0) - y) / delta_y
    sooner = (delta_y != 0.0) & (s_side < s_end)
    s_end, status = simd.select(sooner, s_side, s_end), simd.select(sooner, OFFSCREEN, status)
    status = simd.select(inside, status, OFFSCREEN)
    status = simd.select(in_front, status, NEAR)
    status = simd.select(valid, status, INVALID)
    s_end = simd.select(valid & in_front & inside, s_end, -1.0)
    return ScreenRays(
        status, x, y, depth, delta_x, delta_y, delta_z, s_end, w, gw, simd.root(square), t_near,
        scale,
    )  # fmt: skip


@inlined
def rays_t(s, w, gw, t_near):
    """Return t of screen parameters s, float64; infinite where a ray has reached infinity."""
    below = 1.0 - s * gw
    return simd.select(below <= 0.0, INF, t_near + s * w / below)
