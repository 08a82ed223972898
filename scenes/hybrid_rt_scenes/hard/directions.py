"""Hard cases that are hard by the direction, the start or the length of their rays."""

from __future__ import annotations

from itertools import product

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_scenes.hard.case import BuiltCase, HardCase
from hybrid_rt_scenes.hard.stage import (
    HEIGHT,
    WIDTH,
    aimed,
    case,
    front,
    joined,
    mirrors,
    on_screen,
    room,
    room_parts,
    scattered,
    scene_of,
    sphere_directions,
    starts,
    straight,
)
from hybrid_rt_scenes.primitives import boxes, quad


def _screen_axes() -> BuiltCase:
    scene, camera = room(), straight()
    some = starts(scene, camera, 600)
    axes = np.concatenate([np.eye(3)[:2], -np.eye(3)[:2]])
    pick = np.random.default_rng(1).integers(0, 4, len(some))
    # At the height of the eye a ray that also goes into the scene stays on one line of the image.
    level = on_screen(camera, np.arange(0.5, WIDTH), HEIGHT / 2, 3.0)
    rows = aimed(level, level + np.where(level[:, :1] < 0, 1, -1) * [2.0, 0, -0.5])
    above = on_screen(camera, WIDTH / 2, np.arange(0.5, HEIGHT), 2.5)
    columns = aimed(above, above + np.where(above[:, 1:2] < 1, 1, -1) * [0, 2.0, -0.5])
    return case(scene, camera, joined(some.towards(axes[pick]), rows, columns))


def _signed_zeros() -> BuiltCase:
    scene, camera = room(), straight(eye=(0, 1, 3.5))
    some = starts(scene, camera, 520)
    values = [v for v in product((1.0, -1.0, 0.0, -0.0), repeat=3) if any(v)]
    d = np.array(values * (len(some) // len(values) + 1))[: len(some)]
    rays = some.towards(d)
    # `towards` turns directions by negating them, which also turns the sign of zeros: both occur.
    return case(scene, camera, rays)


def _subnormal_deltas() -> BuiltCase:
    scene, camera = room(), straight()
    some = starts(scene, camera, 600)
    rng = np.random.default_rng(2)
    d = np.eye(3)[rng.integers(0, 3, len(some))] * rng.choice([-1.0, 1.0], (len(some), 1))
    tiny = rng.choice([1.4e-45, -1.4e-45, 1e-40, -1e-40, 1.2e-38, 1e-30, -1e-20], d.shape)
    return case(scene, camera, some.towards(np.where(d == 0, tiny, d)))


def _extreme_lengths() -> BuiltCase:
    scene, camera = room(), front()
    some = starts(scene, camera, 600)
    rng = np.random.default_rng(3)
    scale = 10.0 ** rng.choice([-30, -20, -6, 6, 20, 30], len(some))
    return case(scene, camera, some.towards(some.mirror * scale[:, None]))


def _parallel_to_image() -> BuiltCase:
    scene, camera = room(), straight()
    some = starts(scene, camera, 800)
    angle = np.random.default_rng(4).uniform(0, 2 * np.pi, len(some))
    d = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(some))], axis=1)
    return case(scene, camera, some.towards(d))


def _pixel_corners() -> BuiltCase:
    scene, camera = room(), straight()
    x, y = (k.ravel() for k in np.meshgrid(np.arange(2.0, WIDTH, 3), np.arange(2.0, HEIGHT, 3)))
    rays = []
    for z, step in ((2.0, (1, 1)), (3.0, (-1, 1)), (4.0, (1, -1)), (4.5, (2, 1))):
        start = on_screen(camera, x, y, z)
        rays.append(aimed(start, on_screen(camera, x + 7 * step[0], y + 7 * step[1], z)))
    deeper = on_screen(camera, x, y, 2.5)
    rays.append(aimed(deeper, on_screen(camera, x + 8, y + 8, 6.0)))
    return case(scene, camera, joined(*rays))


def _pixel_edges() -> BuiltCase:
    scene, camera = room(), straight()
    x, y = (k.ravel() for k in np.meshgrid(np.arange(1.0, WIDTH, 3), np.arange(1.5, HEIGHT, 3)))
    along = aimed(on_screen(camera, x, y, 2.2), on_screen(camera, x, y + 10, 5.0))
    x, y = (k.ravel() for k in np.meshgrid(np.arange(1.5, WIDTH, 3), np.arange(1.0, HEIGHT, 3)))
    across = aimed(on_screen(camera, x, y, 2.2), on_screen(camera, x - 12, y, 6.0))
    return case(scene, camera, joined(along, across))


