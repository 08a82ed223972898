"""The certified march: every answer against exact arithmetic, and what it must leave unanswered."""

import dataclasses

import numpy as np
import pytest

import hybrid_rt as hrt
from naive import triangle as exact
from support.screens import through
from support.soup import FORMS, random_rays, random_scene

S = hrt.MarchStatus


@pytest.fixture(params=["vectors", "one by one"], autouse=True)
def kernel(request, monkeypatch):
    """Run every test with either kernel."""
    if request.param == "one by one":
        monkeypatch.setattr("hybrid_rt.techniques.certified._countable", lambda *_: False)


def certified(scene, camera, rays, lists=4, *, any_hit=False, **parameters):
    technique = hrt.Certified(lists=lists, **parameters)
    return through(rays.detached(), hrt.rasterize(scene, camera), technique, any_hit=any_hit)


def triangles(scene):
    return scene.vertices[scene.faces]


def assert_true(scene, rays, marched, any_hit=False):
    """Every resolved ray has the exact answer, and its t to a float32."""
    corners = triangles(scene)
    for i in np.flatnonzero(marched.resolved):
        truth = exact.nearest(
            rays.origin[i], rays.direction[i], corners, float(rays.t_near[i]), float(rays.t_far[i])
        )
        if marched.status[i] == S.MISS:
            assert truth is None, (i, truth)
            assert marched.prim_id[i] == -1
            assert np.isinf(marched.t[i])
            continue
        assert truth is not None, i
        own = exact.intersect(rays.origin[i], rays.direction[i], corners[marched.prim_id[i]])
        assert own is not None, i
        if not any_hit:
            assert own[0] == truth[0], (i, float(own[0]), float(truth[0]))
        assert rays.t_near[i] <= own[0] <= rays.t_far[i]
        assert marched.t[i] == pytest.approx(float(own[0]), rel=2**-23)
    for i in np.flatnonzero(~marched.resolved):
        truth = exact.nearest(
            rays.origin[i], rays.direction[i], corners, float(rays.t_near[i]), float(rays.t_far[i])
        )
        # What is said to be free is free.
        assert truth is None or truth[0] >= marched.t_free[i], (i, marched.status[i])
        assert marched.prim_id[i] == -1
        assert (marched.pixel[i] == -1).all()


@pytest.mark.parametrize("seed", range(10))
def test_every_answer_is_the_exact_one(seed):
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, 24)
    width, height = ((24, 16), (16, 9), (1, 33), (41, 1), (7, 5))[seed % 5]
    camera = hrt.Camera.look_at(
        (0.1, 0.2, 5), (0.2, 0, -1), vfov_deg=(70, 20, 120)[seed % 3], width=width, height=height,
        near=(0.1, 1.5)[seed % 2],
    )  # fmt: skip
    rays = random_rays(rng, scene, camera, 150)
    any_hit = seed % 3 == 2
    marched = certified(scene, camera, rays, (1, 2, 4, 16)[seed % 4], any_hit=any_hit)
    assert_true(scene, rays, marched, any_hit)
    assert marched.resolved.any()


@pytest.mark.parametrize("seed", range(10))
def test_every_answer_from_lists_of_another_view_is_the_exact_one(seed):
    rng = np.random.default_rng(100 + seed)
    scene = random_scene(rng, 24)
    camera = hrt.Camera.look_at((0.1, 0.2, 5), (0.2, 0, -1), vfov_deg=50, width=24, height=16)
    rays = random_rays(rng, scene, camera, 150)
    technique = hrt.Certified(lists=(2, 16)[seed % 2], **FORMS[seed % 5])
    screen = hrt.prepare(hrt.rasterize(scene, camera), technique)
    view = screen.data.lists.camera
    assert view == technique.lists_camera(camera) != camera
    assert screen.data.pyramid.level(0).shape == (view.height, view.width)
    marched = hrt.march(rays, screen)
    assert_true(scene, rays, marched)
    assert marched.resolved.any()
    assert (marched.pixel == -1).all()
    result = hrt.trace_hybrid(rays, screen, hrt.BruteForceTracer(scene))
    assert_true(scene, rays, result.marched)
    assert np.array_equal(result.hits.prim_id, hrt.BruteForceTracer(scene).intersect(rays).prim_id)


