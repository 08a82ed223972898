"""Ray against triangle in exact rational arithmetic, one at a time."""

from fractions import Fraction


def exact(vector):
    """Three numbers as exact fractions."""
    return tuple(Fraction(float(x)) for x in vector)


def sub(p, q):
    return (p[0] - q[0], p[1] - q[1], p[2] - q[2])


def dot(p, q):
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def cross(p, q):
    return (
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    )


def intersect(origin, direction, triangle):
    """Return (t, u, v) as fractions, or None for a ray that misses the closed triangle.

    An edge-on ray and a triangle without area are never hit; t may be negative.
    """
    o, d = exact(origin), exact(direction)
    a, b, c = (exact(p) for p in triangle)
    n = cross(sub(b, a), sub(c, a))
    along = dot(n, d)
    if along == 0:
        return None
    t = dot(n, sub(a, o)) / along
    p = tuple(o[k] + t * d[k] for k in range(3))
    area2 = dot(n, n)
    u = dot(n, cross(sub(p, a), sub(c, a))) / area2
    v = dot(n, cross(sub(b, a), sub(p, a))) / area2
    if u < 0 or v < 0 or u + v > 1:
        return None
    return t, u, v


def nearest(origin, direction, triangles, t_near=0.0, t_far=float("inf")):
    """Return (t, index) of the nearest hit, of equal ones the first, or None."""
    best = None
    for index, triangle in enumerate(triangles):
        hit = intersect(origin, direction, triangle)
        if hit is not None and t_near <= hit[0] <= t_far and (best is None or hit[0] < best[0]):
            best = hit[0], index
    return best
