"""The truth where float32, and float64, would err: each test is a case that others get wrong."""

from fractions import Fraction

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt import Verdict
from naive import judge as naive
from naive import triangle as exact


def scene_of(triangles):
    vertices = np.array(triangles, np.float32).reshape(-1, 3)
    return hrt.Scene.from_arrays(vertices, np.arange(len(vertices)).reshape(-1, 3))


def ball(offset, radius):
    """A closed mesh of 16 x 24 x 2 triangles, poles with triangles without area included."""
    theta, phi = np.linspace(0, np.pi, 17), np.linspace(0, 2 * np.pi, 25)[:-1]
    i, j = (x.ravel() for x in np.meshgrid(np.arange(16), np.arange(24), indexing="ij"))
    sine = np.sin(theta)
    sine[[0, -1]] = 0  # all vertices of a pole are one point
    x, z = np.outer(sine, np.cos(phi)), np.outer(sine, np.sin(phi))
    y = np.outer(np.cos(theta), np.ones(24))
    v = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    a, b, c, d = i * 24 + j, (i + 1) * 24 + j, (i + 1) * 24 + (j + 1) % 24, i * 24 + (j + 1) % 24
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return hrt.Scene.from_arrays(radius * v + offset, faces)


def targets(scene, kind, n, rng):
    corners = scene.vertices[scene.faces[rng.integers(0, len(scene), n)]].astype(float)
    if kind == "vertex":
        return corners[:, 0]
    s = rng.random((n, 1))
    return s * corners[:, 0] + (1 - s) * corners[:, 1]


@pytest.mark.parametrize("kind", ["vertex", "edge"])
@pytest.mark.parametrize(("offset", "radius"), [(0, 1), (1e3, 1), (1e6, 50), (0, 1e-12), (0, 1e9)])
def test_nothing_passes_a_closed_mesh(kind, offset, radius):
    """From inside, and from outside well within the silhouette: robust Embree lets some through."""
    scene, rng, n = ball(offset, radius), np.random.default_rng(0), 400
    truth = hrt.Truth(scene)
    target = targets(scene, kind, n, rng)
    inside = offset + radius * rng.uniform(-0.3, 0.3, (n, 3))
    normal = (target - offset) / radius
    outside = target + radius * (2 * normal + 0.3 * rng.uniform(-1, 1, (n, 3)))
    for origin in (inside, outside):
        rays = hrt.Rays.from_arrays(origin, target - origin.astype(np.float32))
        found = truth.nearest(rays)
        assert (found.prim_id >= 0).all()
        assert (np.abs(found.t - 1) < 0.2).all()
        state, t = truth.touch(rays, found.prim_id)
        assert (state == 2).all()
        assert (np.abs(t - found.t) <= 2 * found.t_error).all()


@pytest.mark.parametrize("robust", [True, False])
def test_rays_that_embree_lets_through_are_its_errors(robust):
    """A claim by brute force is never blamed, Embree's misses are, whoever claims what."""
    scene, rng, n = ball(0, 1), np.random.default_rng(1), 3000
    target = targets(scene, "vertex", n, rng)
    origin = rng.uniform(-0.3, 0.3, (n, 3)).astype(np.float32)
    rays = hrt.Rays.from_arrays(origin, target - origin)
    path = "packet" if hrt.embree_problem() is None else "run"
    embree = hrt.EmbreeTracer(scene, robust=robust, path=path).intersect(rays)
    camera, every = hrt.Camera.look_at((0, 0, 0), (0, 0, -1)), np.ones(n, bool)
    leaks = embree.prim_id < 0
    assert robust or leaks.any()
    itself = hrt.judge(rays, embree, every, embree, scene, camera, every=True)
    assert (itself.reference_wrong == leaks).all()
    assert (itself.verdict == np.where(leaks, Verdict.FALSE_MISS, Verdict.CORRECT)).all()
    slow = hrt.judge(
        rays, hrt.BruteForceTracer(scene).intersect(rays), every, embree, scene, camera
    )
    assert np.isin(slow.verdict, [Verdict.CORRECT, Verdict.TIE, Verdict.REFERENCE_WRONG]).all()
    assert (slow.reference_wrong == leaks).all()


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_grazing_slivers(offset):
    """Rays at 0.05 to 1 degree to slivers as thin, some of them two slivers deep."""
    rng = np.random.default_rng(2)
    triangles, rays = [], []
    for _ in range(250):
        a = rng.normal(size=3) + offset
        along, side = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
        width = np.radians(rng.uniform(0.05, 1)) * (1 if offset == 0 else 200)
        triangle = np.array([a, a + 2 * along, a + along + width * side])
        angle = np.radians(rng.uniform(0.05, 1))
        d = np.cos(angle) * side + np.sin(angle) * np.cross(along, side)
        rays.append((rng.dirichlet((1, 1, 1)) @ triangle - 2 * d, d))
        triangles.append(triangle)
    scene = scene_of(triangles)
    origin, direction = np.array(rays).transpose(1, 0, 2)
    rays = hrt.Rays.from_arrays(origin, direction)
    found = hrt.Truth(scene).nearest(rays)
    own_state, own_t = hrt.Truth(scene).touch(rays, np.arange(250))
    hits = 0
    for i in range(250):
        own = exact.intersect(rays.origin[i], rays.direction[i], scene.vertices[3 * i : 3 * i + 3])
        own_hit = own is not None and own[0] >= 0
        assert (own_state[i] == 2) == own_hit
        if own_hit:
            hits += 1
            assert abs(Fraction(own_t[i]) - own[0]) <= Fraction(2.0**-30) * own[0]
        prim, t, _, _ = naive.nearest(
            rays.origin[i], rays.direction[i], 0, np.inf, scene.vertices[scene.faces]
        ) if i % 25 == 0 else (found.prim_id[i], None, None, None)  # fmt: skip
        assert found.prim_id[i] == prim
        if t is not None:
            assert abs(Fraction(found.t[i]) - t) <= Fraction(found.t_error[i])
    assert hits > 30