def test_a_guard_band_keeps_rays_in_sight_that_leave_the_screen():
    rng = np.random.default_rng(5)
    scene = random_scene(rng, 60, spread=3.0, sliver=0.0)
    camera = hrt.Camera.look_at((0, 0, 9), (0, 0, 0), vfov_deg=20, width=64, height=48)
    rays = hrt.mirror_rays(hrt.rasterize(scene, camera))
    gone, alpha = [], []
    for factor in (1.0, 2.0, 4.0):
        marched = certified(scene, camera, rays, 16, guard=factor)
        gone.append((marched.status == S.OFFSCREEN).mean())
        alpha.append(marched.resolved.mean())
    assert gone[0] > gone[1] > gone[2]
    assert alpha[0] < alpha[1] < alpha[2]


def test_a_screen_is_marched_by_those_that_read_the_same():
    gbuffer = hrt.rasterize(scene_of(wall()), CAMERA)
    rays = hrt.mirror_rays(gbuffer)
    screen = hrt.prepare(gbuffer, hrt.Certified(cell=2))
    other = screen.of(hrt.Certified(cell=2, max_tests=1, hand_over=False))
    assert other.data is screen.data
    np.testing.assert_array_equal(hrt.march(rays, other).prim_id, hrt.march(rays, screen).prim_id)
    for technique in (hrt.Certified(), hrt.Certified(cell=2, guard=2.0), hrt.Paper()):
        with pytest.raises(hrt.ArgumentError, match="technique: expected one that reads what"):
            screen.of(technique)
        with pytest.raises(hrt.ArgumentError, match="technique: expected one that reads what"):
            technique.march(rays, screen)


def test_long_lists_answer_what_short_ones_cannot():
    rng = np.random.default_rng(3)
    scene = random_scene(rng, 200, spread=1.5, sliver=0.0)
    camera = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=64, height=48)
    rays = hrt.mirror_rays(hrt.rasterize(scene, camera))
    shares = [certified(scene, camera, rays, k).resolved.mean() for k in (1, 2, 4, 8, 16)]
    assert shares == sorted(shares)
    assert shares[-1] > shares[0] + 0.05


def wall(z=-4.0, size=100.0):
    return [(-size, -size, z), (size, -size, z), (0, 2 * size, z)]


def scene_of(*corners):
    points = np.array(corners, float).reshape(-1, 3)
    return hrt.Scene.from_arrays(points, np.arange(len(points)).reshape(-1, 3))


CAMERA = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=16, height=16, near=0.1)


def march_one(scene, origin, direction, camera=CAMERA, lists=2, **limits):
    limits = {name: [value] for name, value in limits.items()}
    rays = hrt.Rays.from_arrays([origin], np.array([direction], float), None, **limits)
    return certified(scene, camera, rays, lists)


def test_statuses():
    behind = scene_of(wall(), wall(-5.0), wall(-6.0))
    for scene, origin, direction, limits, status in (
        (scene_of(wall()), (0, 0, -1), (0, 0, -1), {}, S.HIT),
        (scene_of(wall()), (0, 0, -1), (0, 0, -1), {"t_far": 2.0}, S.MISS),
        (scene_of(wall()), (0, 0, -1), (0, 0, -1), {"t_near": 3.5}, S.MISS),
        (scene_of(wall(size=0.1)), (0, 0.5, -1), (0, 0.1, -1), {}, S.MISS),
        (scene_of(wall(), wall(1)), (0, 0, -1), (1, 0, 0), {}, S.OFFSCREEN),
        (scene_of(wall()), (0, 0, -1), (1, 0, 0), {}, S.MISS),
        (scene_of(wall(), wall(1)), (0, 0, -1), (0, 0, 1), {}, S.NEAR),
        (scene_of(wall(), wall(1)), (0, 0, 0.5), (0, 0, 1), {}, S.NEAR),
        (scene_of(wall()), (9, 0, -2), (0, 0, -1), {}, S.OFFSCREEN),
        (scene_of(wall()), (0, 0, -1), (0, 0, 0), {}, S.INVALID),
        (scene_of(wall()), (0, np.nan, -1), (0, 0, -1), {}, S.INVALID),
        (scene_of(wall()), (0, 0, -1), (0, np.inf, -1), {}, S.INVALID),
        (behind, (0, 0, -4.5), (0, 0, -1), {}, S.HIT),
    ):
        marched = march_one(scene, origin, direction, **limits)
        assert S(int(marched.status[0])) is status, (origin, direction, limits)
        assert bool(marched.resolved[0]) is (status in (S.HIT, S.MISS))


