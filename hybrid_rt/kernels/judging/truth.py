"""How a ray meets triangles, in float64 with a bound on every error; see `judge.truth`."""

from __future__ import annotations

import math

import numpy as np

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import part
from hybrid_rt.kernels.judging.bvh import STACK
from hybrid_rt.kernels.triangle import approach, frame, sheared

NO, YES, UNSURE = 0, 1, 2

TOUCH = 8 * 2.0**-24
"""How near is grazed, of the largest coordinate."""
DOUBT = 2.0**-49
"""Error of `_triple`, of the sum of its terms' sizes."""
FINE = 2.0**-30
"""A t that is not known this well, relative to itself, is left to exact arithmetic."""


@inlined
def _triple(px, py, pz, qx, qy, qz, rx, ry, rz):
    """Return (p . (q x r), bound of its error), the components known to a relative 2**-53.

    A term suffers at most eight roundings (three differences, two products, three sums), and so do
    the sizes: the error is below 8 e / (1 - 8 e)**2 < 16 e of the computed sum, with e = 2**-53.
    """
    value = px * (qy * rz - qz * ry) + py * (qz * rx - qx * rz) + pz * (qx * ry - qy * rx)
    size = (
        abs(px) * (abs(qy * rz) + abs(qz * ry))
        + abs(py) * (abs(qz * rx) + abs(qx * rz))
        + abs(pz) * (abs(qx * ry) + abs(qy * rx))
    )
    return value, DOUBT * size


@inlined
def _minus(p, i, q):
    """Return ``p[i] - q`` of (V, 3) and (3,) in float64."""
    return (
        np.float64(p[i, 0]) - np.float64(q[0]),
        np.float64(p[i, 1]) - np.float64(q[1]),
        np.float64(p[i, 2]) - np.float64(q[2]),
    )


@inlined
def _cross_line(o, d, vertices, ia, ib, ic):
    """Return (NO, YES or UNSURE, t, bound of t's error): a line and a closed triangle.

    An edge-on triangle, and one without area, is not crossed.
    """
    dx, dy, dz = np.float64(d[0]), np.float64(d[1]), np.float64(d[2])
    ax, ay, az = _minus(vertices, ia, o)
    bx, by, bz = _minus(vertices, ib, o)
    cx, cy, cz = _minus(vertices, ic, o)
    wa, ea = _triple(dx, dy, dz, cx, cy, cz, bx, by, bz)
    wb, eb = _triple(dx, dy, dz, ax, ay, az, cx, cy, cz)
    wc, ec = _triple(dx, dy, dz, bx, by, bz, ax, ay, az)
    if (wa > ea or wb > eb or wc > ec) and (wa < -ea or wb < -eb or wc < -ec):
        return NO, 0.0, 0.0
    sure = (abs(wa) > ea or ea == 0) and (abs(wb) > eb or eb == 0) and (abs(wc) > ec or ec == 0)
    ux, uy, uz = _minus(vertices, ib, vertices[ia])
    vx, vy, vz = _minus(vertices, ic, vertices[ia])
    along, along_e = _triple(dx, dy, dz, ux, uy, uz, vx, vy, vz)
    if along_e == 0:
        return NO, 0.0, 0.0
    if abs(along) <= along_e:
        return UNSURE, 0.0, np.inf
    away, away_e = _triple(ax, ay, az, ux, uy, uz, vx, vy, vz)
    t = away / along
    # 4 e for the quotient and for sums of t and the error, the last factor for the bound's own.
    error = (away_e + abs(t) * along_e) / (abs(along) - along_e) + 4 * 2.0**-53 * abs(t)
    return (YES if sure else UNSURE), t, error * (1 + 2.0**-20)


@inlined
def _cross(o, d, near, far, vertices, ia, ib, ic):
    """Return what `_cross_line` does, of a ray between its limits."""
    crossed, t, error = _cross_line(o, d, vertices, ia, ib, ic)
    if crossed == NO or t + error < near or t - error > far:
        return NO, t, error
    if t - error < near or t + error > far:
        crossed = UNSURE
    return crossed, t, error


@inlined
def _largest(p):
    return max(abs(np.float64(p[0])), abs(np.float64(p[1])), abs(np.float64(p[2])))


@inlined
def _length(d):
    x, y, z = np.float64(d[0]), np.float64(d[1]), np.float64(d[2])
    return math.sqrt(x * x + y * y + z * z)


@inlined
def _slack(o, vertices, ia, ib, ic):
    """Return how far from a triangle a ray still grazes it."""
    corners = max(_largest(vertices[ia]), _largest(vertices[ib]), _largest(vertices[ic]))
    return TOUCH * max(_largest(o), corners)


