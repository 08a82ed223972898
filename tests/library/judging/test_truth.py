"""The truth over a scene: the tree, the limits, what it refuses, and that threads do not matter."""

import numba
import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.judging.bvh import build_bvh
from hybrid_rt.judging.truth import GRAZED, HIT, MISSED
from hybrid_rt.kernels.judging import bvh as kernels
from naive import judge as naive

SQUARES = [
    [(-4, -4, -5), (4, -4, -5), (4, 4, -5)],
    [(-4, -4, -5), (4, 4, -5), (-4, 4, -5)],
    [(-8, -8, -10), (8, -8, -10), (8, 8, -10)],
    [(-8, -8, -10), (8, 8, -10), (-8, 8, -10)],
]


def scene_of(triangles):
    vertices = np.array(triangles, np.float32).reshape(-1, 3)
    return hrt.Scene.from_arrays(vertices, np.arange(len(vertices)).reshape(-1, 3))


def soup(n, seed=0, size=0.2):
    rng = np.random.default_rng(seed)
    centres = rng.normal(size=(n, 1, 3)) * rng.choice([0.01, 1, 1, 30], (n, 1, 1))
    return scene_of(centres + size * rng.normal(size=(n, 3, 3)))


def random_rays(n, seed=1):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(n, 3))
    direction[rng.random((n, 3)) < 0.2] = 0.0
    direction[rng.random((n, 3)) < 0.1] = -0.0
    direction[(direction == 0).all(axis=1)] = (0, -1, 0)
    t_near = np.where(rng.random(n) < 0.3, rng.random(n), 0)
    t_far = np.where(rng.random(n) < 0.3, 1 + rng.random(n), np.inf)
    return hrt.Rays.from_arrays(2 * rng.normal(size=(n, 3)), direction, None, t_near, t_far)


def depth_of(bvh, node=0):
    first, number = bvh.link[node]
    return 1 if number else 1 + max(depth_of(bvh, first), depth_of(bvh, first + 1))


@pytest.mark.parametrize(
    "scene",
    [
        soup(1),
        soup(7),
        soup(3000),
        scene_of(SQUARES * 500),
        scene_of(2.0 ** np.arange(-80, 19)[:, None, None] * np.eye(3)),
    ],
    ids=["one", "few", "many", "the same", "sizes from 2**-80 to 2**18"],
)  # fmt: skip
def test_tree_holds_every_triangle_once_inside_all_boxes_above_it(scene):
    bvh = build_bvh(scene.vertices, scene.faces, np.arange(len(scene), dtype=np.int32))
    assert sorted(bvh.prim_id) == list(range(len(scene)))
    points = scene.vertices[scene.faces]
    seen = []

    def check(node, low, high):
        box = bvh.box[node]
        assert (box[:3] >= low).all()
        assert (box[3:] <= high).all()
        first, number = bvh.link[node]
        if number:
            ids = bvh.prim_id[first : first + number]
            assert (points[ids] >= box[:3]).all()
            assert (points[ids] <= box[3:]).all()
            seen.extend(ids)
            return
        check(first, box[:3], box[3:])
        check(first + 1, box[:3], box[3:])

    check(0, np.full(3, -np.inf), np.full(3, np.inf))
    assert sorted(seen) == list(range(len(scene)))
    assert depth_of(bvh) < kernels.STACK


def test_tree_agrees_with_brute_force():
    scene, rays = soup(2000), random_rays(4000)
    found = hrt.Truth(scene).nearest(rays)
    brute = hrt.BruteForceTracer(scene).intersect(rays)
    assert (found.prim_id == brute.prim_id).all()
    assert (found.t.astype(np.float32) == brute.t).mean() > 0.999
    assert 0.2 < (found.prim_id >= 0).mean() < 0.9
    hit = found.prim_id >= 0
    assert (found.t_error[hit] <= 2.0**-30 * found.t[hit]).all()
    assert not found.exact.any()


def test_results_do_not_depend_on_threads():
    scene, rays = soup(500, size=1), random_rays(2000)
    one = hrt.Truth(scene, threads=1).nearest(rays)
    most = hrt.Truth(scene, threads=numba.config.NUMBA_NUM_THREADS).nearest(rays)
    for name in ("prim_id", "t", "t_error", "t_grazed", "exact"):
        assert getattr(one, name).tobytes() == getattr(most, name).tobytes()