def test_behind_more_than_the_list_holds_is_hidden():
    behind = scene_of(wall(), wall(-5.0), wall(-6.0))
    assert march_one(behind, (0, 0, -4.5), (0, 0, -1), lists=1).status[0] == S.HIDDEN
    assert march_one(behind, (0, 0, -4.5), (0, 0, -1), lists=2).status[0] == S.HIT


def test_past_the_bounds_of_the_scene_is_a_miss_also_beside_the_screen():
    small = scene_of([(-0.5, -0.5, -2), (0.5, -0.5, -2), (0, 0.5, -3)])
    marched = march_one(small, (0, 0.2, -2), (1, 0, 0))
    assert marched.status[0] == S.MISS
    assert np.isinf(marched.t_free[0])


def test_what_lies_before_the_near_plane_is_not_said_to_be_absent():
    # The triangle at z = 0.05 is in no list. A ray that passes it ends at z = 0.045, before the
    # wall behind the camera; only stopping at the near plane, z = 0.1, keeps it from being a miss.
    speck = [(-0.01, -0.01, -0.05), (0.01, -0.01, -0.05), (0, 0.01, -0.05)]
    scene = scene_of(wall(), wall(1), speck)
    marched = march_one(scene, (0, 0, -1), (0, 0, 1), t_far=0.955)
    assert marched.status[0] == S.NEAR
    assert marched.t_free[0] <= 0.9
    assert march_one(scene, (0, 0, -1), (0, 0, 1), t_far=0.85).status[0] == S.MISS


def test_a_hit_on_the_scenes_border_counts():
    floor = scene_of([(-3, -1, -6), (3, -1, -6), (0, -1, -1)])
    marched = march_one(floor, (0, 0, -3), (0, -1, 0))
    assert marched.status[0] == S.HIT
    # From the border outwards, and from the border itself: t = 0 is within the limits.
    assert march_one(floor, (0, -1, -3), (0, -1, 0)).status[0] == S.HIT
    assert march_one(floor, (0, -1, -3), (0, -1, 0), t_near=1e-3).status[0] == S.MISS


def test_two_triangles_in_one_place_are_undecided():
    twice = scene_of(wall(), wall())
    assert march_one(twice, (0, 0, -1), (0, 0, -1)).status[0] == S.UNDECIDED
    assert march_one(scene_of(wall()), (0, 0, -1), (0, 0, -1)).status[0] == S.HIT


@pytest.mark.parametrize("sixteenths", [(3, 1, -7), (5, -3, -11), (7, 2, -13), (-1, 6, -9)])
def test_exactly_through_a_shared_edge_is_undecided(sixteenths):
    # Both triangles own the point, by exact arithmetic; float64, which cannot divide by 7, 9, 11 or
    # 13, cannot know.
    origin = np.array((0, 0, -1), np.float32)
    direction = np.array(sixteenths, np.float32) / 16
    along = np.array((2, 1, 1), np.float32) / 64
    a, b = origin + 2 * direction + 3 * along, origin + 2 * direction - 4 * along
    points = np.array([a, b, (9, -3, -4), (-9, 5, -4)], np.float64)
    scene = hrt.Scene.from_arrays(points, [(0, 1, 2), (0, 1, 3)])
    met = [exact.intersect(origin, direction, t) for t in triangles(scene)]
    assert all(hit is not None and hit[0] == 2 and hit[2] == 0 for hit in met)
    assert march_one(scene, origin, direction).status[0] == S.UNDECIDED


