"""All techniques through cameras of every kind: against oracles, and what must be exact."""

from dataclasses import replace

import numpy as np
import pytest

import hybrid_rt as hrt
from naive import march as paper
from naive import slabs, strict
from naive import triangle as exact
from naive.walk import View
from support import synthetic
from support.cameras import KINDS, of_every_kind
from support.screens import through
from support.soup import FORMS, random_rays, random_scene

S = hrt.MarchStatus
MARGIN = 2e-5
"""Decisions that hang on less, relative, may go either way in float32."""
each = pytest.mark.parametrize("kind", KINDS)

ORACLES = {
    "linear": (slabs.linear, hrt.Linear(0.5, stride=0.03, refinements=3, max_steps=200)),
    "dda": (slabs.dda, hrt.PixelDDA(0.5, stride=2, jitter=0.37, max_steps=10**6)),
    "hiz": (strict.hiz, hrt.HiZ(0.5, threshold=0.5, border=0.1, max_steps=10**6)),
    "slope": (strict.slope, hrt.SlopeAware()),
    "paper": (None, hrt.Paper()),
}
NAMES = {
    "linear": ("thickness", "stride", "refinements", "max_steps"),
    "dda": ("thickness", "stride", "jitter", "max_steps"),
    "hiz": ("thickness", "threshold", "border", "trace_background"),
    "slope": (),
}


def valley(rng, camera):
    """Return the view of a few planes that meet in creases, away from the viewer, without steps."""
    width, height = camera.width, camera.height
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    a, b = rng.uniform(-0.8, 0.8, (2, 4)) / max(width, height)
    planes = 0.3 * (1 + a[:, None, None] * x + b[:, None, None] * y)
    lowest = planes.argmin(axis=0)
    slopes = (0.3 * s[lowest] for s in (a, b))
    return synthetic.gbuffer(planes.min(axis=0), *slopes, camera=camera)


def aimed_rays(rng, buffer, n):
    """Return rays from points in front of the surfaces to points on them, and beyond."""
    camera = buffer.camera
    size = camera.width, camera.height
    pixel = rng.integers(0, size, (2 * n, 2))
    depth = buffer.depth[pixel[:, 1], pixel[:, 0]].astype(float)
    depth[:n] *= rng.uniform(1.0, 2.0, n)
    place = pixel + rng.uniform(0.1, 0.9, (2 * n, 2))
    start, end = np.split(hrt.unproject(camera, np.column_stack([place, depth])), 2)
    return hrt.Rays.from_arrays(start, (end - start) * rng.uniform(0.1, 2.0, (n, 1)))


def expected_of(name, technique, view, buffer, rays, i):
    ray = rays.origin[i], rays.direction[i], tuple(int(p) for p in rays.pixel[i])
    limits = float(rays.t_near[i]), float(rays.t_far[i])
    if name == "paper":
        return paper.march(*ray, *limits, buffer.depth, buffer.ddx, buffer.ddy, buffer.camera)
    parameters = {key: getattr(technique, key) for key in NAMES[name]}
    return ORACLES[name][0](view, *ray, *limits, **parameters)


@each
@pytest.mark.parametrize("name", ORACLES)
def test_agrees_with_the_oracle(name, kind):
    technique = ORACLES[name][1]
    rng = np.random.default_rng(KINDS.index(kind))
    camera = of_every_kind(width=29, height=22)[kind]
    buffer = valley(rng, camera)
    view = View(buffer.depth, buffer.ddx, buffer.ddy, camera)
    compared = hits = 0
    for rays in (aimed_rays(rng, buffer, 60), aimed_rays(rng, buffer, 60)):
        marched = through(rays, buffer, technique)
        for i in range(len(rays)):
            expected = expected_of(name, technique, view, buffer, rays, i)
            if expected.margin < MARGIN:
                continue
            compared += 1
            hits += expected.pixel[0] >= 0
            where = f"{name}, ray {i}: {expected}"
            assert marched.status[i] == expected.status, where
            assert tuple(marched.pixel[i]) == expected.pixel, where
            far = np.linalg.norm(rays.origin[i] - camera.eye) / np.linalg.norm(rays.direction[i])
            np.testing.assert_allclose(
                marched.t[i], expected.t, rtol=2e-3, atol=1e-4 * far, err_msg=where
            )
    assert compared > 60
    assert hits > 5


