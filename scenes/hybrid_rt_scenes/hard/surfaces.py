"""Hard cases that are hard by the shape and the number of their triangles."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

import hybrid_rt as hrt
from hybrid_rt.kernels.arrays import F64, I64
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
    scattered,
    scene_of,
    sphere_directions,
    starts,
    straight,
    triangles,
)
from hybrid_rt_scenes.primitives import Part, boxes, quad
from hybrid_rt_scenes.simple import geodesic

FLOOR = quad([-4, 0, 4], [8, 0, 0], [0, 0, -8])
BACK = quad([-4, 0, -4], [8, 0, 0], [0, 2.5, 0])


def _creases() -> BuiltCase:
    # Valleys of a zigzag, cut along the view, and the corner of the room.
    x = np.linspace(-3, 3, 13)
    y = np.where(np.arange(13) % 2, 0.5, 0.0)
    points = np.stack([np.stack([x, y, np.full(13, z)], axis=1) for z in (2.0, -3.0)])
    lattice = Part(points.reshape(-1, 3), _strip(13))
    scene = scene_of(lattice, quad([-3, 0, -3], [6, 0, 0], [0, 2, 0]))
    camera = front()
    some = starts(scene, camera, 900)
    # Closest to a crease: where the normal changes between neighbouring pixels.
    rng = np.random.default_rng(20)
    return case(
        scene, camera,
        joined(some.towards(some.mirror), some.towards(sphere_directions(rng, len(some)))),
    )  # fmt: skip


def _strip(n: int) -> I64:
    a = np.arange(n - 1)
    return np.concatenate([np.stack([a, a + 1, a + n], 1), np.stack([a + 1, a + n + 1, a + n], 1)])


def _one_pixel_gaps() -> BuiltCase:
    # A fence whose gaps are one pixel wide, with a ball and the sky behind it.
    camera = straight()
    unit = 2 * 3.5 / HEIGHT  # a pixel at z_view 3.5
    left = np.arange(-WIDTH // 2, WIDTH // 2, 3) * unit + 0.37 * unit
    zeros = np.zeros_like(left)
    slats = boxes(
        np.stack([left, zeros, zeros], 1), np.stack([left + 2 * unit, zeros + 2, zeros + 0.02], 1)
    )
    ball = geodesic(3, 0.7).moved([0.3, 0.8, -1.5])
    scene = scene_of(FLOOR, slats, ball)
    rng = np.random.default_rng(21)
    start = np.stack(
        [rng.uniform(-2, 2, 700), rng.uniform(0.2, 1.8, 700), rng.uniform(1, 3, 700)], axis=1
    )
    through = start + [0, 0, -1] + rng.uniform(-0.3, 0.3, (700, 3)) * [1, 0.6, 0]
    return case(scene, camera, joined(aimed(start, through), mirrors(scene, camera, 500)))


def _sub_pixel_wires() -> BuiltCase:
    # Wires a twentieth of a pixel wide before a distant wall: most miss every pixel's centre.
    x = np.linspace(-1.9, 1.9, 14)
    w = 0.004
    upright = boxes(
        np.stack([x, 0 * x, 0 * x + 0.5], 1), np.stack([x + w, 0 * x + 2.4, 0 * x + 0.5 + w], 1)
    )
    y = np.linspace(0.15, 2.2, 9)
    level = boxes(
        np.stack([0 * y - 2, y, 0 * y], 1), np.stack([0 * y + 2, y + w, 0 * y + w], axis=1)
    )
    scene = scene_of(FLOOR, BACK, upright, level)
    camera = front()
    some = starts(scene, camera, 800)
    rng = np.random.default_rng(22)
    at_upright = np.stack(
        [x[rng.integers(0, 14, 800)] + w / 2, rng.uniform(0.1, 2.3, 800), np.full(800, 0.5)], axis=1
    )
    at_level = np.stack(
        [rng.uniform(-2, 2, 800), y[rng.integers(0, 9, 800)] + w / 2, np.full(800, w)], axis=1
    )
    return case(scene, camera, joined(some.aimed(at_upright), some.aimed(at_level)))


def _unseen_triangles() -> BuiltCase:
    # Specks between the pixels' centres.
    camera = straight()
    x, y = (k.ravel() for k in np.meshgrid(np.arange(4, WIDTH - 4, 6), np.arange(4, 40, 6)))
    z = 2.0 + (x * 7 + y * 3) % 11 / 11
    corners = [on_screen(camera, x + dx, y + dy, z) for dx, dy in ((-0.3, 0), (0.3, 0.1), (0, 0.4))]
    specks = Part(np.stack(corners, axis=1).reshape(-1, 3), np.arange(3 * len(x)).reshape(-1, 3))
    scene = scene_of(FLOOR, BACK, specks)
    middle = np.mean(corners, axis=0)
    some = starts(scene, camera, 900)
    rng = np.random.default_rng(23)
    return case(
        scene, camera, joined(some.aimed(middle[rng.integers(0, len(x), len(some))]),
                              scattered(scene, camera, 300)),
    )  # fmt: skip


def _silhouettes() -> BuiltCase:
    # Rays that skim past a ball and a block, half a pixel to either side of the outline.
    ball = geodesic(4, 0.8).moved([-0.8, 0.9, -1.0])
    block = boxes([0.5, 0, -1.5], [1.1, 1.6, -0.8])
    scene = scene_of(FLOOR, BACK, ball, block)
    camera = front()
    some = starts(scene, camera, 1200)
    rng = np.random.default_rng(24)
    n = len(some)
    ray = np.array([-0.8, 0.9, -1.0]) - some.origin
    side = np.cross(ray, sphere_directions(rng, n))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    skim = np.array([-0.8, 0.9, -1.0]) + side * rng.normal(0.8, 0.03, (n, 1))
    edge = np.stack(
        [rng.choice([0.5, 1.1], n), rng.uniform(0, 1.7, n), rng.choice([-1.5, -0.8], n)], axis=1
    ) + rng.normal(0, 0.01, (n, 3))
    half = rng.random((n, 1)) < 0.5
    return case(scene, camera, some.aimed(np.where(half, skim, edge)))


def _behind_thin_panels() -> BuiltCase:
    # Panels of paper before a distant wall; rays pass close behind them.
    n = 6
    x = np.linspace(-2.2, 1.4, n)
    low = np.stack([x, np.full(n, 0.25), np.linspace(-0.6, 0.6, n)], axis=1)
    panels = boxes(low, low + np.array([0.5, 1.6, 0.002]))
    scene = scene_of(FLOOR, quad([-9, 0, -14], [18, 0, 0], [0, 9, 0]), panels)
    camera = front()
    rng = np.random.default_rng(25)
    pick = rng.integers(0, n, 1500)
    behind = low[pick] + rng.uniform([-0.3, 0, -0.6], [0.8, 1.6, -0.005], (1500, 3))
    sideways = rng.normal(size=(1500, 3)) * [1.0, 0.6, 0.15]
    free = aimed(behind, behind + sideways)
    some = starts(scene, camera, 700)
    rising = some.aimed(low[rng.integers(0, n, len(some))] + [0.25, 1.2, -0.15])
    return case(scene, camera, joined(free, rising))


def _posts_between_steps() -> BuiltCase:
    # Posts one pixel wide, far apart; rays cross many pixels to meet them.
    camera = straight(128, 48)
    x = np.arange(-4.2, 4.3, 0.7)
    posts = boxes(
        np.stack([x, 0 * x, 0 * x], axis=1), np.stack([x + 0.11, 0 * x + 1.9, 0 * x + 0.11], axis=1)
    )
    scene = scene_of(quad([-8, 0, 4], [16, 0, 0], [0, 0, -8]), posts)
    rng = np.random.default_rng(26)
    start = rng.uniform([-4, 0.2, 0.05], [4, 1.7, 1.2], (1200, 3))
    end = np.stack([rng.uniform(-4, 4, 1200), rng.uniform(0.2, 1.8, 1200), np.full(1200, 0.06)], 1)
    return case(scene, camera, joined(aimed(start, end), mirrors(scene, camera, 400)))


def _hidden_geometry() -> BuiltCase:
    # A box behind a wall that no pixel shows; rays reach it over and round the wall.
    wall = quad([-1.5, 0, 0], [3, 0, 0], [0, 1.5, 0])
    box = boxes([-1, 0, -2.2], [1, 1.1, -0.6])
    scene = scene_of(FLOOR, BACK, wall, box)
    camera = front()
    some = starts(scene, camera, 1200)
    rng = np.random.default_rng(27)
    inside = rng.uniform([-1, 0, -2.2], [1, 1.1, -0.6], (len(some), 3))
    return case(scene, camera, some.aimed(inside))


def _background_is_no_miss() -> BuiltCase:
    # Rays that cross only sky on screen, and then hit what stands beside the image.
    beside = [boxes([5, 0, -2], [6, 6, 2]), boxes([-6, 0, -2], [-5, 6, 2])]
    roof = quad([-5, 4.5, 4], [10, 0, 0], [0, 0, -6])
    scene = scene_of(quad([-2, 0, 2], [4, 0, 0], [0, 0, -4]), *beside, roof,
                     boxes([-0.4, 0, -1], [0.4, 0.6, -0.4]))  # fmt: skip
    camera = front()
    return case(
        scene, camera,
        joined(mirrors(scene, camera), scattered(scene, camera, 700)),
    )  # fmt: skip


def _background_holes() -> BuiltCase:
    # A wall of tiles with every third one missing, and a panel behind some of the holes.
    i, j = (k.ravel() for k in np.meshgrid(np.arange(12), np.arange(7)))
    kept = (i + j) % 3 != 0
    corner = np.stack([i * 0.4 - 2.4, j * 0.35, 0 * i], axis=1)[kept].astype(float)
    tiles = [quad(c, [0.4, 0, 0], [0, 0.35, 0]) for c in corner]
    scene = scene_of(FLOOR, *tiles, quad([-2, 0, -3], [1.5, 0, 0], [0, 2.2, 0]))
    camera = front()
    some = starts(scene, camera, 600)
    rng = np.random.default_rng(28)
    holes = np.stack([i * 0.4 - 2.2, j * 0.35 + 0.17, 0 * i - 0.01], axis=1)[~kept]
    start = rng.uniform([-2, 0.2, 0.5], [2, 2, 2.5], (600, 3))
    at = holes[rng.integers(0, len(holes), 600)] + rng.uniform(-0.25, 0.25, (600, 3)) * [1, 1, 0]
    return case(scene, camera, joined(aimed(start, at), scattered(scene, camera, 300),
                                      some.towards(some.mirror)))  # fmt: skip


def _t_junctions() -> BuiltCase:
    # A long edge against two short ones whose common corner float32 does not put on it.
    a, b = np.array([-3.0, 0, 3.1]), np.array([2.9, 0.7, -3.3])
    parts = [triangles([a, b, [-3.5, 1.5, -2.5]])]
    cuts = a + np.array([0, 0.137, 0.31, 0.5773, 0.83, 1])[:, None] * (b - a)
    below = np.array([3.3, -0.4, 2.7])
    parts += [triangles([p, below, q]) for p, q in pairwise(cuts)]
    scene = scene_of(*parts)
    camera = front()
    some = starts(scene, camera, 300)
    rng = np.random.default_rng(29)
    start = rng.uniform([-2, 1.5, -1], [2, 3, 3], (900, 3))
    on_edge = a + rng.random((900, 1)) * (b - a)
    on_edge[::3] = cuts[rng.integers(1, 5, 300)]
    above = on_edge[: len(some)] + np.array([0, 1e-3, 0])
    return case(scene, camera, joined(aimed(start, on_edge), some.aimed(above)))


def _interpenetrating() -> BuiltCase:
    # Sheets that pass through one another and through the floor.
    rng = np.random.default_rng(30)
    centre = rng.uniform([-1.5, 0.0, -2], [1.5, 1.2, 1], (14, 1, 3))
    sheets = centre + rng.normal(0, 0.8, (14, 3, 3))
    scene = scene_of(FLOOR, BACK, triangles(*sheets))
    camera = front()
    return case(scene, camera, joined(mirrors(scene, camera, 700), scattered(scene, camera, 700)))


def _duplicates() -> BuiltCase:
    # Every triangle twice or three times, wound both ways.
    box = boxes([-1, 0, -1.5], [0.2, 1, -0.5])
    reverse = Part(box.vertices, box.faces[:, ::-1])
    scene = scene_of(FLOOR, BACK, box, reverse, box, BACK)
    camera = front()
    return case(scene, camera, joined(mirrors(scene, camera, 600), scattered(scene, camera, 500)))


def _sphere_targets(scene: hrt.Scene, kind: str, n: int, rng: np.random.Generator) -> F64:
    corners = scene.vertices[scene.faces[rng.integers(0, len(scene), n)]].astype(np.float64)
    if kind == "vertices":
        return np.asarray(corners[:, 0])
    s = rng.random((n, 1))
    return np.asarray(s * corners[:, 0] + (1 - s) * corners[:, 1])


def _closed_from_inside(kind: str) -> BuiltCase:
    scene = scene_of(geodesic(4, 1.0))
    camera = hrt.Camera.look_at(
        (0.1, 0.05, 0.3), (0, 0, -1), vfov_deg=80, width=WIDTH, height=HEIGHT, near=0.01
    )
    rng = np.random.default_rng(31)
    target = _sphere_targets(scene, kind, 900, rng)
    some = starts(scene, camera, 400)
    return case(scene, camera, joined(aimed(rng.uniform(-0.4, 0.4, (900, 3)), target),
                                      some.aimed(target[: len(some)])))  # fmt: skip


def _closed_from_outside(kind: str) -> BuiltCase:
    ball = geodesic(4, 1.0)
    scene = scene_of(ball.moved([0, 1.1, -1]), FLOOR)
    camera = front()
    rng = np.random.default_rng(32)
    target = _sphere_targets(scene_of(ball.moved([0, 1.1, -1])), kind, 900, rng)
    start = rng.uniform([-2, 0.1, 0.5], [2, 2.5, 3], (900, 3))
    some = starts(scene, camera, 400)
    return case(scene, camera, joined(aimed(start, target), some.aimed(target[: len(some)])))


def _slivers() -> BuiltCase:
    # A fan of needles 1e-3 to 1e-6 wide, and a floor of long thin strips.
    rng = np.random.default_rng(33)
    a = rng.uniform([-2, 0.1, -2], [2, 1.5, 1], (40, 3))
    along = sphere_directions(rng, 40)
    side = np.cross(along, sphere_directions(rng, 40))
    width = 10.0 ** rng.uniform(-6, -2, (40, 1))
    needles = np.stack([a, a + 2.5 * along, a + 1.2 * along + width * side], axis=1)
    strips = quad([-4, 0, 4], [8, 0, 0], [0, 0, -8], (1, 60))
    scene = scene_of(strips, BACK, triangles(*needles))
    camera = front()
    some = starts(scene, camera, 900)
    weights = rng.dirichlet((1, 1, 1), len(some))
    on_needles = np.einsum("nk,nkx->nx", weights, needles[rng.integers(0, 40, len(some))])
    return case(scene, camera, joined(some.aimed(on_needles), mirrors(scene, camera, 500)))


def _zero_area() -> BuiltCase:
    # Triangles that are lines or points, in front of ones that are not.
    rng = np.random.default_rng(34)
    p = rng.integers(-8, 8, (30, 3)) / 8 + [0, 1, 0]
    step = rng.integers(1, 4, (30, 3)) / 8
    lines = np.stack([p, p + step, p + 2 * step], axis=1)
    points = np.repeat(p[:10, None], 3, axis=1)
    flat = np.stack([p[:10], p[:10] + step[:10], p[:10]], axis=1)
    scene = scene_of(triangles(*lines, *points, *flat), FLOOR, BACK)
    camera = front()
    some = starts(scene, camera, 900)
    return case(scene, camera, joined(some.aimed((p + step)[rng.integers(0, 30, len(some))]),
                                      mirrors(scene, camera, 300)))  # fmt: skip


CASES = (
    HardCase("concave_creases", "Rays from close to a crease hit the neighbouring face within a "
             "pixel, where a bias or a skipped first pixel looks over it.", _creases),
    HardCase("one_pixel_gaps", "Through gaps a pixel wide there is a way that coarse cells, "
             "strides and thickness close.", _one_pixel_gaps),
    HardCase("sub_pixel_wires", "Wires narrower than a pixel stand in the depth buffer here and "
             "there only; rays that hit them look free.", _sub_pixel_wires),
    HardCase("unseen_triangles", "Triangles that touch no pixel's centre are in no depth buffer at "
             "all.", _unseen_triangles),
    HardCase("silhouettes", "Next to an outline the pixel's depth belongs to one surface and the "
             "ray meets the other.", _silhouettes),
    HardCase("behind_thin_panels", "Rays that pass behind a thin panel before a distant wall hit "
             "nothing there: a thickness says that they do.", _behind_thin_panels),
    HardCase("posts_between_steps", "Posts one pixel wide stand between two samples of a stride.",
             _posts_between_steps),
    HardCase("hidden_geometry", "What the ray hits is hidden by what the pixel shows, and taking "
             "the ray to pass behind freely goes through it.", _hidden_geometry),
    HardCase("background_is_no_miss", "The ray sees only background on screen and hits what stands "
             "beside the image: calling it a miss loses it.", _background_is_no_miss),
    HardCase("background_holes", "Pixels of background lie between pixels of a wall: filled by "
             "coarse cells, or holes where a thickness ends.", _background_holes),
    HardCase("t_junctions", "Rounding opens cracks where a corner lies on another triangle's edge.",
             _t_junctions),
    HardCase("interpenetrating", "Two surfaces swap their order within a pixel.",
             _interpenetrating),
    HardCase("duplicates", "Of triangles in the same place, wound either way, either may answer, "
             "and none may hide a ray's start.", _duplicates),
    HardCase("closed_inside_edges", "From inside a closed mesh nothing may leak out through an "
             "edge.", lambda: _closed_from_inside("edges")),
    HardCase("closed_inside_vertices", "From inside a closed mesh nothing may leak out through a "
             "vertex, where five or six triangles each may say no.",
             lambda: _closed_from_inside("vertices")),
    HardCase("closed_outside_edges", "From outside, a ray through an edge that leaks is answered "
             "by the far side of the ball.", lambda: _closed_from_outside("edges")),
    HardCase("closed_outside_vertices", "From outside, a ray through a vertex that leaks is "
             "answered by the far side of the ball.", lambda: _closed_from_outside("vertices")),
    HardCase("slivers", "Needles thinner than float32 resolves cover no centre, and their planes "
             "run away seen edge-on.", _slivers),
    HardCase("zero_area", "Triangles without area have no plane and must neither hide nor answer.",
             _zero_area),
)  # fmt: skip