def test_a_view_too_far_off_for_float64_is_undecided():
    eye = np.array((2.0**40, 0, 0))
    camera = hrt.Camera.look_at(eye, eye + np.array((0, 0, -1)), width=16, height=16, near=1e-6)
    scene = hrt.Scene.from_arrays(eye + np.array(wall(-1e6, 1e9)), [[0, 1, 2]])
    rays = hrt.Rays.from_arrays([eye + np.array((0, 0, -1e-3))], [(0.0, 0, -1)])
    assert certified(scene, camera, rays).status[0] == S.UNDECIDED


def test_budgets():
    rng = np.random.default_rng(4)
    scene = random_scene(rng, 200, spread=1.5)
    camera = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=64, height=48)
    rays = hrt.mirror_rays(hrt.rasterize(scene, camera))
    free = certified(scene, camera, rays, 8, max_tests=64, max_steps=None)
    assert (free.status != S.EXHAUSTED).all()
    for budget in ({"max_tests": 1}, {"max_steps": 5}):
        tight = certified(scene, camera, rays, 8, **budget)
        assert (tight.status == S.EXHAUSTED).any()
        assert (tight.prim_id[tight.resolved] == free.prim_id[tight.resolved]).all()
        assert_true(
            scene,
            rays.take(np.arange(100)),
            certified(scene, camera, rays.take(np.arange(100)), 8, **budget),
        )
    assert free.tests > 0
    assert certified(scene, camera, rays, 8, max_tests=1).tests <= len(rays)


def test_depth_at_the_centres_is_never_read():
    # Whatever the depth buffer holds, quantised or wrong, the answers stand on the lists.
    rng = np.random.default_rng(10)
    scene = random_scene(rng, 60)
    camera = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=32, height=24)
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(gbuffer)
    before = through(rays, gbuffer, "certified")
    wrong = dataclasses.replace(
        gbuffer,
        depth=np.full_like(gbuffer.depth, 0.123),
        prim_id=np.zeros_like(gbuffer.prim_id),
    )
    after = through(rays, wrong, "certified")
    assert np.array_equal(before.prim_id, after.prim_id)


@pytest.mark.parametrize(
    ("parameters", "argument"),
    [
        ({"lists": 0}, "lists"),
        ({"lists": 65}, "lists"),
        ({"lists": 2.5}, "lists"),
        ({"lists": "8"}, "lists"),
        ({"cell": 0}, "cell"),
        ({"cell": 65}, "cell"),
        ({"guard": 0.9}, "guard: expected a number from 1 to 8"),
        ({"guard": np.nan}, "guard"),
        ({"planes": 1}, "planes"),
        ({"max_tests": 0}, "max_tests"),
        ({"max_steps": 0}, "max_steps"),
        ({"hand_over": 1}, "hand_o"),
        ({"probes": 3}, "probes: expected one of 1, 2, 4, 8, 16"),
        ({"probes": 2.0}, "probes"),
        ({"probes": 32}, "probes"),
        ({"vectors": 1}, "vectors"),
        ({"vectors": False, "probes": 8}, "probes: expected 16 where vectors=False"),
    ],
)
def test_bad_parameters(parameters, argument):
    with pytest.raises(hrt.ArgumentError, match=argument):
        hrt.Certified(**parameters)


def test_threads_change_nothing():
    from hybrid_rt import _threads

    rng = np.random.default_rng(12)
    scene = random_scene(rng, 100)
    camera = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=64, height=48)
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(gbuffer)
    one = through(rays, gbuffer, "certified", threads=1)
    all_ = through(rays, gbuffer, "certified", threads=_threads.available())
    for name in (
        "status",
        "resolved",
        "pixel",
        "prim_id",
        "t",
        "t_free",
        "steps",
        "steps_by_level",
    ):
        assert np.array_equal(getattr(one, name), getattr(all_, name)), name
    assert one.tests == all_.tests
