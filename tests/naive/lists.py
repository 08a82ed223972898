"""Which triangles touch a pixel's square and how near they come, in exact rational arithmetic.

The triangle is clipped at the near plane, the far plane and the four planes through the sides of
the square along the lines of sight; depth = d / w is largest at one of the corners that are left.
"""

from fractions import Fraction

from naive.triangle import cross, sub


def projected(point, matrix, eye):
    """Return q = M (p - eye, 1), (x w, y w, w, d), exact for the numbers as they are."""
    p = [Fraction(float(a)) - Fraction(float(b)) for a, b in zip(point, eye, strict=True)]
    p.append(Fraction(1))
    return tuple(sum(Fraction(float(row[k])) * p[k] for k in range(4)) for row in matrix)


def clip(polygon, side):
    """Return the part of a convex polygon where side(q) >= 0."""
    result = []
    for i, q in enumerate(polygon):
        p = polygon[(i + 1) % len(polygon)]
        a, b = side(q), side(p)
        if a >= 0:
            result.append(q)
        if (a > 0 and b < 0) or (a < 0 and b > 0):
            t = a / (a - b)
            result.append(tuple(q[k] + t * (p[k] - q[k]) for k in range(4)))
    return result


def nearest_depth(triangle, x0, y0, x1, y1):
    """Return the largest depth of a projected triangle in a rectangle, None if it has none there.

    `triangle` is three corners q; points before the near plane or beyond the far plane, where depth
    is 0, do not count.
    """
    polygon = clip(list(triangle), lambda q: q[2] - q[3])
    for side in (
        lambda q: q[3],
        lambda q: q[0] - x0 * q[2],
        lambda q: x1 * q[2] - q[0],
        lambda q: q[1] - y0 * q[2],
        lambda q: y1 * q[2] - q[1],
    ):
        polygon = clip(polygon, side)
    largest = max((q[3] / q[2] for q in polygon), default=0)
    return largest if largest > 0 else None


def plane_depth(triangle, x, y):
    """Return the exact depth of a projected triangle's plane at a place, None if it has none.

    The plane is ``d = n . (x w, y w, w)``: n by Cramer's rule from the three corners.
    """
    a, b, c = (q[:3] for q in triangle)
    below = sum(cross(a, b)[k] * c[k] for k in range(3))
    if below == 0:
        return None
    d = [q[3] for q in triangle]
    n = [d[0] * cross(b, c)[k] + d[1] * cross(c, a)[k] + d[2] * cross(a, b)[k] for k in range(3)]
    return (n[0] * Fraction(x) + n[1] * Fraction(y) + n[2]) / below


def has_area(triangle):
    a, b, c = ([Fraction(float(x)) for x in p] for p in triangle)
    return any(cross(sub(b, a), sub(c, a)))


def lists(vertices, faces, camera, margin, pixels):
    """Return {pixel: {face: nearest depth}} for the grown squares of some pixels."""
    matrix, eye = camera.arrays.m, camera.eye
    grow = Fraction(margin)
    q = [projected(v, matrix, eye) for v in vertices]
    found = {}
    for i, j in pixels:
        of_pixel = {}
        for face, corners in enumerate(faces):
            triangle = [q[v] for v in corners]
            depth = nearest_depth(triangle, i - grow, j - grow, i + 1 + grow, j + 1 + grow)
            if depth is not None and has_area([vertices[v] for v in corners]):
                of_pixel[face] = depth
        found[i, j] = of_pixel
    return found
