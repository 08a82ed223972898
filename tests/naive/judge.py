"""The judge's definitions once more, one ray at a time, in exact rational arithmetic."""

import math
from fractions import Fraction

from naive.triangle import cross, dot, exact, intersect, sub

ULPS = Fraction(8, 2**24)


def closest_on_edge(p, q, t_p, t_q):
    """Return (squared distance, t) of the point of the edge p, q of the plane nearest to (0, 0)."""
    e = (q[0] - p[0], q[1] - p[1])
    length2 = e[0] ** 2 + e[1] ** 2
    s = Fraction(0)
    if length2:
        s = min(max(-(p[0] * e[0] + p[1] * e[1]) / length2, Fraction(0)), Fraction(1))
    x, y = p[0] + s * e[0], p[1] + s * e[1]
    return x * x + y * y, t_p + s * (t_q - t_p)


def touch(origin, direction, t_near, t_far, triangle):
    """Return (state, t, tolerance); state is "hit", "grazed" or "missed"."""
    missed = "missed", None, None
    o, d = exact(origin), exact(direction)
    corners = [exact(p) for p in triangle]
    if not any(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]))):
        return missed
    slack = ULPS * max(abs(x) for p in [o, *corners] for x in p)
    length = Fraction(math.sqrt(float(dot(d, d))))

    hit = intersect(origin, direction, triangle)
    if hit is not None:
        t = hit[0]
        tolerance = ULPS * abs(t) + slack / length
        if t_near <= t <= t_far:
            return "hit", t, tolerance
        distance2 = Fraction(0)
    else:
        axis = max(range(3), key=lambda k: abs(d[k]))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        flat = []
        for p in corners:
            r = sub(p, o)
            t = r[axis] / d[axis]
            flat.append((r[i] - t * d[i], r[j] - t * d[j], t))
        edges = [(flat[k], flat[(k + 1) % 3]) for k in range(3)]
        distance2, t = min(closest_on_edge(p[:2], q[:2], p[2], q[2]) for p, q in edges)
        tolerance = ULPS * abs(t) + slack / length
    near = Fraction(float(t_near)) - tolerance <= t
    far = t_far == math.inf or t <= Fraction(float(t_far)) + tolerance
    if distance2 <= slack**2 and near and far:
        return "grazed", t, tolerance
    return missed


def nearest(origin, direction, t_near, t_far, triangles):
    """Return (prim, t, tolerance, nearest graze before t) over all triangles; prim is -1 for none.

    t and the graze are None where there are none; of equal t the least prim counts.
    """
    met = [touch(origin, direction, t_near, t_far, triangle) for triangle in triangles]
    hits = [(t, prim, tolerance) for prim, (s, t, tolerance) in enumerate(met) if s == "hit"]
    grazes = [t for s, t, _ in met if s == "grazed"]
    if not hits:
        return -1, None, None, min(grazes, default=None)
    t, prim, tolerance = min(hits)
    return prim, t, tolerance, min((g for g in grazes if g < t), default=None)


def verdict(origin, direction, t_near, t_far, claim, reference, triangles, every=False):
    """Return (verdict, true t or None, whether the reference is wrong); -1 stands for a miss.

    The verdict "WRONG" stands for FALSE_HIT or WRONG_PRIMITIVE, which pixels tell apart. The true t
    is "reference" where only the reference's own t is left.
    """

    def look(prim):
        if prim < 0:
            return "missed", None, None
        return touch(origin, direction, t_near, t_far, triangles[prim])

    def right(prim, state, t, tolerance):
        if prim < 0:
            return first < 0
        if state == "missed":
            return False
        return first < 0 or t <= t_first + max(tolerance, tolerance_first)

    c, r = look(claim), look(reference)
    if claim == reference and not every:
        if claim < 0:
            return "CORRECT", None, False
        return "CORRECT", "reference" if r[0] == "missed" else r[1], False
    first, t_first, tolerance_first, _ = nearest(origin, direction, t_near, t_far, triangles)
    c_right, r_right = right(claim, *c), right(reference, *r)
    if c_right:
        agree = "CORRECT" if claim == reference else "TIE"
        true = c[1] if claim >= 0 else (r[1] if r_right else None)
        return (agree if r_right else "REFERENCE_WRONG"), true, not r_right
    candidates = [t for t in (t_first, r[1] if r_right else None) if t is not None]
    kind = "FALSE_MISS" if claim < 0 else "WRONG"
    return kind, min(candidates, default=None), not r_right


def on_screen(camera, point):
    """Return (x, y, z_view) of a world point, from the camera's definition."""
    q = [point[k] - camera.eye[k] for k in range(3)]
    x, y, z = (
        sum(a * b for a, b in zip(q, axis, strict=True))
        for axis in (camera.right, camera.up, camera.forward)
    )
    half = math.tan(math.radians(camera.vfov_deg) / 2)
    px = camera.width / 2 + x / z / half * camera.height / 2
    py = camera.height / 2 - y / z / half * camera.height / 2
    return px, py, z
