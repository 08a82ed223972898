"""Which triangles touch a pixel's square and how near they come, in exact rational arithmetic.

The triangle is clipped at the near plane and at the four planes through the eye and the sides of
the square; depth = near / z is largest at one of the corners that are left.
"""

from fractions import Fraction

from naive.triangle import cross, sub


def projected(point, matrix, eye):
    """Return q = M (p - eye), exact for the numbers as they are."""
    p = [Fraction(float(a)) - Fraction(float(b)) for a, b in zip(point, eye, strict=True)]
    return tuple(sum(Fraction(float(row[k])) * p[k] for k in range(3)) for row in matrix)


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
            result.append(tuple(q[k] + t * (p[k] - q[k]) for k in range(3)))
    return result


def nearest_depth(triangle, near, x0, y0, x1, y1):
    """Return the largest depth of a projected triangle in a rectangle, None if it has none there.

    `triangle` is three corners q; points before the near plane do not count.
    """
    near = Fraction(near)
    polygon = clip(list(triangle), lambda q: q[2] - near)
    for side in (
        lambda q: q[0] - x0 * q[2],
        lambda q: x1 * q[2] - q[0],
        lambda q: q[1] - y0 * q[2],
        lambda q: y1 * q[2] - q[1],
    ):
        polygon = clip(polygon, side)
    if not polygon:
        return None
    return max(near / q[2] for q in polygon)


def plane_depth(triangle, near, x, y):
    """Return the exact depth of a projected triangle's plane at a place, None if it has none.

    A point of the plane is q = z (x, y, 1) with n . q = n . q_a, so its depth is
    near (n . (x, y, 1)) / (n . q_a).
    """
    a, b, c = triangle
    n = cross(sub(b, a), sub(c, a))
    below = sum(n[k] * a[k] for k in range(3))
    if below == 0:
        return None
    return Fraction(near) * (n[0] * Fraction(x) + n[1] * Fraction(y) + n[2]) / below


def has_area(triangle):
    a, b, c = triangle
    return any(cross(sub(b, a), sub(c, a)))


def lists(vertices, faces, camera, margin, pixels):
    """Return {pixel: {face: nearest depth}} for the grown squares of some pixels."""
    matrix, eye, near = camera.pixel_from_world, camera.eye, float(camera.near)
    grow = Fraction(margin)
    q = [projected(v, matrix, eye) for v in vertices]
    found = {}
    for i, j in pixels:
        of_pixel = {}
        for face, corners in enumerate(faces):
            triangle = [q[v] for v in corners]
            depth = nearest_depth(triangle, near, i - grow, j - grow, i + 1 + grow, j + 1 + grow)
            if depth is not None and has_area(triangle):
                of_pixel[face] = depth
        found[i, j] = of_pixel
    return found
