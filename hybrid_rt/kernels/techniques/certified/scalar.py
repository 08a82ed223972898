"""The certified march: an answer only where the lists of primitives prove it.

The true ray is o + t d for the float32 o and d as they are, t_near <= t <= t_far; on the screen it
is (x, y, depth)(s), see `kernels.techniques.screen`. It is walked through cells as a float32 ray
whose parameter is sigma = s * scale, with the scale that moves it by at most one pixel for sigma 1.
What has to be shown is that every true point of the ray, for every real sigma of a cell's interval,
lies in that cell grown by the lists' margin and is no nearer than the depth compared there.

Error bounds, with u = 2**-24 and L = max(W, H) + 1; sigma never exceeds L, and a position never
leaves [-1, L] before the ray ends.

- Set-up in float64: `trusted` refuses rays whose place, or whose total motion, may err by more than
  u L / 8 pixels or u / 8 of their depth; both together: u L / 4.
- Rounding to float32: start u L, slope u sigma <= u L; a slope below 2**-40 becomes 0: 2**-40 L.
- The parameter of a cell's edge, ``(edge - x) * inv``, has three roundings, so the walked ray is
  within 3.1 u L of the edge there; the row or column it enters is found from ``y + dy * s``, two
  roundings: 2 u L.

Together less than 8 u L, half of the margin of 16 u L (`hybrid_rt.raster.lists.MARGIN_ULPS`).

- Depth: start and slope rounded, product and sum rounded: 4 u Z, with Z the larger depth of the
  ray's two ends. The start is lowered by 8 u Z.

The interval of a cell begins where that of the one before ends, and depth is linear, so its
smallest value over the interval is at an end. Where that is above every bound of the pixel, nothing
can be hit; the primitives that it is not above are intersected with the whole ray, in float64 with
an error bound, and from then on are known. A primitive that the ray hits in a cell has a bound
there that is not below the ray's depth, hence it has been intersected when the walk leaves the
cell, or the pixel's `rest` has stopped the walk. So when the walk arrives at the nearest hit found,
there is no nearer one.
"""

from __future__ import annotations

import math

import numpy as np

from hybrid_rt.kernels._borrow import borrowed, borrowed_record
from hybrid_rt.kernels._jit import called, inlined, parallel_kernel
from hybrid_rt.kernels._queue import take
from hybrid_rt.kernels.raster.lists_planes import (
    DEPTH,
    ERROR,
    REFERENCE_X,
    REFERENCE_Y,
    SLOPE_X,
    SLOPE_Y,
)
from hybrid_rt.kernels.techniques.screen import (
    CHUNK,
    EXHAUSTED,
    F0,
    F1,
    HIDDEN,
    HIT,
    INF,
    INVALID,
    LARGEST_T,
    MISS,
    OFFSCREEN,
    UNDECIDED,
    clamp,
    edge_s,
    place,
    ray_t,
)
from hybrid_rt.kernels.triangle import frame

E = 2.0**-53
U = 2.0**-24
DEPTH_ULPS = 8.0
HIGH_ULPS = 16.0
NO_SLOPE = 2.0**-40
BEYOND = 1.0 + 2.0**-20
"""A ray's end is put off by this, relative, where it must not come too early."""

SHORTEST = 1e-300
"""A ray that ends where it starts is walked over this much of s: its one point is tested."""

T_MISS, T_HIT, T_UNDECIDED = 0, 1, 2

F = np.float32