def assert_proven(scene, rays, marched):
    """Every resolved ray has the exact answer; what is free of the others is free."""
    corners = scene.vertices[scene.faces]
    for i in range(len(rays)):
        truth = exact.nearest(
            rays.origin[i], rays.direction[i], corners, float(rays.t_near[i]), float(rays.t_far[i])
        )
        if marched.status[i] == S.MISS:
            assert truth is None, (i, truth)
        elif marched.status[i] == S.HIT:
            own = exact.intersect(rays.origin[i], rays.direction[i], corners[marched.prim_id[i]])
            assert truth is not None, i
            assert own is not None, i
            assert own[0] == truth[0], (i, float(own[0]), float(truth[0]))
            assert marched.t[i] == pytest.approx(float(own[0]), rel=2**-23)
        else:
            assert truth is None or truth[0] >= marched.t_free[i], (i, marched.status[i])


@each
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("vectors", [True, False])
def test_every_certified_answer_is_the_exact_one(kind, seed, vectors):
    rng = np.random.default_rng(40 + seed)
    scene = random_scene(rng, 24)
    camera = of_every_kind(width=(24, 41, 7)[seed], height=(16, 1, 33)[seed])[kind]
    rays = random_rays(rng, scene, camera, 120).detached()
    form = (FORMS[1] | {"lists": 16}, {"lists": 4}, FORMS[2])[seed]
    technique = hrt.Certified(**form, vectors=vectors, max_steps=None)
    marched = through(rays, hrt.rasterize(scene, camera), technique)
    assert_proven(scene, rays, marched)
    assert marched.resolved.any()


@each
def test_lanes_say_what_single_rays_say(kind):
    rng = np.random.default_rng(50)
    scene = random_scene(rng, 60)
    camera = of_every_kind(width=50, height=40)[kind]
    rays = random_rays(rng, scene, camera, 3000).detached()
    screen = hrt.prepare(hrt.rasterize(scene, camera), "certified")
    lanes = hrt.march(rays, screen)
    single = hrt.march(rays, screen.of(hrt.Certified(vectors=False)))
    for name in ("status", "resolved", "pixel", "prim_id", "t", "t_free", "steps"):
        np.testing.assert_array_equal(getattr(lanes, name), getattr(single, name))


FLAT = hrt.Camera.orthographic(
    (0, 0, 5), (0, 0, 0), view_height=4, width=32, height=32, near=1.0, far=9.0
)
EVERY = ["paper", "slope", "hiz", "dda", "linear", "certified"]


def wall(z, size=50.0):
    corners = [(-size, -size, z), (size, -size, z), (0, 2 * size, z)]
    return hrt.Scene.from_arrays(np.array(corners, np.float32), [(0, 1, 2)])


def one(scene, technique, origin, direction, camera=FLAT, **limits):
    limits = {name: [value] for name, value in limits.items()}
    rays = hrt.Rays.from_arrays([origin], np.array([direction], float), None, **limits)
    return through(rays, hrt.rasterize(scene, camera), technique)


@pytest.mark.parametrize("technique", EVERY)
def test_rays_along_parallel_lines_of_sight(technique):
    seen = wall(0.0)
    stride = hrt.Linear(stride=0.01) if technique == "linear" else technique
    marched = one(seen, stride, (0.3, -0.2, 3.0), (0, 0, -1))
    if technique == "hiz":  # judged by a confidence that falls towards the border
        assert marched.status[0] in (S.HIT, S.HIDDEN)
    else:
        assert marched.status[0] == S.HIT
        np.testing.assert_allclose(marched.t[0], 3.0, atol=0.05 if technique == "linear" else 1e-5)
        assert marched.prim_id[0] == 0
    back = one(seen, stride, (0.3, -0.2, 2.0), (0, 0, 2))
    assert back.status[0] in (S.NEAR, S.MISS)  # or a proof that the scene ends here
    if technique != "certified":
        np.testing.assert_allclose(back.t_free[0], 1.0, atol=0.05)


