"""A ray on the screen: set-up and stepping from cell to cell, shared by all techniques.

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

import math
from typing import NamedTuple

import numpy as np

from naive.stepping.compiled import inlined

# rays.marched.MarchStatus
HIT, MISS, OFFSCREEN, HIDDEN, NEAR, EXHAUSTED, INVALID, UNDECIDED, SKIPPED = range(9)

CHUNK = 1024  # rays that a thread takes at a time

F0 = np.float32(0.0)
F1 = np.float32(1.0)
HALF = np.float32(0.5)
INF = np.float32(np.inf)
BEFORE_FAR = 1.0 - 2.0**-16
"""A ray's end at the far plane comes earlier by this, relative to its length, so that what is added
to it for rounding does not lead beyond."""
LARGEST_T = float(np.finfo(np.float32).max)
"""A hit whose t float32 cannot hold is given this one: infinity would say that there is none."""


class ScreenRay(NamedTuple):
    """A ray on the screen, float64; see `place`. `length` is that of its direction."""

    status: int
    x: float
    y: float
    depth: float
    dx: float
    dy: float
    dz: float
    s_end: float
    w: float
    gw: float
    length: float


@inlined
def scale_of(dx, dy, dz):
    """Return the power of two that brings a direction's largest component to [1/2, 1)."""
    largest = max(abs(dx), abs(dy), abs(dz))
    if not (largest > 0.0 and largest < math.inf):
        return 1.0
    return math.ldexp(1.0, -math.frexp(largest)[1])


@inlined
def screen_ray(i, rays, view, width, height):
    """Return ray i on the screen, and by what its direction was multiplied before."""
    ox, oy, oz = rays.origin[i, 0], rays.origin[i, 1], rays.origin[i, 2]
    dx, dy, dz = rays.direction[i, 0], rays.direction[i, 1], rays.direction[i, 2]
    scale = scale_of(np.float64(dx), np.float64(dy), np.float64(dz))
    placed = place(
        np.float64(ox), np.float64(oy), np.float64(oz), dx * scale, dy * scale, dz * scale,
        rays.t_near[i] / scale, rays.t_far[i] / scale, view.m, view.eye, width, height,
    )  # fmt: skip
    length = math.sqrt((dx * scale) ** 2 + (dy * scale) ** 2 + (dz * scale) ** 2)
    return ScreenRay(*placed, length), scale


@inlined
def mapped(m, k, x, y, z):
    """Return row k of a map, without its constant, times a vector."""
    return m[k, 0] * x + m[k, 1] * y + m[k, 2] * z


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
def axis(delta):
    """Return (inv, bias, step of the cell, 1 if the far edge is the larger one) of a screen delta.

    ``s = (edge - start) * inv + bias``. A delta of zero, or one so small that its reciprocal
    overflows, never reaches an edge: inv 0 and bias infinity say so without a branch and without
    0 * infinity.
    """
    inv = F1 / delta
    if math.isinf(inv):
        return F0, INF, 0, 0
    if delta > F0:
        return inv, F0, 1, 1
    return inv, F0, -1, 0


@inlined
def edge_s(edge, start, inv, bias):
    """Return the s at which the ray reaches a cell's edge."""
    return (np.float32(edge) - start) * inv + bias


@inlined
def clamp(value, low, high):
    """Return `value` limited to [low, high]."""
    return low if value < low else (high if value > high else value)


@inlined
def next_cell(
    cx, cy, lx, ly, level, edge_x, edge_y, sx, sy, s, x, y, dx, dy, step_x, step_y
):  # fmt: skip
    """Return the pixel in which a ray at s enters the next cell of a level from cell (lx, ly).

    (cx, cy) is the pixel in which the ray entered this cell, (edge_x, edge_y) its far edges, which
    the ray reaches at sx and sy.
    """
    if sx < sy:
        low = cy if step_y > 0 else ly << level
        high = cy if step_y < 0 else ((ly + 1) << level) - 1
        return (edge_x if step_x > 0 else edge_x - 1), clamp(int(y + dy * s), low, high)
    low = cx if step_x > 0 else lx << level
    high = cx if step_x < 0 else ((lx + 1) << level) - 1
    return clamp(int(x + dx * s), low, high), (edge_y if step_y > 0 else edge_y - 1)


@inlined
def slab_bottom(depth, a, b):
    """Return the depth at a thickness behind `depth`, along the view: (depth - b) / (1 + a depth).

    a, b: of the thickness, `hybrid_rt.camera.camera.Camera.receding`. For a pinhole that is
    ``near / (z_view + thickness)`` for ``depth = near / z_view``.
    """
    return (depth - b) / (F1 + depth * a)


@inlined
def write_row(i, row, ray, scale, rays, prim_ids, out):
    """Write row i of a march's outputs; `row` is what `driver.march_ray` returns."""
    how, answers, hit_x, hit_y, s_hit, s_free, count = row
    start = rays.t_near[i] / scale
    out.status[i] = how
    out.resolved[i] = answers
    out.pixel[i, 0] = hit_x
    out.pixel[i, 1] = hit_y
    out.steps[i] = count
    if ray.s_end < 0.0:
        out.t_free[i] = 0.0
    elif how == MISS:
        out.t_free[i] = rays.t_far[i]
    else:
        out.t_free[i] = ray_t(np.float64(s_free), ray.w, ray.gw, start) * scale
    if hit_x >= 0:
        out.prim_id[i] = prim_ids[hit_y, hit_x]
        out.t[i] = min(ray_t(np.float64(s_hit), ray.w, ray.gw, start) * scale, LARGEST_T)
    else:
        out.prim_id[i] = -1
        out.t[i] = np.inf