@inlined
def test_primitive(o, ray, vertices, ia, ib, ic, t_near, t_far):
    """Return (T_MISS, T_HIT or T_UNDECIDED, lowest t, highest t) of a ray and a triangle.

    Woop, Benthin and Wald 2013, as in `hybrid_rt.kernels.triangle`: with r the largest coordinate
    of a vertex relative to o, sheared coordinates err by 5 e r, so an edge function, a difference
    of two products of them, errs by less than ``10 e r (sum of their sizes) + 64 e^2 r^2``.
    t is the mean of the vertices' t, weighted by the edge functions; a weight's error moves it by
    its share of the distance to that vertex's t.
    """
    kx, ky, kz, sx, sy, sz = ray
    z = np.float64(vertices[ia, kz]) - np.float64(o[kz])
    x = np.float64(vertices[ia, kx]) - np.float64(o[kx])
    y = np.float64(vertices[ia, ky]) - np.float64(o[ky])
    r = max(abs(x), abs(y), abs(z))
    ax, ay, at = x - sx * z, y - sy * z, sz * z
    z = np.float64(vertices[ib, kz]) - np.float64(o[kz])
    x = np.float64(vertices[ib, kx]) - np.float64(o[kx])
    y = np.float64(vertices[ib, ky]) - np.float64(o[ky])
    r = max(r, abs(x), abs(y), abs(z))
    bx, by, bt = x - sx * z, y - sy * z, sz * z
    z = np.float64(vertices[ic, kz]) - np.float64(o[kz])
    x = np.float64(vertices[ic, kx]) - np.float64(o[kx])
    y = np.float64(vertices[ic, ky]) - np.float64(o[ky])
    r = max(r, abs(x), abs(y), abs(z))
    cx, cy, ct = x - sx * z, y - sy * z, sz * z

    rounding = 8.0 * E * max(abs(at), abs(bt), abs(ct))
    if max(at, bt, ct) + rounding < t_near or min(at, bt, ct) - rounding > t_far:
        return T_MISS, 0.0, 0.0
    wa = cx * by - cy * bx
    wb = ax * cy - ay * cx
    wc = bx * ay - by * ax
    size = abs(ax) + abs(ay) + abs(bx) + abs(by) + abs(cx) + abs(cy)
    slack = 16.0 * E * r * size + 64.0 * (E * r) * (E * r)
    positive = wa > slack or wb > slack or wc > slack
    negative = wa < -slack or wb < -slack or wc < -slack
    if positive and negative:
        return T_MISS, 0.0, 0.0
    if not (abs(wa) > slack and abs(wb) > slack and abs(wc) > slack):
        return T_UNDECIDED, 0.0, 0.0
    whole = wa + wb + wc
    t = (wa * at + wb * bt + wc * ct) / whole
    spread = abs(at - t) + abs(bt - t) + abs(ct - t)
    error = slack * spread / (abs(whole) - 3.0 * slack) + rounding
    low, high = t - error, t + error
    if high < t_near or low > t_far:
        return T_MISS, 0.0, 0.0
    if not (low >= t_near and high <= t_far):
        return T_UNDECIDED, 0.0, 0.0
    return T_HIT, low, high


@inlined
def leaves_bounds(o, d, low, high):
    """Return a t, rounded up, after which the ray is outside of the box low..high, (3,) each."""
    t_exit = math.inf
    for k in range(3):
        if d[k] == 0.0:
            if not (low[k] <= o[k] <= high[k]):
                return -math.inf
        else:
            edge = high[k] if d[k] > 0.0 else low[k]
            t_exit = min(t_exit, (edge - np.float64(o[k])) / np.float64(d[k]))
    return t_exit + 2.0**-40 * abs(t_exit)


@inlined
def clip_end(how, s_end, start, stop, w, gw, o, d, low, high):
    """Return (status, s_end, is anything left) of a ray whose end is drawn in to where it matters.

    After t_far nothing counts, and outside of the scene's bounds there is nothing.
    """
    last_t = min(stop, leaves_bounds(o, d, low, high))
    if start <= last_t < math.inf:
        s_last = (last_t - start) / (w + (last_t - start) * gw)
        if s_last >= 0.0 and s_last * BEYOND < s_end:
            how, s_end = MISS, max(s_last, SHORTEST)
    if last_t < start:
        return MISS, s_end, False
    return how, s_end, True


@inlined
def trusted(o, d, t_near, eye, w, s_end, highest, spread, deep, apart):
    """Is the float64 set-up of a ray exact enough.

    A place on the screen is a row of M times (p, 1), by w, with p = o + t_near d - eye, every sum
    of which rounds by e times the sizes of its terms; a motion is s_end times a row of M times d.
    `spread` bounds the rows of M: the sum of absolute entries, those of x and y divided by L. So
    does `deep` the row of d, whose error counts against `highest`, the larger depth of the ray's
    two ends; it is 0 for a pinhole, where d is exact. `apart` is a length that bounds the rows'
    constants by their other entries; it is 0 for a pinhole, which has none.
    """
    place = 0.0
    motion = 0.0
    for k in range(3):
        size = abs(np.float64(d[k]))
        place = max(place, abs(np.float64(o[k])) + t_near * size + abs(eye[k]))
        motion = max(motion, size)
    error = 2.0**-50 * max((place + apart) / w, motion * s_end)
    return spread * error <= U / 8.0 and deep * error <= U / 8.0 * highest


@inlined
def slope_axis(delta):
    """Return (slope, inv, bias, step, far) of an axis; as `screen.axis`, tiny slopes made zero."""
    if abs(delta) < NO_SLOPE:
        return F0, F0, INF, 0, 0
    slope = F(delta)
    if slope > F0:
        return slope, F1 / slope, F0, 1, 1
    return slope, F1 / slope, F0, -1, 0


@inlined
def start_depth(depth, dz, s_end):
    """Return the depth at s = 0, in float32 and lowered by what `depth_at` may be too high."""
    return F(depth - DEPTH_ULPS * U * max(depth, depth + dz * s_end))


@inlined
def depth_at(z0, sz, s):
    """Return a depth, in float32, that the ray at s is in front of."""
    return z0 + sz * s