def test_triangles_without_area_change_nothing():
    scene, rng, n = ball(0, 1), np.random.default_rng(3), 1000
    corners = scene.vertices[scene.faces[rng.integers(0, len(scene), 300)]]
    flat = corners[:, [0, 1, 0]].copy()  # an edge, there and back
    flat[::3, 2] = flat[::3, 0]
    flat[1::3] = flat[1::3, :1]  # a point
    more = hrt.Scene.from_meshes([
        hrt.Mesh.from_arrays(scene.vertices, scene.faces),
        hrt.Mesh.from_arrays(flat.reshape(-1, 3), np.arange(900).reshape(-1, 3)),
    ])  # fmt: skip
    target = targets(scene, "edge", n, rng)
    origin = rng.uniform(-0.3, 0.3, (n, 3)).astype(np.float32)
    rays = hrt.Rays.from_arrays(origin, target - origin)
    without, with_flat = hrt.Truth(scene).nearest(rays), hrt.Truth(more).nearest(rays)
    for name in ("prim_id", "t", "t_grazed"):
        assert getattr(without, name).tobytes() == getattr(with_flat, name).tobytes()


def test_collinear_corners_that_rounding_bends_have_no_area():
    """All three lie on y = 3 x, but float64 rounds the differences, each to its own spacing."""
    triangle = np.array([(2.0**-52, 3 * 2.0**-52, -1), (1, 3, -1), (3, 9, -1)])
    u, v = triangle[1] - triangle[0], triangle[2] - triangle[0]
    assert u[0] * v[1] - u[1] * v[0] != 0
    truth = hrt.Truth(scene_of([triangle]))
    rays = hrt.Rays.from_arrays([(0.0, 0, 0)] * 2, [(1.0, 3, -1), (3.0, 9, -1)])
    assert (truth.touch(rays, [0, 0])[0] == 0).all()
    found = truth.nearest(rays)
    assert (found.prim_id == -1).all()
    assert np.isinf(found.t_grazed).all()


def test_limit_and_t_that_differ_by_less_than_float64_are_told_apart():
    """t is 1/3, which lies between two float32, and 1 + 2**-60, which lies beside a float32."""
    square = [[(-1, -1, -1), (1, -1, -1), (0, 2, -1)]]
    truth = hrt.Truth(scene_of(square))
    third = np.float32(1 / 3)  # above 1/3
    below = np.nextafter(third, np.float32(0))
    rays = hrt.Rays.from_arrays(
        np.zeros((4, 3)), np.full((4, 3), (0, 0, -3.0)), None,
        [third, below, 0, 0], [np.inf, np.inf, third, below],
    )  # fmt: skip
    assert truth.nearest(rays).prim_id.tolist() == [-1, 0, 0, -1]
    # From z = 2**-60 towards a plane at -1: t exceeds 1 by an amount that float64 does not see.
    near_one = hrt.Rays.from_arrays(
        [(0, 0, 2.0**-60)] * 2, [(0, 0, -1.0)] * 2, None, [1.0, 0.0], [2.0, 1.0]
    )
    found = truth.nearest(near_one)
    assert found.prim_id.tolist() == [0, -1]
    assert found.exact.all()


