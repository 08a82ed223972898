"""The two techniques that sample the depth buffer along a ray, in float64, as published."""

import math

from naive.walk import EXHAUSTED, HIT, Ray

FRONT, INSIDE, BEHIND = range(3)


def _compare(ray, own, t, thickness):
    """Return where the ray's point is in respect of its pixel's slab, and the pixel."""
    pixel = ray.pixel(t)
    surface = ray.view.depth[pixel[1]][pixel[0]]
    if surface <= 0 or pixel == tuple(own):
        return FRONT, pixel
    behind = ray.z(t) - ray.view.z_of(surface)
    camera = ray.view.camera
    scale = camera.far - camera.near if ray.view.parallel else ray.z(t)
    ray.decide(behind / scale, (behind - thickness) / scale)
    if behind < 0:
        return FRONT, pixel
    return (INSIDE if behind <= thickness else BEHIND), pixel


def linear(
    view, origin, direction, own, t_near, t_far, *, thickness, stride, refinements, max_steps
):
    """March in equal steps of the world (Sousa et al., 2011)."""
    ray = Ray(view, origin, direction, t_near, t_far)
    if ray.early:
        return ray.early
    unit = view.camera.view_height if view.parallel else ray.z(t_near)
    step = stride * unit / ray.length
    t_free, passed, k = t_near, False, 0
    while True:
        k += 1
        t = t_near + k * step
        if not math.isinf(ray.t_end):
            ray.decide((t - ray.t_end) / (ray.t_end + step))
        if t >= ray.t_end:
            return ray.ended(passed, t_free)
        if k > max_steps:
            return ray.answer(EXHAUSTED, t_free=t_free)
        where, pixel = _compare(ray, own, t, thickness)
        if where == INSIDE:
            break
        passed = passed or where == BEHIND
        t_free = t_free if passed else t
    low, high = t - step, t
    for _ in range(refinements):
        middle = 0.5 * (low + high)
        where, its_pixel = _compare(ray, own, middle, thickness)
        if where == INSIDE:
            high, pixel = middle, its_pixel
        else:
            low = middle
    return ray.answer(HIT, pixel, high, t_free)


def dda(view, origin, direction, own, t_near, t_far, *, thickness, stride, jitter, max_steps):
    """Sample every `stride` pixels of the ray's longer axis (McGuire and Mara, 2014)."""
    ray = Ray(view, origin, direction, t_near, t_far)
    if ray.early:
        return ray.early
    start = ray.at(t_near)
    speed = [ray.qd[axis] - start[axis] * ray.qd[2] for axis in (0, 1)]
    axis = 0 if abs(speed[0]) >= abs(speed[1]) else 1
    ray.decide(abs(abs(speed[0]) - abs(speed[1])) / (max(map(abs, speed)) or 1.0))

    def place(number):
        """Return the t of so many strides along the line, or of the end if that comes before."""
        t = ray.reach(axis, start[axis] + math.copysign(number * stride, speed[axis]))
        # The line's point at infinity lies a finite number of pixels away; what is beyond it has
        # a t behind the start.
        if speed[axis] == 0 or (number > 0 and (t is None or t < t_near)):
            return ray.t_end
        return min(t, ray.t_end) if number else t_near

    t_free, passed, number, steps, first = t_near, False, jitter, 0, t_near
    while first < ray.t_end:
        at = place(number) if speed[axis] or number else t_near
        last = place(number + 0.5)
        number += 1
        if last < ray.t_end:  # whether there is one more sample hangs on how near the end is
            x, y = ray.at(last), ray.at(ray.t_end)
            ray.decide(x[axis] - y[axis])
        pixel = ray.pixel(at)
        if pixel != tuple(own):
            if steps == max_steps:
                return ray.answer(EXHAUSTED, t_free=t_free)
            steps += 1
            surface = view.depth[pixel[1]][pixel[0]]
            if surface > 0:
                depths = sorted((ray.depth(first), ray.depth(last)))
                bottom = view.depth_of(view.z_of(surface) + thickness)
                ray.decide(view.differ(depths[0], surface))
                if depths[0] <= surface:
                    ray.decide(view.differ(depths[1], bottom))
                    if depths[1] >= bottom:
                        inside = min(max(surface, depths[0]), depths[1])
                        t = ray.t_of(view.z_of(inside)) if ray.zd else first
                        t = ray.t_end if inside == 0 else t
                        return ray.answer(HIT, pixel, min(max(t, first), last), t_free)
                    passed = True
        t_free = t_free if passed else last
        first = last
    return ray.ended(passed, t_free)
