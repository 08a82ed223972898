"""A rasteriser of one triangle and one pixel at a time, with Python's own integers and floats.

Every pixel's centre is tested against every snapped outline with exact arithmetic; nothing is
binned, nothing is skipped.
"""

import math
from fractions import Fraction

import numpy as np

GUARD_LOW, GUARD_HIGH = -16384.0, 49152.0


class View:
    """The numbers of a camera: eye, unit axes, field of view, size, near plane."""

    def __init__(self, camera):
        self.eye = [float(x) for x in camera.eye]
        self.right = [float(x) for x in camera.right]
        self.up = [float(x) for x in camera.up]
        self.forward = [float(x) for x in camera.forward]
        self.width, self.height, self.near = camera.width, camera.height, camera.near
        self.f = 0.5 * self.height / math.tan(math.radians(camera.vfov_deg) / 2)
        self.rows = [
            [
                self.f * r + 0.5 * self.width * w
                for r, w in zip(self.right, self.forward, strict=True)
            ],
            [
                -self.f * u + 0.5 * self.height * w
                for u, w in zip(self.up, self.forward, strict=True)
            ],
            self.forward,
        ]

    def project(self, p):
        """Return (x z, y z, z) of a world point."""
        r = [float(a) - b for a, b in zip(p, self.eye, strict=True)]
        return tuple(dot(row, r) for row in self.rows)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def clip(polygon, inside):
    """Clip a polygon to inside(q) >= 0; edges are cut from their lexicographically first end."""
    result = []
    for i, q in enumerate(polygon):
        p = polygon[(i + 1) % len(polygon)]
        if inside(q) >= 0:
            result.append(q)
        if (inside(q) >= 0) != (inside(p) >= 0):
            a, b = min(p, q), max(p, q)
            t = inside(a) / (inside(a) - inside(b))
            result.append(tuple(x + t * (y - x) for x, y in zip(a, b, strict=True)))
    return result


def outline(view, triangle):
    """Return the snapped corners (x, y) in 1/256 pixel of a clipped triangle, [] if none."""
    polygon = [view.project(p) for p in triangle]
    near = view.near
    kept = clip(polygon, lambda q: q[2] - near)
    if not kept:
        return []
    if kept != polygon:
        # A cut point lies on the near plane exactly.
        kept = [q if q in polygon else (q[0], q[1], near) for q in kept]
    for inside in (
        lambda q: q[0] - GUARD_LOW * q[2],
        lambda q: GUARD_HIGH * q[2] - q[0],
        lambda q: q[1] - GUARD_LOW * q[2],
        lambda q: GUARD_HIGH * q[2] - q[1],
    ):
        kept = clip(kept, inside)
    clamp = lambda x: min(max(x, GUARD_LOW), GUARD_HIGH)  # noqa: E731
    return [tuple(math.floor(clamp(c / z) * 256 + 0.5) for c in (x, y)) for x, y, z in kept]


def covered(corners, x, y):
    """Is the point (x, y) in 1/256 pixel inside the convex polygon, by the top-left rule."""
    area = sum(
        a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
    )
    if area == 0:
        return False
    if area < 0:
        corners = corners[::-1]
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        if a == b:
            continue
        e = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        top_left = b[1] < a[1] or (b[1] == a[1] and b[0] > a[0])
        if e < 0 or (e == 0 and not top_left):
            return False
    return True


def plane(view, triangle):
    """Return depth at the screen's centre, ddx, ddy and the range of depths, or None."""
    a, b, c = ([float(x) for x in p] for p in triangle)
    n = cross(
        [x - y for x, y in zip(b, a, strict=True)], [x - y for x, y in zip(c, a, strict=True)]
    )
    d = dot(n, [x - y for x, y in zip(a, view.eye, strict=True)])
    z = [view.project(p)[2] for p in triangle]
    if d == 0 or max(z) < view.near:
        return None
    scale = view.near / d
    return (
        scale * dot(n, view.forward),
        scale * dot(n, [x / view.f for x in view.right]),
        scale * dot(n, [-x / view.f for x in view.up]),
        view.near / max(z),
        view.near / max(min(z), view.near),
    )


def coverage(view, triangle):
    """Return (H, W) bool: the pixels that one triangle covers."""
    result = np.zeros((view.height, view.width), bool)
    corners = outline(view, triangle)
    if len(corners) < 3:
        return result
    for j in range(view.height):
        for i in range(view.width):
            result[j, i] = covered(corners, 256 * i + 128, 256 * j + 128)
    return result


def rasterize(vertices, faces, camera):
    """Return depth, ddx, ddy (H, W) float32 and prim_id (H, W) int32."""
    view = View(camera)
    shape = (view.height, view.width)
    depth, ddx, ddy = (np.zeros(shape, np.float32) for _ in range(3))
    prim_id = np.full(shape, -1, np.int32)
    for prim, face in enumerate(faces):
        triangle = [[float(x) for x in vertices[k]] for k in face]
        values = plane(view, triangle)
        if values is None:
            continue
        centre, dx, dy, farthest, nearest = values
        for j, i in np.argwhere(coverage(view, triangle)):
            row = centre + dy * (j + 0.5 - 0.5 * view.height)
            d = row + dx * (i + 0.5 - 0.5 * view.width)
            d = np.float32(max(min(d, nearest), farthest))
            if d > depth[j, i]:
                depth[j, i], ddx[j, i], ddy[j, i], prim_id[j, i] = d, dx, dy, prim
    return depth, ddx, ddy, prim_id


def exact_depth(vertices, face, camera, x, y):
    """Return near / z of a triangle's plane at (x, y) in pixels, in rational arithmetic.

    The camera's axes are taken as the float64 numbers they are.
    """
    view = View(camera)
    a, b, c = ([Fraction(float(t)) for t in vertices[k]] for k in face)
    eye, right, up, forward = (
        [Fraction(t) for t in v] for v in (view.eye, view.right, view.up, view.forward)
    )
    n = cross(
        [s - t for s, t in zip(b, a, strict=True)], [s - t for s, t in zip(c, a, strict=True)]
    )
    d = dot(n, [s - t for s, t in zip(a, eye, strict=True)])
    u = (Fraction(float(x)) - Fraction(view.width, 2)) / Fraction(view.f)
    v = (Fraction(view.height, 2) - Fraction(float(y))) / Fraction(view.f)
    ray = [w + u * r + v * t for w, r, t in zip(forward, right, up, strict=True)]
    return Fraction(view.near) * dot(n, ray) / d