def _towards_the_eye() -> BuiltCase:
    scene, camera = room(), front()
    some = starts(scene, camera, 500)
    rng = np.random.default_rng(5)
    exact = some.towards(np.array(camera.eye) - some.origin)
    beside = some.towards(np.array(camera.eye) - some.origin + 1e-4 * rng.normal(size=(500, 3)))
    return case(scene, camera, joined(exact, beside))


def _away_from_the_eye() -> BuiltCase:
    scene, camera = room(), front()
    rng = np.random.default_rng(6)
    x, y = rng.uniform(0, WIDTH, 600), rng.uniform(0, HEIGHT, 600)
    start = on_screen(camera, x, y, rng.choice([0.1, 1.0, 4.0, 5.5, 7.0], 600))
    # From in front of the surface, from behind it, and from the eye itself.
    start[::6] = np.array(camera.eye)
    return case(scene, camera, aimed(start, on_screen(camera, x, y, 9.0)))


def _crossing_near() -> BuiltCase:
    scene = scene_of(*room_parts(), boxes([-0.2, 1.1, 3.52], [0.0, 1.3, 3.6]))
    camera = straight(eye=(0, 1, 3.5), near=0.25)
    some = starts(scene, camera, 700)
    rng = np.random.default_rng(7)
    behind = np.array([0, 1, 3.5]) + rng.uniform([-1.5, -0.9, 0.02], [1.5, 1.5, 1.0], (700, 3))
    return case(scene, camera, some.aimed(behind))


def _through_w_zero() -> BuiltCase:
    scene, camera = room(), straight()
    rng = np.random.default_rng(8)
    eye = np.array(camera.eye)
    behind = eye + rng.uniform([-2, -0.9, 0.1], [2, 1, 2], (400, 3))
    ahead = eye + rng.uniform([-2, -1.2, -7], [2, 1, -0.5], (400, 3))
    in_plane = eye + rng.uniform([-3, -0.9, 0], [3, 1, 0], (200, 3))
    sideways = in_plane + rng.normal(size=(200, 3)) * [1, 1, 0]
    return case(
        scene, camera,
        joined(aimed(behind, ahead), aimed(ahead, behind), aimed(in_plane, sideways),
               aimed(in_plane, ahead[:200])),
    )  # fmt: skip


def _origin_on_near() -> BuiltCase:
    scene, camera = room(), straight(near=0.5)
    rng = np.random.default_rng(9)
    start = on_screen(camera, rng.uniform(0, WIDTH, 600), rng.uniform(0, HEIGHT, 600), camera.near)
    start[:, 2] = 3.0  # z_view is the near distance to the bit
    d = sphere_directions(rng, 600)
    d[::4, 2] = 0.0
    return case(scene, camera, aimed(start, start.astype(np.float32) + 4 * d))


def _grazing(degrees: float) -> BuiltCase:
    floor = quad([-6, 0, 4], [12, 0, 0], [0, 0, -12], (5, 7))
    low, high = np.array([[-2, 0, -3], [1, 0, -1.2]]), np.array([[-1, 0.004, -2], [2.2, 0.6, -1]])
    steps = boxes(low, high)
    scene = scene_of(floor, steps, quad([-6, 0, -8], [12, 0, 0], [0, 0.5, 0]))
    camera = front()
    some = starts(scene, camera, 900)
    some = some.take(np.flatnonzero(some.normal[:, 1] > 0.9))
    rng = np.random.default_rng(10)
    angle, rise = rng.uniform(0, 2 * np.pi, len(some)), np.radians(degrees)
    d = np.stack([np.cos(angle), np.full(len(some), np.tan(rise)), np.sin(angle)], axis=1)
    return case(scene, camera, some.towards(d))


def _coplanar_self() -> BuiltCase:
    scene, camera = room(), front()
    some = starts(scene, camera, 500)
    flat = np.cross(some.normal, sphere_directions(np.random.default_rng(11), len(some)))
    tangent = some.towards(flat)
    above = some.origin + 1e-4 * some.normal
    return case(scene, camera, joined(tangent, aimed(above, above.astype(np.float32) + flat)))


def _exhausted() -> BuiltCase:
    # Rays go along a fence of posts, close in front of it.
    low = np.stack([np.linspace(-3, 3, 25), np.zeros(25), np.full(25, -2.0)], axis=1)
    posts = boxes(low, low + np.array([0.08, 2, 0.1]))
    scene = scene_of(quad([-4, 0, 4], [8, 0, 0], [0, 0, -8]), posts,
                     quad([4, 0, 2], [0, 0, -4], [0, 2, 0]))  # fmt: skip
    camera = front(128, 32)
    rng = np.random.default_rng(12)
    start = rng.uniform([-2.5, 0.1, -1.7], [-2, 1.5, -1.5], (300, 3))
    along = aimed(start, start + rng.uniform([5, -0.05, -0.25], [6, 0.05, 0.1], (300, 3)))
    rays = joined(along, mirrors(scene, camera, 400))
    return case(scene, camera, rays, max_steps=4)


