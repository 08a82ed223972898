"""Float64 ray against triangle, where it used to go wrong elsewhere: edges, slivers, scale."""

from fractions import Fraction

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels import triangle as kernels
from naive import triangle as naive
from support.compiled import from_python

approach, frame, intersect = map(from_python, (kernels.approach, kernels.frame, kernels.intersect))


def length(vector):
    return np.linalg.norm(vector.astype(float))


def meet(origin, direction, triangle):
    """(t, u, v) by the kernel from float32 arrays."""
    o, d = (np.asarray(x, np.float32) for x in (origin, direction))
    return intersect(o, frame(d), np.asarray(triangle, np.float32), 0, 1, 2)


def test_random_triangles_against_exact_arithmetic():
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(400):
        triangle = rng.normal(size=(3, 3)).astype(np.float32)
        o = (3 * rng.normal(size=3)).astype(np.float32)
        d = ((rng.dirichlet((1, 1, 1)) * 1.4 - 0.13) @ triangle - o).astype(np.float32)
        exact, (t, u, v) = naive.intersect(o, d, triangle), meet(o, d, triangle)
        assert (exact is None) == np.isnan(t)
        if exact is not None:
            hits += 1
            assert t == pytest.approx(float(exact[0]), rel=1e-12)
            assert u == pytest.approx(float(exact[1]), abs=1e-12)
            assert v == pytest.approx(float(exact[2]), abs=1e-12)
    assert 100 < hits < 350


def test_grazing_slivers_err_by_no_more_than_stated():
    """Rays at 0.05 to 1 degree to long thin triangles, on which float32 gives up."""
    rng = np.random.default_rng(1)
    checked = 0
    for _ in range(300):
        a = rng.normal(size=3)
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        side = np.cross(along, rng.normal(size=3))
        side /= np.linalg.norm(side)
        triangle = np.array([a, a + 2 * along, a + along + 1e-3 * side], np.float32)
        normal = np.cross(along, side)
        angle = np.radians(rng.uniform(0.05, 1))
        d = np.cos(angle) * side + np.sin(angle) * normal
        o = (rng.dirichlet((1, 1, 1)) @ triangle - 2 * d).astype(np.float32)
        d = d.astype(np.float32)
        exact, (t, _, _) = naive.intersect(o, d, triangle), meet(o, d, triangle)
        if exact is None:
            continue  # the float32 origin has moved the ray off the sliver
        checked += 1
        a, b, c = triangle.astype(float)
        n, e = np.cross(b - a, c - a), 2.0**-53
        slope = abs(n @ d.astype(float)) / length(n)  # |direction| times the sine
        longest = max(length(b - a), length(c - b), length(a - c))
        r = np.abs(triangle.astype(float) - o).max()
        bound = 4 * e * r * (1 + longest**2 / length(n)) / slope
        assert abs(Fraction(t) - exact[0]) <= bound
    assert checked > 100


@pytest.mark.parametrize("offset", [0.0, 100.0, 1e4])
def test_no_ray_passes_between_two_triangles_that_share_an_edge(offset):
    """Edge functions are equal and opposite in both triangles, so one of them takes the ray."""
    rng = np.random.default_rng(2)
    for _ in range(1000):
        a, b, c, e = vertices = (rng.normal(size=(4, 3)) + offset).astype(np.float32)
        o = (3 * rng.normal(size=3) + offset).astype(np.float32)
        d = (a + rng.random() * (b.astype(float) - a) - o).astype(np.float32)
        ray = frame(d)
        # c and e on opposite sides of the edge, as seen along the ray
        flat = [np.array(approach_point(p, o, d)) for p in (a, b, c, e)]
        sides = [np.sign(cross2(flat[1] - flat[0], p - flat[0])) for p in flat[2:]]
        if sides[0] * sides[1] >= 0:
            continue
        both = intersect(o, ray, vertices, 0, 1, 2)[0], intersect(o, ray, vertices, 1, 0, 3)[0]
        assert not np.isnan(both).all()


def approach_point(p, o, d):
    """A point in the plane across the ray, in float64."""
    k = int(np.argmax(np.abs(d)))
    i, j = (k + 1) % 3, (k + 2) % 3
    r = p.astype(float) - o
    return r[i] - r[k] * float(d[i]) / float(d[k]), r[j] - r[k] * float(d[j]) / float(d[k])


def cross2(p, q):
    return p[0] * q[1] - p[1] * q[0]


def test_an_edge_and_a_vertex_belong_to_every_triangle_that_has_them():
    left, right = [(0, 0, -4), (1, 1, -4), (0, 1, -4)], [(0, 0, -4), (1, 0, -4), (1, 1, -4)]
    for point in [(0.5, 0.5), (0, 0), (1, 1)]:
        for triangle in (left, right):
            t, u, v = meet((0, 0, 0), (*point, -4), triangle)
            assert t == 1
            assert u >= 0
            assert v >= 0


def test_triangles_without_area_are_never_hit():
    """Collinear, two corners in one, all in one; rays through their inside and their corners."""
    for triangle in (
        [(-1, 0, -2), (0, 0, -2), (1, 0, -2)],
        [(0, 0, -2), (0, 0, -2), (1, 0, -2)],
        [(0, 0, -2)] * 3,
        [(0.1, 0.1, -2), (0.2, 0.2, -2), (0.4, 0.4, -2)],
    ):
        for aim in [(0, 0, -2), (0.5, 0, -2), (0.25, 0.25, -2), *triangle]:
            assert np.isnan(meet((0, 0, 0), aim, triangle)[0])


