"""A ray on the screen in float64, by its own t: where it is, where it ends, what it crosses.

Nothing is shared with the library, which goes by another parameter.
"""

import itertools
import math
from dataclasses import dataclass

from naive import cameras

HIT, MISS, OFFSCREEN, HIDDEN, NEAR, EXHAUSTED, INVALID = range(7)
NOWHERE = (-1, -1)


@dataclass
class Answer:
    status: int
    resolved: bool
    pixel: tuple[int, int]
    t: float
    t_free: float
    margin: float
    """The smallest relative distance of any decision from going the other way."""


class View:
    """What a march sees: depths, derivatives and the camera, as float64."""

    def __init__(self, depth, ddx, ddy, camera):
        self.depth = [[float(v) for v in row] for row in depth]
        self.ddx = [[float(v) for v in row] for row in ddx]
        self.ddy = [[float(v) for v in row] for row in ddy]
        self.camera = camera
        self.parallel = cameras.is_parallel(camera)
        self.eye = [float(v) for v in camera.eye]
        self.forward = [float(v) for v in camera.forward]
        self.height, self.width = len(self.depth), len(self.depth[0])

    def z_of(self, depth):
        """Return how far along the view from the eye a depth is."""
        return cameras.z_of(self.camera, depth)

    def depth_of(self, z):
        """Return the depth of a distance along the view."""
        return cameras.depth_of(self.camera, z)

    def differ(self, a, b):
        """Return by how much two depths differ: a share, or of parallel sight a share of all."""
        return a - b if self.parallel else a / b - 1

    def plane(self, pixel, x, y):
        """Return the depth of the pixel's tilted plane at a place on the screen."""
        i, j = pixel
        slope = self.ddx[j][i] * (x - i - 0.5) + self.ddy[j][i] * (y - j - 0.5)
        return self.depth[j][i] + slope


