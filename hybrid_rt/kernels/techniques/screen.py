"""A ray on the screen: set-up and stepping from cell to cell, shared by all techniques.

On the screen a ray is ``(x, y, depth)(s) = start + s * delta`` with
``s = (t - t_near) / z_view(t)``: for q(t) = M (o + t d - eye) and q at t_near = (x z, y z, z),

    x(s) = x + s (qd_x - x qd_z),   depth(s) = depth (1 - s qd_z),   t - t_near = s z / (1 - s qd_z)

which needs no end point and stays finite as t goes to infinity (s = 1 / qd_z, depth = 0).
"""

from __future__ import annotations

import math

import numpy as np

from hybrid_rt.kernels._jit import inlined

# types.MarchStatus
HIT, MISS, OFFSCREEN, HIDDEN, NEAR, EXHAUSTED, INVALID, UNDECIDED, SKIPPED = range(9)

CHUNK = 1024  # rays that a thread takes at a time

F0 = np.float32(0.0)
F1 = np.float32(1.0)
HALF = np.float32(0.5)
INF = np.float32(np.inf)


@inlined
def screen_ray(ox, oy, oz, dx, dy, dz, t_near, t_far, m, eye, near, width, height):
    """Return (status, x, y, depth, delta x, y, depth, s_end, z, qd_z); paper: "Initialise".

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
    qx = m[0, 0] * px + m[0, 1] * py + m[0, 2] * pz
    qy = m[1, 0] * px + m[1, 1] * py + m[1, 2] * pz
    z = m[2, 0] * px + m[2, 1] * py + m[2, 2] * pz
    if not z >= near:
        return NEAR, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0
    x, y = qx / z, qy / z
    if not (0.0 <= x <= width and 0.0 <= y <= height):
        return OFFSCREEN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0
    gx = m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz
    gy = m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz
    gz = m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz
    depth = near / z
    delta_x, delta_y, delta_depth = gx - x * gz, gy - y * gz, -depth * gz
    status = MISS
    s_end = math.inf
    if gz > 0.0:
        s_end = 1.0 / gz  # t = infinity
    elif gz < 0.0:
        status = NEAR
        s_end = (near - z) / (gz * near)
    if t_far < math.inf:
        s_far = (t_far - t_near) / (z + (t_far - t_near) * gz)
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
    return status, x, y, depth, delta_x, delta_y, delta_depth, s_end, z, gz


@inlined
def ray_t(s, z, gz, t_near):
    """Return t of the screen parameter s; infinite where the ray has reached infinity."""
    denominator = 1.0 - s * gz
    if denominator <= 0.0:
        return math.inf
    return t_near + s * z / denominator


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
def slab_bottom(depth, thickness):
    """Return the depth at `thickness`, in units of the near plane's distance, behind `depth`.

    ``near / (z_view + thickness)`` for ``depth = near / z_view``.
    """
    return depth / (F1 + depth * thickness)


@inlined
def write_row(
    i, how, answers, hit_x, hit_y, s_hit, s_free, count, started, z, gz, t_near, t_far, prim_id,
    status, resolved, pixel, prim, t, t_free, steps,
):  # fmt: skip
    """Write row i of a march's outputs; hit_x is -1 where no pixel answers the ray with a hit."""
    start = np.float64(t_near[i])
    status[i] = how
    resolved[i] = answers
    pixel[i, 0] = hit_x
    pixel[i, 1] = hit_y
    steps[i] = count
    t_free[i] = t_far[i] if how == MISS else ray_t(np.float64(s_free), z, gz, start)
    if not started:
        t_free[i] = 0.0
    if hit_x >= 0:
        prim[i] = prim_id[hit_y, hit_x]
        t[i] = ray_t(np.float64(s_hit), z, gz, start)
    else:
        prim[i] = -1
        t[i] = np.inf
