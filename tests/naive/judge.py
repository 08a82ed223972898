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


def verdict(origin, direction, t_near, t_far, claim, reference, triangles):
    """Return (verdict, true t or None); claim and reference are indices, -1 for a miss.

    The verdict "WRONG" stands for FALSE_HIT or WRONG_PRIMITIVE, which pixels tell apart. The true t
    is "reference" where only the reference's own t is left.
    """

    def look(prim):
        if prim < 0:
            return "missed", None, None
        return touch(origin, direction, t_near, t_far, triangles[prim])

    c, r = look(claim), look(reference)
    if claim == reference:
        if claim < 0:
            return "CORRECT", None
        return "CORRECT", "reference" if r[0] == "missed" else r[1]
    if r[0] == "missed" and c[0] == "missed":
        if claim < 0:
            return "REFERENCE_WRONG", None
        return "WRONG", None if reference < 0 else "reference"
    if r[0] == "missed":
        return ("REFERENCE_WRONG" if c[0] == "hit" else "TIE"), c[1]
    if c[0] == "missed":
        if claim < 0:
            return ("FALSE_MISS" if r[0] == "hit" else "TIE"), r[1]
        return "WRONG", r[1]
    true = min(c[1], r[1])
    if abs(c[1] - r[1]) <= max(c[2], r[2]):
        return "TIE", true
    if c[1] < r[1]:
        return ("REFERENCE_WRONG" if c[0] == "hit" else "TIE"), true
    return ("WRONG" if r[0] == "hit" else "TIE"), true


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