class Ray:
    """A ray in a view. `early` is its Answer if it cannot start; else t_end and end say its end."""

    def __init__(self, view, origin, direction, t_near, t_far):
        self.view, self.t_near, self.margin, self.early = view, t_near, 1.0, None
        self.o = [float(v) for v in origin]
        self.d = [float(v) for v in direction]
        if not all(math.isfinite(v) for v in self.o + self.d) or self.d == [0.0, 0.0, 0.0]:
            self.early = self.answer(INVALID, t_free=0.0)
            return
        self.length = math.sqrt(sum(v * v for v in self.d))
        start = [self.o[k] - view.eye[k] for k in range(3)]
        rows = cameras.rows(view.camera)
        self.q0 = [sum(row[k] * start[k] for k in range(3)) + row[3] for row in rows]
        self.qd = [sum(row[k] * self.d[k] for k in range(3)) for row in rows]
        self.z0 = sum(view.forward[k] * start[k] for k in range(3))
        self.zd = sum(view.forward[k] * self.d[k] for k in range(3))
        w, d = self.q0[2] + t_near * self.qd[2], self.q0[3] + t_near * self.qd[3]
        self.decide((w - d) / (abs(d) or 1.0))
        if w < d:
            self.early = self.answer(NEAR, t_free=0.0)
            return
        x, y = self.at(t_near)
        self.decide(x, y, view.width - x, view.height - y, d / w)
        if not (0 <= x <= view.width and 0 <= y <= view.height and d > 0):
            self.early = self.answer(OFFSCREEN, t_free=0.0)
            return
        self.t_end, self.end = t_far, MISS
        if self.qd[2] < self.qd[3]:
            t = (self.q0[3] - self.q0[2]) / (self.qd[2] - self.qd[3])
            if t < self.t_end:
                self.t_end, self.end = t, NEAR
        if view.parallel and self.qd[3] < 0:  # to the far plane
            t = -self.q0[3] / self.qd[3]
            if t < self.t_end:
                self.t_end, self.end = t, OFFSCREEN
        sides = [(0, 0), (0, view.width), (1, 0), (1, view.height)]
        for axis, line in sides:
            t = self.reach(axis, line)
            away = (self.qd[axis] - line * self.qd[2]) * (1 if line else -1) > 0
            if away and t is not None and t_near <= t < self.t_end:
                self.t_end, self.end = t, OFFSCREEN
        x, y = self.at(self.t_end)
        for side, place in ((view.width, x), (view.height, y)):
            if self.end != OFFSCREEN:
                self.decide(place, side - place)

    def decide(self, *distances):
        """Note decisions by how far they are from going the other way."""
        self.margin = min(self.margin, *(abs(d) for d in distances))

    def z(self, t):
        """Return how far along the view from the eye the ray is at t."""
        return self.z0 + t * self.zd

    def t_of(self, z):
        """Return the t at which the ray is so far along the view."""
        return (z - self.z0) / self.zd

    def at(self, t):
        """Return x and y in pixels."""
        if math.isinf(t):
            if self.qd[2] == 0:
                return (math.nan, math.nan)
            return self.qd[0] / self.qd[2], self.qd[1] / self.qd[2]
        w = self.q0[2] + t * self.qd[2]
        return (self.q0[0] + t * self.qd[0]) / w, (self.q0[1] + t * self.qd[1]) / w

    def depth(self, t):
        if math.isinf(t):
            return 0.0
        return (self.q0[3] + t * self.qd[3]) / (self.q0[2] + t * self.qd[2])

    def reach(self, axis, line):
        """Return the t at which a coordinate is `line`, or None if never at a finite t."""
        slope = self.qd[axis] - line * self.qd[2]
        return None if slope == 0 else (line * self.q0[2] - self.q0[axis]) / slope

    def pixel(self, t):
        """Return the pixel at t, noting how near its border is."""
        x, y = self.at(t)
        self.decide(x - round(x), y - round(y))
        i, j = math.floor(x), math.floor(y)
        return min(max(i, 0), self.view.width - 1), min(max(j, 0), self.view.height - 1)

    def pieces(self):
        """Return (pixel, t from, t to) for all pixels that the ray crosses, in order."""
        cuts = []
        for axis, size in ((0, self.view.width), (1, self.view.height)):
            for line in range(size + 1):
                t = self.reach(axis, line)
                if t is not None and self.t_near < t < self.t_end:
                    cuts.append(t)
        for t in (self.t_near, self.t_end):  # along a border, or about to reach one
            x, y = self.at(t)
            if self.end != OFFSCREEN or t == self.t_near:
                self.decide(x - round(x), y - round(y))
        found = []
        for a, b in itertools.pairwise([self.t_near, *sorted(cuts), self.t_end]):
            xa, ya = self.at(a)
            xb, yb = self.at(b)
            if cuts:
                self.decide(max(abs(xb - xa), abs(yb - ya)))
            if a < b:
                i, j = math.floor((xa + xb) / 2), math.floor((ya + yb) / 2)
                i, j = min(max(i, 0), self.view.width - 1), min(max(j, 0), self.view.height - 1)
                found.append(((i, j), a, b))
        return found

    def crossing(self, height, a, b):
        """Return the t in [a, b] at which a height that falls from above 0 to below is 0."""
        low, high = a, min(b, 1e30)
        for _ in range(200):
            middle = 0.5 * (low + high)
            if height(middle) > 0:
                low = middle
            else:
                high = middle
        return 0.5 * (low + high)

    def answer(self, status, pixel=NOWHERE, t=math.inf, t_free=math.inf, resolved=None):
        resolved = status == HIT if resolved is None else resolved
        return Answer(status, resolved, pixel, t, t_free, self.margin)

    def ended(self, passed, t_free):
        """Return the answer of a ray that met nothing, or only passed behind something."""
        if passed:
            return self.answer(HIDDEN, t_free=t_free)
        return self.answer(self.end, t_free=self.t_end)
