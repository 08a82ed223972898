"""What cameras are, by their definitions."""

import math


def is_parallel(camera):
    """Are the lines of sight of a camera parallel."""
    return hasattr(camera, "view_height")


def scales(camera):
    """Return pixels across and down of a length of 1: at the distance 1, or anywhere."""
    if is_parallel(camera):
        down = camera.height / camera.view_height
    else:
        down = 0.5 * camera.height / math.tan(math.radians(camera.vfov_deg) / 2)
    return camera.aspect * down, down


def middle(camera):
    """Return where on the screen the eye's own line of sight along the view is."""
    return (
        0.5 * camera.width + camera.shift_px[0],
        0.5 * camera.height + camera.shift_px[1],
    )


def rows(camera):
    """Return four rows of four: (x w, y w, w, d) of a point (p - eye, 1), and depth is d / w."""
    (fx, fy), (cx, cy) = scales(camera), middle(camera)
    right, up, forward = camera.right, camera.up, camera.forward
    if is_parallel(camera):
        deep = camera.far - camera.near
        return [
            [*(fx * r for r in right), cx],
            [*(-fy * u for u in up), cy],
            [0.0, 0.0, 0.0, 1.0],
            [*(-w / deep for w in forward), camera.far / deep],
        ]
    return [
        [*(fx * r + cx * w for r, w in zip(right, forward, strict=True)), 0.0],
        [*(-fy * u + cy * w for u, w in zip(up, forward, strict=True)), 0.0],
        [*forward, 0.0],
        [0.0, 0.0, 0.0, camera.near],
    ]


def z_of(camera, depth):
    """Return how far along the view from the eye a depth is."""
    if is_parallel(camera):
        return camera.far - depth * (camera.far - camera.near)
    return math.inf if depth == 0 else camera.near / depth


def depth_of(camera, z):
    """Return the depth of a distance along the view."""
    if is_parallel(camera):
        return (camera.far - z) / (camera.far - camera.near)
    return 0.0 if math.isinf(z) else camera.near / z