@inlined
def _graze(o, d, ray, near, far, vertices, ia, ib, ic):
    """Return t where a ray grazes a triangle that it does not hit, NaN where it does not."""
    slack = _slack(o, vertices, ia, ib, ic)
    ax, ay, _ = sheared(o, ray, vertices, ia)
    bx, by, _ = sheared(o, ray, vertices, ib)
    cx, cy, _ = sheared(o, ray, vertices, ic)
    if min(ax, bx, cx) > slack or max(ax, bx, cx) < -slack:
        return np.nan
    if min(ay, by, cy) > slack or max(ay, by, cy) < -slack:
        return np.nan
    _, distance, t = approach(o, ray, vertices, ia, ib, ic)
    tolerance = TOUCH * abs(t) + slack / _length(d)
    if distance <= slack and near - tolerance <= t and t <= far + tolerance:
        return t
    return np.nan


@inlined
def _is_ray(o, d):
    """Whether a ray has a finite origin and a finite direction that is not zero."""
    finite = True
    zero = True
    for k in range(3):
        finite = finite and math.isfinite(o[k]) and math.isfinite(d[k])
        zero = zero and d[k] == 0
    return finite and not zero


@parallel_kernel
def touch(
    share, origin, direction, t_near, t_far, prim_id, vertices, faces, area, hit, t, error, grazed
):  # fmt: skip
    """How each of (N, 3) rays meets the triangle `prim_id` (N,) named for it, -1 for none.

    `area` (F,) bool says which triangles have one. `hit` (N,) uint8 is NO, YES or UNSURE, with `t`
    (N,) float64 and the bound `error` of its error. `grazed` (N,) float64 is the t of a graze, for
    the case that it is no hit, or NaN.
    """
    for i in part(share, len(origin)):
        hit[i], t[i], error[i], grazed[i] = NO, 0.0, 0.0, np.nan
        p = prim_id[i]
        if p < 0 or not area[p] or not _is_ray(origin[i], direction[i]):
            continue
        o, d, near, far = origin[i], direction[i], t_near[i], t_far[i]
        ia, ib, ic = faces[p, 0], faces[p, 1], faces[p, 2]
        hit[i], t[i], error[i] = _cross(o, d, near, far, vertices, ia, ib, ic)
        if hit[i] == YES and error[i] > FINE * abs(t[i]):
            hit[i] = UNSURE
        if hit[i] != YES:
            grazed[i] = _graze(o, d, frame(d), near, far, vertices, ia, ib, ic)


@parallel_kernel
def reach(share, origin, direction, prim_id, vertices, faces, out):
    """How far apart in t a ray and the named triangle may be to graze: (N,) float64, 0 for none."""
    for i in part(share, len(origin)):
        p = prim_id[i]
        out[i] = 0.0
        if p >= 0 and _is_ray(origin[i], direction[i]):
            slack = _slack(origin[i], vertices, faces[p, 0], faces[p, 1], faces[p, 2])
            out[i] = slack / _length(direction[i])


@inlined
def _slab(low, high, o, inverse, slack, enter, leave):
    """Return (enter, leave) of a ray's interval cut by a slab grown by `slack` on both sides.

    A NaN, from a plane that holds the origin of a ray parallel to it, cuts nothing.
    """
    first = (np.float64(low) - (o + slack)) * inverse
    last = (np.float64(high) - (o - slack)) * inverse
    if inverse < 0:
        first, last = last, first
    if first > enter:
        enter = first
    if last < leave:
        leave = last
    return enter, leave


@inlined
def _inverse(x):
    """Return 1 / x in float64, of both zeros +infinity."""
    return 1.0 / np.float64(x) if x != 0 else np.inf


@inlined
def _entry(box, node, ox, oy, oz, ix, iy, iz, slack, enter, leave):
    """Return where a ray enters a grown box, between `enter` and `leave`; infinity for a miss."""
    enter, leave = _slab(box[node, 0], box[node, 3], ox, ix, slack, enter, leave)
    enter, leave = _slab(box[node, 1], box[node, 4], oy, iy, slack, enter, leave)
    enter, leave = _slab(box[node, 2], box[node, 5], oz, iz, slack, enter, leave)
    return enter if enter <= leave else np.inf


@inlined
def _same_corners(vertices, faces, p, q):
    """Whether two triangles have the same three corners, so that they are met at the same t."""
    found = 0
    for j in range(3):
        a = faces[p, j]
        for k in range(3):
            b = faces[q, k]
            if (
                vertices[a, 0] == vertices[b, 0]
                and vertices[a, 1] == vertices[b, 1]
                and vertices[a, 2] == vertices[b, 2]
            ):
                found += 1
                break
    return found == 3


