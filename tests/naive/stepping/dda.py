"""The perspective-correct pixel DDA of "Efficient GPU Screen-Space Ray Tracing", ray by ray.

On the screen x, y and depth are linear in s, so equal steps of s are equal steps of pixels and,
where depth is near / z_view, 1 / z_view is interpolated, as the paper has it.
"""

from __future__ import annotations

import numpy as np

from naive.stepping.compiled import inlined
from naive.stepping.screen import (
    EXHAUSTED,
    F0,
    HALF,
    HIDDEN,
    HIT,
    clamp,
    slab_bottom,
)

FAR = np.float32(1e37)  # an s beyond all others that can still be doubled


@inlined
def nearest_s(level, z0, dz, low, high):
    """Return the s in [low, high] at which the ray's depth is nearest to `level`."""
    if dz == F0:
        return low
    return clamp((level - z0) / dz, low, high)


def dda_ray(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level):
    """March one ray, as `driver.march_ray`."""
    depth = buffers.depth
    height, width = depth.shape
    x, y, z0 = np.float32(ray.x), np.float32(ray.y), np.float32(ray.depth)
    dx, dy, dz = np.float32(ray.dx), np.float32(ray.dy), np.float32(ray.dz)
    slab_a, slab_b = np.float32(numbers.slab_a), np.float32(numbers.slab_b)
    stride = np.float32(numbers.stride)
    jitter, max_steps = np.float32(numbers.jitter), numbers.max_steps
    s_end = min(np.float32(ray.s_end), FAR)
    # A ray straight towards or away from the eye stays in its pixel: one sample is all of it.
    step = min(stride / max(abs(dx), abs(dy)), FAR)
    first = F0
    s_free = F0
    passed = False  # behind a surface
    number = jitter
    steps = 0
    while first < s_end:
        at = min(number * step, s_end)
        last = min((number + HALF) * step, s_end)
        number += np.float32(1.0)
        i = clamp(int(x + dx * at), 0, width - 1)
        j = clamp(int(y + dy * at), 0, height - 1)
        # The pixel that a ray starts from is not compared with itself.
        if not (i == own_x and j == own_y):
            if steps == max_steps:
                return EXHAUSTED, False, -1, -1, F0, s_free, steps
            steps += 1
            surface = depth[j, i]
            a, b = z0 + dz * first, z0 + dz * last
            if surface > F0 and min(a, b) <= surface:
                if max(a, b) >= slab_bottom(surface, slab_a, slab_b):
                    return HIT, True, i, j, nearest_s(surface, z0, dz, first, last), s_free, steps
                passed = True
        if not passed:
            s_free = last
        first = last
    if passed:
        return HIDDEN, False, -1, -1, F0, s_free, steps
    return ray.status, False, -1, -1, F0, s_end, steps