def _t_limits() -> BuiltCase:
    # Shadow rays that end at, just before and just beyond a surface, or begin behind one.
    scene, camera = room(), front()
    rays = scattered(scene, camera, 600)
    reference = case(scene, camera, rays).truth
    t = np.where(np.isfinite(reference.t), reference.t, 1.0)
    rng = np.random.default_rng(13)
    factor = rng.choice([0.5, 0.999, 1.001, 2.0], len(rays))
    ends = np.where(rng.random(len(rays)) < 0.5, np.inf, t * factor)
    begins = np.where(np.isinf(ends), t * factor, rays.t_near)
    limited = hrt.Rays.from_arrays(
        rays.origin, rays.direction, rays.pixel,
        begins.astype(np.float32), np.maximum(ends, begins).astype(np.float32),
    )  # fmt: skip
    return case(scene, camera, limited)


def _invalid() -> BuiltCase:
    scene, camera = room(), front()
    rays = mirrors(scene, camera, 300)
    o, d = rays.origin.copy(), rays.direction.copy()
    for row, (array, value) in enumerate(
        [(d, np.nan), (d, np.inf), (d, -np.inf), (o, np.nan), (o, np.inf)]
    ):
        array[row * 30 : row * 30 + 30, row % 3] = value
    d[150:180] = 0.0
    return case(scene, camera, hrt.Rays.from_arrays(o, d, rays.pixel, rays.t_near))


CASES = (
    HardCase("screen_axes", "Along a row or a column of pixels one delta is 0, and a march that "
             "divides by it takes infinite or undefined steps.", _screen_axes),
    HardCase("signed_zeros", "The reciprocal of -0 is minus infinity: the march steps back, or "
             "asks for a pixel that is not there.", _signed_zeros),
    HardCase("subnormal_deltas", "The reciprocal of a subnormal overflows, and infinity times 0 "
             "is NaN.", _subnormal_deltas),
    HardCase("extreme_lengths", "A direction of length 1e-30 or 1e30 underflows or overflows when "
             "squared or projected, and t scales with it.", _extreme_lengths),
    HardCase("parallel_to_image", "Depth does not change along the ray, so whoever steps or "
             "solves by depth divides by 0.", _parallel_to_image),
    HardCase("pixel_corners", "A ray through corners of pixels belongs to two or four of them; a "
             "march that steps in x and y at once skips the others.", _pixel_corners),
    HardCase("pixel_edges", "A ray that runs on the border of two pixels is tested against one "
             "of them only.", _pixel_edges),
    HardCase("towards_the_eye", "The ray projects to a point, has no direction on screen, and "
             "ends behind the camera where no pixel knows anything.", _towards_the_eye),
    HardCase("away_from_the_eye", "The ray projects to a point; it meets the pixel's surface, or "
             "starts behind it and meets only what is hidden.", _away_from_the_eye),
    HardCase("crossing_near", "Between the near plane and the eye there is geometry that no "
             "pixel shows, and rays that go there leave the screen's knowledge.", _crossing_near),
    HardCase("through_w_zero", "Projection divides by z_view, which is 0 or changes its sign along "
             "the ray.", _through_w_zero),
    HardCase("origin_on_near", "The ray starts with depth 1, at the limit of the clipping.",
             _origin_on_near),
    HardCase("grazing_1", "At 1 degree the ray stays within a pixel of its own surface for many "
             "pixels, and thickness or a depth bias takes that for a hit.", lambda: _grazing(1.0)),
    HardCase("grazing_0_1", "At 0.1 degree the rise over a pixel is below the depth's rounding "
             "far away.", lambda: _grazing(0.1)),
    HardCase("grazing_0_01", "At 0.01 degree the ray cannot be told from its surface by sampled "
             "depth.", lambda: _grazing(0.01)),
    HardCase("coplanar_self", "The ray lies in its own surface or hovers 1e-4 above it, and must "
             "not hit it.", _coplanar_self),
    HardCase("exhausted", "The step budget runs out in the open: taking the last sample for a hit, "
             "or for a miss, is wrong.", _exhausted),
    HardCase("t_limits", "The ray ends before, or begins behind, the surface that it would hit.",
             _t_limits),
    HardCase("invalid", "NaN, infinity and zero directions spread into a whole packet of rays, or "
             "index a pixel that is not there.", _invalid),
)  # fmt: skip