@inlined
def _walk(o, d, near, far, vertices, faces, largest, order, box, link, met, met_graze):
    """Walk the tree; return (prim, t, error, UNSURE or YES, t of the nearest graze, number met).

    Of certain hits with the same corners the least prim is returned. Every triangle that is touched
    or unsure, no farther than the nearest certain hit, is written to `met` (M,) int32, with the t
    of its graze, NaN for none, to `met_graze` (M,) float64, as long as there is room.
    """
    ray = frame(d)
    # The boxes have to be grown by a graze's reach; the last factor is far more than the rounding
    # of the slabs, below 2**-50 of the largest coordinate, can take away.
    slack = TOUCH * max(_largest(o), largest) * (1 + 2.0**-20)
    reach = 2 * slack / _length(d)
    lower, upper = near - 2 * TOUCH * near - reach, far + 2 * TOUCH * abs(far) + reach
    ox, oy, oz = np.float64(o[0]), np.float64(o[1]), np.float64(o[2])
    ix, iy, iz = _inverse(d[0]), _inverse(d[1]), _inverse(d[2])
    stack, starts = np.empty(STACK, np.int32), np.empty(STACK)
    best, best_t, best_e, rival, grazed, n = -1, np.inf, 0.0, np.inf, np.inf, 0
    top = 0
    enter = _entry(box, 0, ox, oy, oz, ix, iy, iz, slack, lower, upper)
    if enter < np.inf:
        stack[0], starts[0] = 0, enter
        top = 1
    while top > 0:
        top -= 1
        node = stack[top]
        if starts[top] > best_t + best_e:
            continue
        number = link[node, 1]
        if number == 0:
            leave = min(upper, best_t + best_e)
            one = link[node, 0]
            two = one + 1
            t_one = _entry(box, one, ox, oy, oz, ix, iy, iz, slack, lower, leave)
            t_two = _entry(box, two, ox, oy, oz, ix, iy, iz, slack, lower, leave)
            if t_two < t_one:
                one, two, t_one, t_two = two, one, t_two, t_one
            if t_two < np.inf:
                stack[top], starts[top] = two, t_two
                top += 1
            if t_one < np.inf:
                stack[top], starts[top] = one, t_one
                top += 1
            continue
        for j in range(link[node, 0], link[node, 0] + number):
            p = order[j]
            ia, ib, ic = faces[p, 0], faces[p, 1], faces[p, 2]
            hit, t, error = _cross(o, d, near, far, vertices, ia, ib, ic)
            touch_t = np.nan
            if hit != YES:
                touch_t = _graze(o, d, ray, near, far, vertices, ia, ib, ic)
            if hit == NO and not touch_t < best_t:
                continue
            if hit != NO and t - error > best_t + best_e:
                continue
            if n < len(met):
                met[n], met_graze[n] = p, touch_t
            n += 1
            if hit == NO:
                grazed = min(grazed, touch_t)
            elif hit == UNSURE:
                rival = min(rival, t - error)
            elif best >= 0 and _same_corners(vertices, faces, p, best):
                best = min(best, p)
            elif t + error < best_t + best_e:
                rival = min(rival, best_t - best_e)
                best, best_t, best_e = p, t, error
            else:
                rival = min(rival, t - error)
    sure = YES
    if rival < np.inf and rival <= best_t + best_e:
        sure = UNSURE
    if best >= 0 and best_e > FINE * abs(best_t):
        sure = UNSURE
    if not grazed < best_t:
        grazed = np.inf
    return best, best_t, best_e, sure, grazed, n


@parallel_kernel
def nearest(
    share, origin, direction, t_near, t_far, vertices, faces, largest, order, box, link,
    prim_id, t, error, grazed, sure,
):  # fmt: skip
    """Nearest hits of (N, 3) rays, by a tree as `kernels.bvh.build` makes it.

    `order` holds prim_ids. `largest` is the largest coordinate of the scene. `prim_id` (N,) int32,
    -1 for none; `t`, the bound `error` of its error and `grazed`, the nearest graze before t or
    infinity, (N,) float64; `sure` (N,) uint8 is UNSURE where exact arithmetic has to look.
    """
    for i in part(share, len(origin)):
        prim_id[i], t[i], error[i], grazed[i], sure[i] = -1, np.inf, 0.0, np.inf, YES
        if _is_ray(origin[i], direction[i]):
            nothing, no_graze = np.empty(0, np.int32), np.empty(0)
            prim_id[i], t[i], error[i], sure[i], grazed[i], _ = _walk(
                origin[i], direction[i], t_near[i], t_far[i],
                vertices, faces, largest, order, box, link, nothing, no_graze,
            )  # fmt: skip


@kernel
def gather(
    i, origin, direction, t_near, t_far, vertices, faces, largest, order, box, link, met, met_graze
):  # fmt: skip
    """Return how many triangles ray i may meet first, and write them as `_walk` does."""
    return _walk(
        origin[i], direction[i], t_near[i], t_far[i],
        vertices, faces, largest, order, box, link, met, met_graze,
    )[5]  # fmt: skip


@parallel_kernel
def area(share, vertices, faces, kind):
    """Write to `kind` (F,) uint8 whether each triangle has an area: YES or UNSURE."""
    for i in part(share, len(faces)):
        ux, uy, uz = _minus(vertices, faces[i, 1], vertices[faces[i, 0]])
        vx, vy, vz = _minus(vertices, faces[i, 2], vertices[faces[i, 0]])
        x, ex = _triple(1.0, 0.0, 0.0, ux, uy, uz, vx, vy, vz)
        y, ey = _triple(0.0, 1.0, 0.0, ux, uy, uz, vx, vy, vz)
        z, ez = _triple(0.0, 0.0, 1.0, ux, uy, uz, vx, vy, vz)
        kind[i] = YES if abs(x) > ex or abs(y) > ey or abs(z) > ez else UNSURE