@inlined
def depth_error(depth, dz, s_end):
    """Return by how much, in float32, `depth_at` is at most too low."""
    return F(HIGH_ULPS * U * max(depth, depth + dz * s_end))


@inlined
def apart(planes, prim, s, s_exit, x0, y0, z0, sx, sy, sz, z_error):
    """Is the ray surely in front of a primitive's plane from s to s_exit, or surely behind it.

    Depths are linear in s, so it is enough to look at both ends. NaN, no plane, says no.
    """
    a, b, c = planes[prim, SLOPE_X], planes[prim, SLOPE_Y], planes[prim, DEPTH]
    px, py = planes[prim, REFERENCE_X], planes[prim, REFERENCE_Y]
    error = planes[prim, ERROR]
    above = z0 + sz * s - (c + a * (x0 + sx * s - px) + b * (y0 + sy * s - py))
    then = z0 + sz * s_exit - (c + a * (x0 + sx * s_exit - px) + b * (y0 + sy * s_exit - py))
    front = min(above, then) > error
    behind = max(above, then) + z_error < -error
    return front or behind


@inlined
def walk(
    o, d, t_near, t_far, ray, lists, pyramid, scene, limits, steps_by_level
):  # fmt: skip
    """March one ray; return (status, pixel x, pixel y, prim, t, s proven free, steps, tests)."""
    status, x, y, depth, dx, dy, dz, s_end, w, gw = ray
    prim_id, nearest, rest, planes = lists
    cells, offsets, pitches = pyramid
    vertices, faces, _ = scene
    max_steps, max_tests, any_hit = limits
    shear = frame(d)
    height, width, length = prim_id.shape
    top = offsets.shape[0] - 1
    scale = max(abs(dx), abs(dy), 1.0 / s_end)
    end = F(s_end * scale * BEYOND)
    sx, inv_x, bias_x, step_x, far_x = slope_axis(dx / scale)
    sy, inv_y, bias_y, step_y, far_y = slope_axis(dy / scale)
    sz = F(dz / scale)
    x0, y0 = F(x), F(y)
    z0 = start_depth(depth, dz, s_end)
    z_error = depth_error(depth, dz, s_end)

    best = -1
    best_low, best_high = math.inf, t_far
    best_x, best_y = -1, -1
    last = -1  # the primitive tested last
    cx = clamp(int(x0), 0, width - 1)
    cy = clamp(int(y0), 0, height - 1)
    s = F0
    level = 0
    steps = 0
    tests = 0
    while True:
        lx, ly = cx >> level, cy >> level
        edge_x, edge_y = (lx + far_x) << level, (ly + far_y) << level
        at_x = edge_s(edge_x, x0, inv_x, bias_x)
        at_y = edge_s(edge_y, y0, inv_y, bias_y)
        leave = min(at_x, at_y)
        s_exit = max(min(leave, end), s)
        if steps == max_steps:
            return EXHAUSTED, -1, -1, -1, math.inf, s / scale, steps, tests
        steps += 1
        steps_by_level[level] += 1
        near = cells[offsets[level] + ly * pitches[level] + lx]
        lowest = depth_at(z0, sz, s_exit if sz < F0 else s)
        if near > F0 and not lowest > near:
            if level > 0:
                level -= 1
                continue
            full = True
            for k in range(length):
                prim = prim_id[cy, cx, k]
                if prim < 0 or nearest[cy, cx, k] < lowest:
                    full = False
                    break
                if prim in (last, best) or apart(
                    planes, prim, s, s_exit, x0, y0, z0, sx, sy, sz, z_error
                ):
                    continue
                if tests == max_tests:
                    return EXHAUSTED, -1, -1, -1, math.inf, s / scale, steps, tests
                tests += 1
                last = prim
                found, low, high = test_primitive(
                    o, shear, vertices, faces[prim, 0], faces[prim, 1], faces[prim, 2],
                    t_near, min(t_far, best_high),
                )  # fmt: skip
                if found == T_MISS:
                    continue
                # A hit that rounding may put before or after the best one is a tie.
                if found == T_UNDECIDED or (best >= 0 and high >= best_low):
                    return UNDECIDED, -1, -1, -1, math.inf, s / scale, steps, tests
                best, best_low, best_high, best_x, best_y = prim, low, high, cx, cy
                if any_hit:
                    return HIT, cx, cy, best, 0.5 * (low + high), s / scale, steps, tests
                at_hit = (high - t_near) / (w + (high - t_near) * gw)
                if at_hit >= 0.0:  # negative: behind the eye
                    end = min(end, F(at_hit * scale * BEYOND))
                    s_exit = max(min(leave, end), s)
                    lowest = depth_at(z0, sz, s_exit if sz < F0 else s)
            if full and not lowest > rest[cy, cx]:
                return HIDDEN, -1, -1, -1, math.inf, s / scale, steps, tests
        s = s_exit
        if s_exit >= end:
            break
        if at_x < at_y:
            cx = edge_x if step_x > 0 else edge_x - 1
            low_cell = cy if step_y > 0 else ly << level
            high_cell = cy if step_y < 0 else ((ly + 1) << level) - 1
            cy = clamp(int(y0 + sy * s), low_cell, high_cell)
        else:
            cy = edge_y if step_y > 0 else edge_y - 1
            low_cell = cx if step_x > 0 else lx << level
            high_cell = cx if step_x < 0 else ((lx + 1) << level) - 1
            cx = clamp(int(x0 + sx * s), low_cell, high_cell)
        if cx < 0 or cy < 0 or cx >= width or cy >= height:
            return OFFSCREEN, -1, -1, -1, math.inf, s / scale, steps, tests
        # A sibling of the cell just left was blocked as a part of their parent: no use in going up.
        if level < top and (cx >> (level + 1) != lx >> 1 or cy >> (level + 1) != ly >> 1):
            level += 1
    if best >= 0:
        at_hit = (best_high - t_near) / (w + (best_high - t_near) * gw)
        if at_hit >= 0.0 and F(at_hit * scale * BEYOND) <= end:
            t = 0.5 * (best_low + best_high)
            return HIT, best_x, best_y, best, t, s / scale, steps, tests
        if status == MISS:
            status = UNDECIDED
    return status, -1, -1, -1, math.inf, s / scale, steps, tests