def test_order_that_float64_does_not_see_is_exact():
    """Two parallel triangles that lie 2**-80 apart, in both orders."""
    front = np.array([(-1, -1, 2.0**-80), (1, -1, 2.0**-80), (0, 2, 2.0**-80)])
    back = front * (1, 1, 0)
    for triangles in ([front, back], [back, front]):
        rays = hrt.Rays.from_arrays([(0, 0, 1.0), (0, 0, -1.0)], [(0, 0, -1.0), (0, 0, 1.0)])
        found = hrt.Truth(scene_of(triangles)).nearest(rays)
        first = 0 if triangles[0] is front else 1
        assert found.prim_id.tolist() == [first, 1 - first]
        assert found.exact.all()


@pytest.mark.parametrize("exponent", [-140, -100, 100, 125])
def test_length_of_the_direction_changes_nothing_but_t(exponent):
    scene, rng, n = ball(0, 1), np.random.default_rng(4), 300
    direction = rng.integers(-1000, 1000, (n, 3)) / 512.0
    rays = hrt.Rays.from_arrays(np.zeros((n, 3)), direction)
    scaled = hrt.Rays.from_arrays(np.zeros((n, 3)), direction * 2.0**exponent)
    truth = hrt.Truth(scene)
    a, b = truth.nearest(rays), truth.nearest(scaled)
    assert (a.prim_id >= 0).all()
    assert (a.prim_id == b.prim_id).all()
    np.testing.assert_allclose(b.t * 2.0**exponent, a.t, rtol=1e-9)


@pytest.mark.parametrize("slope", [0, 2])
def test_rays_in_a_plane_hit_none_of_it(slope):
    """A floor, or a ramp, of many triangles seen exactly edge-on, and what stands on it."""
    x, y = (k.ravel() for k in np.meshgrid(np.arange(12), np.arange(12), indexing="ij"))
    corners = [(x + i, y + j, x + i + slope * (y + j)) for i, j in [(0, 0), (1, 0), (1, 1)]]
    floor = np.array(corners).transpose(2, 0, 1)
    wall = np.array([[(12, -40, -1), (12, 52, -1), (12, 6, 90)]])
    scene = scene_of(np.concatenate([floor, wall]))
    direction = np.array([(1, 0, 1), (4, 1, 4 + slope), (3, 1, 3 + slope), (1, 1, 1 + slope)])
    origin = np.tile((0.5, 0.25, 0.5 + slope * 0.25), (4, 1))
    rays = hrt.Rays.from_arrays(origin, direction.astype(float))
    found = hrt.Truth(scene).nearest(rays)
    assert found.prim_id.tolist() == [144] * 4
    np.testing.assert_allclose(found.t, [11.5, 11.5 / 4, 11.5 / 3, 11.5], rtol=1e-12)
    assert (found.t_grazed < 1).all()


@pytest.mark.parametrize("offset", [1e3, 1e6])
def test_scenes_far_from_the_origin(offset):
    rng = np.random.default_rng(6)
    triangles = rng.normal(size=(40, 1, 3)) * 4 + 2 * rng.normal(size=(40, 3, 3)) + offset
    scene = scene_of(triangles)
    rays = hrt.Rays.from_arrays(rng.normal(size=(60, 3)) + offset, rng.normal(size=(60, 3)))
    found = hrt.Truth(scene).nearest(rays)
    for i in range(60):
        prim, t, _, _ = naive.nearest(
            rays.origin[i], rays.direction[i], 0, np.inf, scene.vertices[scene.faces]
        )
        assert found.prim_id[i] == prim
        if t is not None:
            assert abs(Fraction(found.t[i]) - t) <= Fraction(found.t_error[i])
    assert 10 < (found.prim_id >= 0).sum() < 60


def test_rays_in_a_plane_but_for_their_rounding():
    """t is the quotient of two numbers that cancel almost wholly: float64 keeps half its digits."""
    rng, n, cancelled = np.random.default_rng(7), 300, 0
    for _ in range(n):
        triangle = rng.normal(size=(3, 3)).astype(np.float32)
        a, b, c = triangle.astype(float)
        target, direction = rng.dirichlet((1, 1, 1)) @ triangle, rng.normal() * (b - a) + c - a
        rays = hrt.Rays.from_arrays([target - 2 * direction], [direction])
        truth = hrt.Truth(scene_of([triangle]))
        found, (state, t) = truth.nearest(rays), truth.touch(rays, [0])
        own = exact.intersect(rays.origin[0], rays.direction[0], triangle)
        hit = own is not None and own[0] >= 0
        assert (found.prim_id[0] == 0) == hit
        assert (state[0] == 2) == hit
        if hit:
            cancelled += bool(found.exact[0])
            assert found.t_error[0] <= 2.0**-30 * found.t[0]
            assert abs(Fraction(found.t[0]) - own[0]) <= Fraction(found.t_error[0])
            assert t[0] == pytest.approx(float(own[0]), rel=1e-9)
    assert cancelled > 10