@pytest.mark.parametrize("technique", EVERY)
@pytest.mark.parametrize("direction", [(0, 0, -1), (0.1, 0.05, -3)])
def test_a_ray_that_comes_to_the_far_plane_has_no_answer(technique, direction):
    beyond = wall(-6.0)  # the far plane is at z = -4
    budget = hrt.Linear(max_steps=10**6) if technique == "linear" else technique
    marched = one(beyond, budget, (0.3, -0.2, 3.0), direction)
    assert marched.status[0] == S.OFFSCREEN
    assert not marched.resolved[0]
    length = -direction[2]
    assert 6.9 / length < marched.t_free[0] <= 7 / length
    # It is the same beyond it, and behind the near plane.
    assert one(beyond, budget, (0.3, -0.2, -4.5), direction).status[0] == S.OFFSCREEN
    assert one(beyond, budget, (0.3, -0.2, 4.5), direction).status[0] == S.NEAR


def test_certified_says_nothing_of_what_lies_just_beyond_the_far_plane():
    # Two slanted walls cross the far plane, z = -4: where the ray meets them, both lie beyond it.
    corners = [
        (-9, -3, -3.9), (9, -3, -3.9), (0, 9, -4.2),
        (-9, -9, -4.1), (9, -9, -4.1), (0, 9, -4.3),
    ]  # fmt: skip
    scene = hrt.Scene.from_arrays(np.array(corners, np.float32), [(0, 1, 2), (3, 4, 5)])
    rng = np.random.default_rng(1)
    n = 400
    origin = np.column_stack([rng.uniform(-1.9, 1.9, (n, 2)), np.full(n, -3.0)])
    direction = np.column_stack([rng.normal(size=(n, 2)) * 0.01, np.full(n, -1.0)])
    rays = hrt.Rays.from_arrays(origin, direction)
    for vectors in (True, False):
        marched = through(rays, hrt.rasterize(scene, FLAT), hrt.Certified(vectors=vectors))
        assert_proven(scene, rays, marched)
        hit = marched.status == S.HIT
        z = origin[:, 2] - marched.t
        assert (z[hit] > -4).all()
        assert hit.any()
        assert (marched.status == S.OFFSCREEN).any()


@pytest.mark.parametrize("shift", [3.0, 30.0, 1e3, 1e5])
@pytest.mark.parametrize("aspect", [1.0, 1e-3, 1e3])
def test_certified_is_right_through_an_axis_far_off_the_screen(shift, aspect):
    # A view so far to the side that it needs a scene of its own: triangles around its middle.
    width, height = 40, 30
    near = of_every_kind(eye=(0, 0, 0), target=(0, 0, -1), width=width, height=height)["pinhole"]
    camera = replace(near, shift_px=(shift * width, -0.3 * shift * height), aspect=aspect)
    rng = np.random.default_rng(int(shift))
    place = rng.uniform([0, 0, 0.02], [width, height, 0.09], (20, 3))
    spread = rng.uniform(-1, 1, (20, 3, 3)) * (15, 15, 0.015)
    corners = hrt.unproject(camera, (place[:, None] + spread).reshape(-1, 3))
    scene = hrt.Scene.from_arrays(corners, np.arange(60).reshape(-1, 3))
    gbuffer = hrt.rasterize(scene, camera)
    assert (gbuffer.prim_id >= 0).any()
    start, end = rng.uniform([0, 0, 0.01], [width, height, 0.1], (2, 150, 3))
    origin, target = hrt.unproject(camera, start), hrt.unproject(camera, end)
    rays = hrt.Rays.from_arrays(origin, target - origin)
    for vectors in (True, False):
        marched = through(rays, gbuffer, hrt.Certified(vectors=vectors))
        assert_proven(scene, rays, marched)
        if shift <= 30:
            assert marched.resolved.mean() > 0.2
