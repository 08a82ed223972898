"""The linear march in the world, one ray at a time.

In units of w where the ray starts, which is z_view for a pinhole and 1 for parallel lines of sight,
the ray's length is u; with what w grows by along a direction of unit length, g, which is its cosine
with the camera's or 0, ``w(u) = w (1 + u g)``, so the screen parameter of `screen` is
``s = u / (1 + u g)``.
"""

from __future__ import annotations

import numpy as np

from naive.stepping.compiled import inlined
from naive.stepping.screen import (
    EXHAUSTED,
    F0,
    F1,
    HALF,
    HIDDEN,
    HIT,
    clamp,
    slab_bottom,
)

IN_FRONT, INSIDE, BEHIND = range(3)


@inlined
def look(s, x, y, z0, dx, dy, dz, own_x, own_y, depth, slab_a, slab_b):
    """Return where the ray's point at s is in respect of its pixel's slab, and the pixel."""
    height, width = depth.shape
    i = clamp(int(x + dx * s), 0, width - 1)
    j = clamp(int(y + dy * s), 0, height - 1)
    surface = depth[j, i]
    ray = z0 + dz * s
    # The pixel that a ray starts from is not compared with itself.
    if surface <= F0 or ray > surface or (i == own_x and j == own_y):
        return IN_FRONT, i, j
    if ray >= slab_bottom(surface, slab_a, slab_b):
        return INSIDE, i, j
    return BEHIND, i, j


def linear_ray(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level):
    """March one ray, as `driver.march_ray`."""
    depth = buffers.depth
    x, y, z0 = np.float32(ray.x), np.float32(ray.y), np.float32(ray.depth)
    # The deltas of a direction of unit length.
    dx, dy = np.float32(ray.dx / ray.length), np.float32(ray.dy / ray.length)
    dz, cosine = np.float32(ray.dz / ray.length), np.float32(ray.gw / ray.length)
    s_end = np.float32(ray.s_end * ray.length)
    slab_a, slab_b = np.float32(numbers.slab_a), np.float32(numbers.slab_b)
    stride = np.float32(numbers.stride)
    status, max_steps, refinements = ray.status, numbers.max_steps, numbers.refinements
    s_free = F0
    passed = False  # behind a surface
    step = 0
    while True:
        step += 1
        u = np.float32(step) * stride
        stretch = F1 + u * cosine
        s = u / stretch
        if stretch <= F0 or not s < s_end:
            if passed:
                return HIDDEN, False, -1, -1, 0.0, s_free / ray.length, step - 1
            return status, False, -1, -1, 0.0, s_end / ray.length, step - 1
        if step > max_steps:
            return EXHAUSTED, False, -1, -1, 0.0, s_free / ray.length, max_steps
        where, i, j = look(s, x, y, z0, dx, dy, dz, own_x, own_y, depth, slab_a, slab_b)
        if where == INSIDE:
            break
        if where == BEHIND:
            passed = True
        elif not passed:
            s_free = s
    low, high = u - stride, u
    for _ in range(refinements):
        middle = HALF * (low + high)
        at = middle / (F1 + middle * cosine)
        where, mid_i, mid_j = look(at, x, y, z0, dx, dy, dz, own_x, own_y, depth, slab_a, slab_b)
        if where == INSIDE:
            high, s, i, j = middle, at, mid_i, mid_j
        else:
            low = middle
    return HIT, True, i, j, s / ray.length, s_free / ray.length, step + refinements
