"""The paper's march as slowly and plainly as it can be said: float64, no pyramid, every pixel.

The ray is cut at every pixel border that it crosses, by solving for t in the plane of that border;
each piece lies in one pixel and is compared with it. Nothing is shared with the library.
"""

import itertools
import math
from dataclasses import dataclass

from naive import cameras

HIT, MISS, OFFSCREEN, HIDDEN, NEAR, EXHAUSTED, INVALID = range(7)


@dataclass
class Answer:
    status: int
    pixel: tuple[int, int]
    t: float
    t_free: float
    margin: float
    """The smallest relative distance of any decision from going the other way."""


def _dot(row, p):
    return row[0] * p[0] + row[1] * p[1] + row[2] * p[2]


def march(origin, direction, own_pixel, t_near, t_far, depth, ddx, ddy, camera):
    """March one ray; arrays as nested sequences or NumPy arrays, everything float64."""
    height, width = len(depth), len(depth[0])
    o = [float(x) for x in origin]
    d = [float(x) for x in direction]
    unanswered = (-1, -1)
    if not all(math.isfinite(x) for x in o + d) or d == [0.0, 0.0, 0.0]:
        return Answer(INVALID, unanswered, math.inf, 0.0, 1.0)
    rows = cameras.rows(camera)
    q0 = [_dot(row, [o[k] - camera.eye[k] for k in range(3)]) + row[3] for row in rows]
    qd = [_dot(row, d) for row in rows]

    def w(t):
        return q0[2] + t * qd[2]

    def x_px(t):
        return qd[0] / qd[2] if math.isinf(t) else (q0[0] + t * qd[0]) / w(t)

    def y_px(t):
        return qd[1] / qd[2] if math.isinf(t) else (q0[1] + t * qd[1]) / w(t)

    def z_depth(t):
        return 0.0 if math.isinf(t) else (q0[3] + t * qd[3]) / w(t)

    near = q0[3] + t_near * qd[3]
    margin = abs(w(t_near) - near) / (abs(near) or 1.0)
    if w(t_near) < near:
        return Answer(NEAR, unanswered, math.inf, 0.0, margin)
    x, y = x_px(t_near), y_px(t_near)
    margin = min(margin, abs(x), abs(y), abs(width - x), abs(height - y), abs(near))
    if not (0 <= x <= width and 0 <= y <= height and near > 0):
        return Answer(OFFSCREEN, unanswered, math.inf, 0.0, margin)

    # Where the ray ends: at the near or the far plane, at t_far or nowhere; the image's border is
    # found below.
    t_end, end = t_far, MISS
    if qd[2] < qd[3]:
        t_plane = (q0[3] - q0[2]) / (qd[2] - qd[3])
        if t_plane < t_end:
            t_end, end = t_plane, NEAR
    if cameras.is_parallel(camera) and qd[3] < 0 and -q0[3] / qd[3] < t_end:
        t_end, end = -q0[3] / qd[3], OFFSCREEN
    if math.isinf(t_end) and qd[2] == 0:
        t_end = 1e30
    cuts = []
    for axis, size in ((0, width), (1, height)):
        for line in range(size + 1):
            slope = qd[axis] - line * qd[2]
            if slope != 0:
                t = (line * q0[2] - q0[axis]) / slope
                if t_near < t < t_end:
                    cuts.append(t)
    ends = [t_near, *sorted(cuts), t_end]

    # Whether the ray just reaches a further border at its end, or just does not, may go either way.
    for position in (x_px(t_end), y_px(t_end)):
        margin = min(margin, abs(position - round(position)))

    # Pieces: (pixel, from, to). A cut at a corner leaves a piece of no length: nobody's pixel.
    pieces = []
    for a, b in itertools.pairwise(ends):
        middle = 2 * a + 1 if math.isinf(b) else 0.5 * (a + b)
        i, j = math.floor(x_px(middle)), math.floor(y_px(middle))
        length = max(abs(x_px(b) - x_px(a)), abs(y_px(b) - y_px(a)))
        last = not (0 <= i < width and 0 <= j < height)
        if length == 0 and len(ends) > 2:
            margin = 0.0
            continue
        if len(ends) > 2:
            margin = min(margin, length)
        if last:
            t_end, end = a, OFFSCREEN
            break
        pieces.append(((i, j), a, b))

    def above(pixel, t):
        """Return how far the ray is in front of the pixel's tilted plane at t."""
        i, j = pixel
        plane = float(depth[j][i])
        plane += float(ddx[j][i]) * (x_px(t) - i - 0.5) + float(ddy[j][i]) * (y_px(t) - j - 0.5)
        return z_depth(t) - plane

    def tilted(pixel, a, b):
        """Return the t at which the ray crosses the plane within [a, b] from the front, or None."""
        nonlocal margin
        if depth[pixel[1]][pixel[0]] <= 0:
            return None
        scale = max(abs(z_depth(a)), abs(z_depth(b)), float(depth[pixel[1]][pixel[0]]))
        margin = min(margin, abs(above(pixel, a)) / scale, abs(above(pixel, b)) / scale)
        if above(pixel, a) < 0 or above(pixel, b) > 0:
            return None
        low, high = a, min(b, 1e30)
        for _ in range(200):
            middle = 0.5 * (low + high)
            if above(pixel, middle) > 0:
                low = middle
            else:
                high = middle
        return 0.5 * (low + high)

    if pieces and pieces[0][0] == tuple(own_pixel):
        pieces.pop(0)
    previous = None
    for pixel, a, b in pieces:
        i, j = pixel
        nearest = float(depth[j][i])
        if nearest > 0:
            farthest_ray = min(z_depth(a), z_depth(b))
            margin = min(margin, abs(farthest_ray - nearest) / nearest)
            if farthest_ray <= nearest:
                t = tilted(pixel, a, b)
                if t is not None:
                    return Answer(HIT, pixel, t, min(a, t), margin)
                if previous is not None:
                    t = tilted(*previous)
                    if t is not None:
                        return Answer(HIT, previous[0], t, min(a, t), margin)
                return Answer(HIDDEN, unanswered, math.inf, a, margin)
        previous = (pixel, a, b)
    return Answer(end, unanswered, math.inf, t_far if end == MISS else t_end, margin)