@called
def march_chunk(
    first, last, rays, box, lists, pyramid, scene, limits, out, steps_by_level, tests
):  # fmt: skip
    """Set up rays in float64, walk them in float32 and write their rows of the outputs."""
    rays, box, lists = borrowed_record(rays), borrowed_record(box), borrowed_record(lists)
    pyramid, scene, out = borrowed_record(pyramid), borrowed_record(scene), borrowed_record(out)
    steps_by_level = borrowed(steps_by_level)
    height, width = lists.rest.shape
    for i in range(first, last):
        o, d = rays.origin[i], rays.direction[i]
        start, stop = np.float64(rays.t_near[i]), np.float64(rays.t_far[i])
        how, x, y, z0, dx, dy, dz, s_end, w, gw = place(
            np.float64(o[0]), np.float64(o[1]), np.float64(o[2]),
            np.float64(d[0]), np.float64(d[1]), np.float64(d[2]),
            start, math.inf, box.m, box.eye, width, height,
        )  # fmt: skip
        if how != INVALID and not stop >= start:
            how, s_end = INVALID, -1.0
        hit_x, hit_y, found, at, s_free, count, tested = -1, -1, -1, math.inf, 0.0, 0, 0
        if s_end >= 0.0:
            how, s_end, some = clip_end(how, s_end, start, stop, w, gw, o, d, box.low, box.high)
            if not some:
                pass
            elif not (s_end < math.inf) or not trusted(
                o, d, start, box.eye, w, s_end, max(z0, z0 + dz * s_end),
                box.spread, box.deep, box.apart,
            ):  # fmt: skip
                how = UNDECIDED
            else:
                how, hit_x, hit_y, found, at, s_free, count, tested = walk(
                    o, d, start, stop, (how, x, y, z0, dx, dy, dz, s_end, w, gw),
                    lists, pyramid, scene, limits, steps_by_level,
                )  # fmt: skip
        tests[0] += tested
        out.status[i] = how
        out.resolved[i] = how in (HIT, MISS)
        out.pixel[i, 0] = hit_x
        out.pixel[i, 1] = hit_y
        out.prim_id[i] = found
        out.t[i] = min(at, LARGEST_T) if found >= 0 else math.inf
        out.steps[i] = count
        if how == MISS:
            out.t_free[i] = stop
        elif s_end < 0.0:
            out.t_free[i] = 0.0
        else:
            # Rounded down: what is proven is proven up to here at least.
            free = ray_t(s_free / BEYOND, w, gw, start)
            out.t_free[i] = F(min(free * (1.0 - 2.0**-22), stop))


@parallel_kernel
def march(share, rays, box, lists, pyramid, scene, limits, out, steps_by_level, tests):
    """March rays; out (N,), steps_by_level (workers, L), tests (workers, 1).

    rays, lists, pyramid, scene, out: as in `hybrid_rt.kernels.arrays`; limits: (steps, tests, is
    any hit an answer).
    """
    n = len(rays.t_near)
    first = take(share, CHUNK)
    while first < n:
        march_chunk(
            first, min(n, first + CHUNK), rays, box, lists, pyramid, scene, limits, out,
            steps_by_level[share.worker], tests[share.worker],
        )  # fmt: skip
        first = take(share, CHUNK)
