"""The two techniques that read every pixel of a ray, in float64 and without any pyramid."""

from naive.walk import HIDDEN, HIT, MISS, Ray


def slope(view, origin, direction, own, t_near, t_far):
    """Compare the ray with each pixel's tilted plane where it enters and where it leaves it."""
    ray = Ray(view, origin, direction, t_near, t_far)
    if ray.early:
        return ray.early
    pieces = ray.pieces()
    if pieces and pieces[0][0] == tuple(own):
        pieces.pop(0)
    for pixel, a, b in pieces:
        surface = view.depth[pixel[1]][pixel[0]]
        if surface <= 0:
            continue

        def height(t, pixel=pixel):
            return ray.depth(t) - view.plane(pixel, *ray.at(t))

        scale = max(ray.depth(a), ray.depth(b), surface)
        ray.decide(height(a) / scale, height(b) / scale)
        if height(a) < 0:
            return ray.answer(HIDDEN, t_free=a)
        if height(b) <= 0:
            t = ray.crossing(height, a, b)
            return ray.answer(HIT, pixel, t, t)
    return ray.ended(False, 0)


def smoothstep(x):
    x = min(max(x, 0.0), 1.0)
    return 3 * x**2 - 2 * x**3


def hiz(
    view, origin, direction, own, t_near, t_far, *,
    thickness, threshold, border, trace_background,
):  # fmt: skip
    """Stop at the first pixel whose depth the ray reaches, and judge the stop by its confidence."""
    ray = Ray(view, origin, direction, t_near, t_far)
    if ray.early:
        return ray.early
    pieces = ray.pieces()
    last = pieces[-1][0] if pieces else None
    if pieces and pieces[0][0] == tuple(own):
        pieces.pop(0)
    for pixel, a, b in pieces:
        surface = view.depth[pixel[1]][pixel[0]]
        if surface <= 0:
            continue
        ray.decide(*(view.differ(ray.depth(t), surface) for t in (a, b)))
        if ray.depth(a) <= surface:
            t = a
        elif ray.depth(b) <= surface:
            t = ray.crossing(lambda t, surface=surface: ray.depth(t) - surface, a, b)
        else:
            continue
        sure = _confidence(ray, pixel, t, thickness, border)
        ray.decide(sure - threshold)
        if sure >= threshold:
            return ray.answer(HIT, pixel, t, t)
        return ray.answer(HIDDEN, t_free=t)
    if ray.end == MISS and last is not None and view.depth[last[1]][last[0]] <= 0:
        return ray.answer(MISS, t_free=t_far, resolved=not trace_background)
    return ray.ended(False, 0)


def _confidence(ray, pixel, t, thickness, border):
    view = ray.view
    # The normal of the pixel's plane in the space of q = M (p - eye, 1), turned to where
    # q_d - a q_x - b q_y - c q_w is positive.
    a, b = view.ddx[pixel[1]][pixel[0]], view.ddy[pixel[1]][pixel[0]]
    normal = (-a, -b, -view.plane(pixel, 0, 0), 1.0)
    along = [n * q for n, q in zip(normal, ray.qd, strict=True)]
    ray.decide(sum(along) / (sum(map(abs, along)) or 1.0))
    if sum(along) >= 0:
        return 0.0
    apart = abs(ray.z(t) - view.z_of(view.depth[pixel[1]][pixel[0]]))
    vignette = 1.0
    for place, size in zip(ray.at(t), (view.width, view.height), strict=True):
        if border > 0:
            vignette *= smoothstep(min(place, size - place) / (border * view.height))
    return (1 - smoothstep(apart / thickness)) * vignette