def test_edge_on_rays_do_not_hit():
    triangle = [(-1, 0, -2), (1, 0, -2), (0, 0, -4)]
    assert np.isnan(meet((0, 0, 0), (0, 0, -1), triangle)[0])
    assert np.isnan(meet((0, 0, -3), (1, 0, 0), triangle)[0])


def test_a_ray_that_starts_on_an_edge_hits_at_zero():
    """With 1 - u - v as the weight of the third corner, t rounded to -1.4e-17 and was no hit."""
    triangle = np.array([(0, 1, 1), (0, 0, 0), (-3, 0, 0)], np.float32)
    assert meet((-1, 0, 0), (0, 0, -4), triangle)[0] == 0


def test_both_windings_and_every_main_axis_give_the_same_t():
    triangle = np.array([(-1, -1, -2), (1, -1, -2), (0, 1, -2)], np.float32)
    for axis in range(3):
        for sign in (1, -1):
            turned = np.roll(triangle, axis, axis=1) * sign
            d = np.roll(np.array([0.125, 0.125, -1], np.float32), axis) * np.float32(sign)
            assert meet((0, 0, 0), d, turned)[0] == 2
            assert meet((0, 0, 0), d, turned[::-1])[0] == 2


def test_length_of_the_direction_scales_t_exactly():
    triangle = [(-1, -1, -2), (1, -1, -2), (0, 1, -2)]
    t = meet((0, 0, 0), (0.1, 0.1, -1), triangle)[0]
    assert t == pytest.approx(2)
    for exponent in (-120, -40, 40, 120):
        d = np.array((0.1, 0.1, -1), np.float32) * np.float32(2.0**exponent)
        assert meet((0, 0, 0), d, triangle)[0] == t * 2.0**-exponent


def test_approach_measures_the_gap_to_the_nearest_edge():
    triangle = np.array([(-1, -1, -4), (1, -1, -4), (1, 1, -4)], np.float32)
    o, d = np.zeros(3, np.float32), np.array((-0.25, 0.25, -1), np.float32)
    hit, distance, t = approach(o, frame(d), triangle, 0, 1, 2)
    assert not hit
    assert distance == pytest.approx(np.sqrt(2))  # from (-1, 1) to the diagonal at (0, 0)
    assert t == 4
    d = np.array((0.125, 0, -1), np.float32)
    hit, distance, t = approach(o, frame(d), triangle, 0, 1, 2)
    assert (hit, distance, t) == (True, 0, 4)


def icosphere(levels):
    """A closed sphere; every edge is shared by two triangles."""
    g = (1 + 5**0.5) / 2
    v = np.array([
        (-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
        (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1),
    ])  # fmt: skip
    f = np.array([(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
                  (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
                  (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)])  # fmt: skip
    for _ in range(levels):
        pairs = np.sort(f[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, middle = np.unique(pairs, axis=0, return_inverse=True)
        m = middle.reshape(-1, 3) + len(v)
        v = np.concatenate([v, v[unique].mean(axis=1)])
        a, b, c = f.T
        f = np.concatenate([np.stack(x, axis=1) for x in (
            (a, m[:, 0], m[:, 2]), (b, m[:, 1], m[:, 0]), (c, m[:, 2], m[:, 1]), m.T)])  # fmt: skip
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return hrt.Scene.from_arrays(v.astype(np.float32), f.astype(np.int32))


def rays_from_inside(scene, kind, n):
    rng = np.random.default_rng(3)
    origin = rng.uniform(-0.4, 0.4, (n, 3)).astype(np.float32)
    corners = scene.vertices[scene.faces[rng.integers(0, len(scene), n)]].astype(float)
    weights = {
        "vertex": np.tile([1.0, 0, 0], (n, 1)),
        "edge": np.stack([s := rng.random(n), 1 - s, 0 * s], axis=1),
        "face": rng.dirichlet((1, 1, 1), n),
    }[kind]
    target = (weights[:, :, None] * corners).sum(axis=1)
    return hrt.Rays.from_arrays(origin, target - origin)


@pytest.mark.parametrize("kind", ["vertex", "edge", "face"])
def test_nothing_leaves_a_closed_sphere(kind):
    """Embree does let rays out: 1.6 % of those aimed at vertices even in robust mode."""
    scene = icosphere(3)
    rays = rays_from_inside(scene, kind, 3000)
    hits = hrt.BruteForceTracer(scene).intersect(rays)
    assert (hits.prim_id >= 0).all()
    np.testing.assert_allclose(hits.t, 1, rtol=1e-2)


@pytest.mark.parametrize("kind", ["vertex", "edge", "face"])
def test_judge_never_blames_the_truth(kind):
    """Brute force judged against Embree: where they differ it is a tie, or Embree that is wrong."""
    scene = icosphere(3)
    rays = rays_from_inside(scene, kind, 3000)
    truth = hrt.BruteForceTracer(scene).intersect(rays)
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1))
    for robust in (True, False):
        reference = hrt.EmbreeTracer(scene, robust=robust, path="run").intersect(rays)
        judged = hrt.judge(rays, truth, np.ones(3000, bool), reference, scene, camera)
        assert set(judged.verdict.tolist()) <= {
            hrt.Verdict.CORRECT, hrt.Verdict.TIE, hrt.Verdict.REFERENCE_WRONG
        }  # fmt: skip
        counts = {name: rate.count for name, rate in hrt.rates(judged).items()}
        assert counts["correct"] + counts["tie"] + counts["reference_wrong"] == 3000
        assert (reference.prim_id < 0).sum() == counts["reference_wrong"]