def nearest_one(scene, origin, direction, **limits):
    rays = hrt.Rays.from_arrays([origin], [direction], None, **limits)
    return hrt.Truth(scene).nearest(rays)


def test_limits_are_closed_and_exact():
    scene = scene_of(SQUARES)
    above, below = np.nextafter(np.float32(5), [np.float32(6), np.float32(4)], dtype=np.float32)
    down = ((0.5, 0.25, 0), (0, 0, -1.0))
    for limits, prim in [
        ({"t_near": [5.0]}, 0),
        ({"t_near": [above]}, 2),
        ({"t_near": [below]}, 0),
        ({"t_far": [5.0]}, 0),
        ({"t_far": [below]}, -1),
        ({"t_near": [5.0], "t_far": [5.0]}, 0),
        ({"t_near": [above], "t_far": [10.0]}, 2),
        ({"t_near": [6.0], "t_far": [5.0]}, -1),
        ({"t_far": [-1.0]}, -1),
        ({"t_near": [np.inf]}, -1),
    ]:
        found = nearest_one(scene, *down, **limits)
        assert found.prim_id[0] == prim, limits
        assert found.t[0] == {0: 5, 2: 10, -1: np.inf}[prim]
    # Beyond a limit by an ulp the near square is grazed: a float32 tracer may find it.
    assert nearest_one(scene, *down, t_near=[above]).t_grazed[0] == 5
    assert nearest_one(scene, *down, t_far=[below]).t_grazed[0] == 5


def test_graze_in_front_of_the_hit_is_told():
    scene = scene_of(SQUARES)
    beside = (np.nextafter(np.float32(3), np.float32(9)), -1.0, -5.0)
    found = nearest_one(scene, (1, 0, 0), beside)
    assert (found.prim_id[0], found.t[0]) == (2, 2)
    assert found.t_grazed[0] == 1
    assert nearest_one(scene, (1, 0, 0), (3.001, -1.0, -5.0)).t_grazed[0] == np.inf


def test_hits_and_grazes_of_a_lattice_are_those_of_exact_arithmetic():
    """Rays past corners, their main axis a power of two: there float64 decides grazes exactly."""
    rng = np.random.default_rng(5)
    n, triangles = 400, rng.integers(-4, 5, (12, 3, 3))
    triangles[4:8] = triangles[:4, [1, 2, 0]]
    direction = rng.integers(-8, 9, (n, 3)).astype(np.float32)
    axis, length = rng.integers(0, 3, n), rng.choice([-8, 8], n)
    direction[np.arange(n), axis] = length
    corners = triangles.reshape(-1, 3)[rng.integers(0, 36, n)]
    origin = (corners - direction).astype(np.float32)
    nudged = rng.random(n) < 0.5
    direction[nudged] = np.nextafter(direction[nudged], np.float32(np.inf))
    direction[np.arange(n), axis] = length
    t_near = rng.choice(np.array([0, 0.5, 1], np.float32), n)
    rays = hrt.Rays.from_arrays(origin, direction, None, t_near)
    found = hrt.Truth(scene_of(triangles)).nearest(rays)
    grazed = 0
    for i in range(n):
        prim, t, _, graze = naive.nearest(origin[i], direction[i], t_near[i], np.inf, triangles)
        assert found.prim_id[i] == prim
        assert found.t[i] == pytest.approx(np.inf if t is None else float(t), rel=1e-14)
        both = found.t_grazed[i], np.inf if graze is None else float(graze)
        told = [None if not x < found.t[i] * (1 - 1e-12) else x for x in both]
        assert (told[0] is None) == (told[1] is None)
        if told[0] is not None:
            assert told[0] == pytest.approx(float(told[1]))
            grazed += 1
    assert grazed > 20


