"""A rasteriser of one triangle and one pixel at a time, with Python's own integers and floats.

Every pixel's centre is tested against every snapped outline with exact arithmetic; nothing is
binned, nothing is skipped.
"""

import math
from fractions import Fraction

import numpy as np

from naive import cameras

GUARD_LOW, GUARD_HIGH = -16384.0, 49152.0


class View:
    """The numbers of a camera: eye, unit axes, pixels of a length, size, planes."""

    def __init__(self, camera):
        self.camera = camera
        self.eye = [float(x) for x in camera.eye]
        self.right = [float(x) for x in camera.right]
        self.up = [float(x) for x in camera.up]
        self.forward = [float(x) for x in camera.forward]
        self.width, self.height, self.near = camera.width, camera.height, camera.near
        self.fx, self.fy = cameras.scales(camera)
        self.cx, self.cy = cameras.middle(camera)
        self.parallel = cameras.is_parallel(camera)
        self.rows = cameras.rows(camera)

    def project(self, p):
        """Return (x w, y w, w, d) of a world point."""
        r = [float(a) - b for a, b in zip(p, self.eye, strict=True)]
        return tuple(dot(row, r) + row[3] for row in self.rows)


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
    kept = clip(polygon, lambda q: q[2] - q[3])
    if not kept:
        return []
    if kept != polygon:
        # A cut point lies on the near plane exactly.
        kept = [q if q in polygon else (q[0], q[1], q[3], q[3]) for q in kept]
    for inside in (
        lambda q: q[0] - GUARD_LOW * q[2],
        lambda q: GUARD_HIGH * q[2] - q[0],
        lambda q: q[1] - GUARD_LOW * q[2],
        lambda q: GUARD_HIGH * q[2] - q[1],
    ):
        kept = clip(kept, inside)
    clamp = lambda x: min(max(x, GUARD_LOW), GUARD_HIGH)  # noqa: E731
    return [tuple(math.floor(clamp(c / z) * 256 + 0.5) for c in (x, y)) for x, y, z, _ in kept]


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
    to_a = [x - y for x, y in zip(a, view.eye, strict=True)]
    q = [view.project(p) for p in triangle]
    depths = [1.0 if w <= d else d / w for _, _, w, d in q]
    if all(w < d for _, _, w, d in q):
        return None
    across = [x / view.fx for x in view.right]
    down = [-x / view.fy for x in view.up]
    aside = [view.cx - 0.5 * view.width, view.cy - 0.5 * view.height]
    # From where the axis is to the middle of the screen.
    offset = [aside[0] * x + aside[1] * y for x, y in zip(across, down, strict=True)]
    if view.parallel:
        below = dot(n, view.forward) * (view.camera.far - view.near)
        if below == 0:
            return None
        # The line of sight o + z forward meets the plane where n . (o + z forward - a) = 0.
        z = dot(n, [x + y for x, y in zip(to_a, offset, strict=True)]) / dot(n, view.forward)
        centre = cameras.depth_of(view.camera, z)
        scale = 1.0 / below
    else:
        below = dot(n, to_a)
        if below == 0:
            return None
        scale = view.near / below
        centre = scale * dot(n, [x - y for x, y in zip(view.forward, offset, strict=True)])
    return centre, scale * dot(n, across), scale * dot(n, down), min(depths), max(depths)


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
    """Return the depth of a triangle's plane at (x, y) in pixels, in rational arithmetic.

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
    u = (Fraction(float(x)) - Fraction(view.cx)) / Fraction(view.fx)
    v = (Fraction(view.cy) - Fraction(float(y))) / Fraction(view.fy)
    aside = [u * r + v * t for r, t in zip(right, up, strict=True)]
    if view.parallel:
        z = (d - dot(n, aside)) / dot(n, forward)
        near, far = Fraction(view.near), Fraction(camera.far)
        return (far - z) / (far - near)
    return Fraction(view.near) * dot(n, [w + s for w, s in zip(forward, aside, strict=True)]) / d
