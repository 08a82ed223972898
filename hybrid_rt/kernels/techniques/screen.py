"""A single ray on the screen, and what all marches say of a ray; see `placing`."""

from __future__ import annotations

import math

import numpy as np

from hybrid_rt.kernels._jit import inlined
from hybrid_rt.kernels.raster.clip import mapped

# rays.marched.MarchStatus
HIT, MISS, OFFSCREEN, HIDDEN, NEAR, EXHAUSTED, INVALID, UNDECIDED, SKIPPED = range(9)

CHUNK = 1024  # rays that a thread takes at a time

F0 = np.float32(0.0)
F1 = np.float32(1.0)
INF = np.float32(np.inf)
BEFORE_FAR = 1.0 - 2.0**-16
"""A ray's end at the far plane comes earlier by this, relative to its length, so that what is added
to it for rounding does not lead beyond."""
LARGEST_T = float(np.finfo(np.float32).max)
"""A hit whose t float32 cannot hold is given this one: infinity would say that there is none."""


@inlined
def place(ox, oy, oz, dx, dy, dz, t_near, t_far, m, eye, width, height):
    """Return (status, x, y, depth, delta x, y, depth, s_end, w, qd_w); paper: "Initialise".

    `status` is how the ray ends if it meets nothing before `s_end`, the largest s inside the view
    volume; where the ray cannot even start, s_end is negative and `status` says why.
    """
    length = dx * dx + dy * dy + dz * dz
    finite = math.isfinite(ox + oy + oz) and math.isfinite(length)
    if not (finite and length > 0.0 and t_near < math.inf and t_far >= t_near):
        return INVALID, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0
    px = ox + t_near * dx - eye[0]
    py = oy + t_near * dy - eye[1]
    pz = oz + t_near * dz - eye[2]
    w, d = mapped(m, 2, px, py, pz) + m[2, 3], mapped(m, 3, px, py, pz) + m[3, 3]
    if not w >= d:
        return NEAR, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0
    x = (mapped(m, 0, px, py, pz) + m[0, 3]) / w
    y = (mapped(m, 1, px, py, pz) + m[1, 3]) / w
    depth = d / w
    # Depth is 0 at the far plane.
    if not (0.0 <= x <= width and 0.0 <= y <= height and depth > 0.0):
        return OFFSCREEN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0
    gx, gy = mapped(m, 0, dx, dy, dz), mapped(m, 1, dx, dy, dz)
    gw, gd = mapped(m, 2, dx, dy, dz), mapped(m, 3, dx, dy, dz)
    delta_x, delta_y, delta_depth = gx - x * gw, gy - y * gw, gd - depth * gw
    status = MISS
    s_end = math.inf
    if gw > 0.0:
        s_end = 1.0 / gw  # t = infinity
    elif gw < gd:
        status = NEAR
        s_end = (d - w) / (d * gw - w * gd)
    elif gd < 0.0:
        status = OFFSCREEN
        s_end = BEFORE_FAR * (depth / -delta_depth)
    if t_far < math.inf:
        s_far = (t_far - t_near) / (w + (t_far - t_near) * gw)
        if 0.0 <= s_far < s_end:  # negative: t_far lies behind the eye
            status = MISS
            s_end = s_far
    if delta_x != 0.0:
        s_side = ((width if delta_x > 0.0 else 0.0) - x) / delta_x
        if s_side < s_end:
            status = OFFSCREEN
            s_end = s_side
    if delta_y != 0.0:
        s_side = ((height if delta_y > 0.0 else 0.0) - y) / delta_y
        if s_side < s_end:
            status = OFFSCREEN
            s_end = s_side
    return status, x, y, depth, delta_x, delta_y, delta_depth, s_end, w, gw


@inlined
def ray_t(s, w, gw, t_near):
    """Return t of the screen parameter s; infinite where the ray has reached infinity."""
    denominator = 1.0 - s * gw
    if denominator <= 0.0:
        return math.inf
    return t_near + s * w / denominator


@inlined
def edge_s(edge, start, inv, bias):
    """Return the s at which the ray reaches a cell's edge."""
    return (np.float32(edge) - start) * inv + bias


@inlined
def clamp(value, low, high):
    """Return `value` limited to [low, high]."""
    return low if value < low else (high if value > high else value)