def test_touch_tells_hit_grazed_and_missed():
    scene = scene_of([*SQUARES, [(-1, 0, -2), (0, 0, -2), (1, 0, -2)]])
    beside = (np.nextafter(np.float32(4), np.float32(9)), -1.0, -5.0)
    rays = hrt.Rays.from_arrays(
        np.zeros((5, 3)), [(4.0, -1, -5), beside, beside, beside, (0, 0, -1)]
    )
    state, t = hrt.Truth(scene).touch(rays, [0, 0, 1, -1, 4])
    assert state.tolist() == [HIT, GRAZED, MISSED, MISSED, MISSED]
    np.testing.assert_array_equal(t, [1, 1, np.nan, np.nan, np.nan])


def test_least_of_equal_primitives_is_named():
    scene = scene_of(
        [SQUARES[2], SQUARES[1], SQUARES[0], np.roll(SQUARES[0], 1, axis=0), SQUARES[0]]
    )
    inside = nearest_one(scene, (0, 0, 0), (0.2, -0.3, -1.0))
    assert (inside.prim_id[0], bool(inside.exact[0])) == (2, False)
    on_the_edge = nearest_one(scene, (0, 0, 0), (1.0, 1.0, -5.0))
    assert (on_the_edge.prim_id[0], bool(on_the_edge.exact[0])) == (1, True)


def test_rays_that_are_none_hit_nothing():
    bad = [(np.nan, 0, -1), (np.inf, 0, -1), (0, 0, 0), (-0.0, 0, 0)]
    rays = hrt.Rays.from_arrays([(0.0, 0, 0)] * 4 + [(np.nan, 0, 0)], [*bad, (0, 0, -1)])
    truth = hrt.Truth(scene_of(SQUARES))
    found = truth.nearest(rays)
    assert (found.prim_id == -1).all()
    assert np.isinf(found.t).all()
    assert (truth.touch(rays, [0] * 5)[0] == MISSED).all()


def test_no_rays_and_no_area_are_answered():
    none = hrt.Rays.from_arrays(np.zeros((0, 3)), np.zeros((0, 3)))
    assert len(hrt.Truth(scene_of(SQUARES)).nearest(none)) == 0
    flat = scene_of([[(0, 0, -1), (1, 1, -1), (2, 2, -1)]])
    for direction in [(0, 0, -1.0), (1, 1, -1.0), (-1, -1, 1.0)]:
        assert nearest_one(flat, (0, 0, 0), direction).prim_id[0] == -1


def test_read_only_arrays_are_taken_and_nothing_is_written():
    scene, rays = soup(50), random_rays(20)
    arrays = [scene.vertices, scene.faces, rays.origin, rays.direction, rays.t_near, rays.t_far]
    before = [a.tobytes() for a in arrays]
    expected = hrt.Truth(scene).nearest(rays)
    for a in arrays:
        a.flags.writeable = False
    found = hrt.Truth(scene).nearest(rays)
    assert (found.prim_id == expected.prim_id).all()
    assert [a.tobytes() for a in arrays] == before


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda truth, rays: hrt.Truth("scene"), "scene"),
        (lambda truth, rays: hrt.Truth(truth.scene, threads=0), "threads"),
        (lambda truth, rays: truth.nearest(3), "rays"),
        (lambda truth, rays: truth.touch(rays, [0]), "prim_id"),
        (lambda truth, rays: truth.touch(rays, [0, 4]), "prim_id"),
        (lambda truth, rays: truth.touch(rays, [0, -2]), "prim_id"),
        (lambda truth, rays: truth.touch(rays, [0.0, 1.0]), "prim_id"),
    ],
)
def test_bad_input_is_named(call, named):
    with pytest.raises(hrt.ArgumentError) as error:
        call(hrt.Truth(scene_of(SQUARES)), random_rays(2))
    assert error.value.argument == named


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (2, 1, 0), (1, 2, 0)])
def test_a_ray_along_an_edge_grazes_from_its_nearer_end(order):
    corners = np.array([(0, 0, 0), (0, 0, 1), (0, 1, 0)], float)
    scene = hrt.Scene.from_arrays(corners, [order])
    rays = hrt.Rays.from_arrays([(0, 0, 0)], [(0.0, 0, 1)], None, [0.0], [1.0])
    found = hrt.Truth(scene).nearest(rays)
    assert found.prim_id[0] == -1
    assert found.t_grazed[0] == 0
