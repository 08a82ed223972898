"""The march against its oracle, on random and on chosen G-buffers."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels.techniques import screen as kernels
from naive import march as naive
from support import synthetic
from support.screens import through

S = hrt.MarchStatus

# The kernel computes in float32 with coordinates of tens of pixels: decisions that hang on less
# than this relative distance may go either way.
MARGIN = 2e-5


def march_one(buffer, origin, direction, pixel=(-1, -1), **kwargs):
    limits = {k: [kwargs.pop(k)] for k in ("t_near", "t_far") if k in kwargs}
    rays = hrt.Rays.from_arrays([origin], np.array([direction], float), [pixel], **limits)
    return through(rays, buffer, **kwargs)


def wall(width=16, height=16, depth=0.02):
    """Return the view of a wall that faces a camera at the origin with a near plane of 0.1."""
    return synthetic.gbuffer(np.full((height, width), depth))


def test_kernel_constants_are_the_statuses():
    names = ("HIT", "MISS", "OFFSCREEN", "HIDDEN", "NEAR", "EXHAUSTED", "INVALID")
    names += ("UNDECIDED", "SKIPPED")
    assert {n: getattr(kernels, n) for n in names} == {s.name: s.value for s in S}


@pytest.mark.parametrize("samples", [1, 2, 4])
@pytest.mark.parametrize("seed", range(6))
def test_agrees_with_the_oracle(seed, samples):
    rng = np.random.default_rng(seed)
    compared = 0
    total = 0
    for _ in range(5):
        width, height = (int(n) for n in rng.integers(1, 40, 2))
        buffer = synthetic.random_gbuffer(rng, width, height)
        rays = synthetic.random_rays(rng, buffer, 60)
        marched = through(rays, buffer, hrt.Paper(samples))
        camera = buffer.camera
        for i in range(len(rays)):
            expected = naive.march(
                rays.origin[i],
                rays.direction[i],
                rays.pixel[i],
                float(rays.t_near[i]),
                float(rays.t_far[i]),
                buffer.depth,
                buffer.ddx,
                buffer.ddy,
                camera,
            )
            total += 1
            if expected.margin < MARGIN:
                continue
            compared += 1
            where = f"ray {i} of a {width} by {height} view: {expected}"
            assert marched.status[i] == expected.status, where
            assert tuple(marched.pixel[i]) == expected.pixel, where
            np.testing.assert_allclose(marched.t[i], expected.t, rtol=1e-3, err_msg=where)
            np.testing.assert_allclose(marched.t_free[i], expected.t_free, rtol=1e-3, err_msg=where)
    assert compared > 0.7 * total


def test_hit_on_a_wall_has_the_closed_form_distance():
    # The wall stands at z_view = 5; a ray from (0.1, 0.05, -2) goes straight to (1, -0.7, -5).
    buffer = wall(64, 64)
    start, end = np.array([0.1, 0.05, -2.0]), np.array([1.0, -0.7, -5.0])
    direction = (end - start) / 3
    marched = march_one(buffer, start, direction)
    assert marched.status[0] == S.HIT
    np.testing.assert_allclose(marched.t[0], 3.0, rtol=1e-5)
    x, y, _ = hrt.project(buffer.camera, [end])[0]
    assert tuple(marched.pixel[0]) == (int(x), int(y))
    assert marched.prim_id[0] == buffer.prim_id[int(y), int(x)]
    assert 0 < marched.t_free[0] <= marched.t[0]


def test_every_way_to_end():
    empty = synthetic.gbuffer(np.zeros((16, 16)))
    origin = (0, 0, -2)
    for buffer, direction, kwargs, status in (
        (wall(), (0, 0, -1), {}, S.HIT),
        (empty, (0, 0, -1), {}, S.MISS),
        (empty, (1, 0, 0), {}, S.OFFSCREEN),
        (empty, (0, 1, 1), {}, S.OFFSCREEN),
        (empty, (0.01, 0, 1), {}, S.NEAR),
        (empty, (0, 0, 1), {"t_far": 1.0}, S.MISS),
        (wall(), (0, 0, -1), {"t_far": 1.0}, S.MISS),
        (wall(depth=0.09), (1, 0, 0), {}, S.HIDDEN),
        (empty, (1, 0, 0), {"technique": hrt.Paper(max_steps=1)}, S.EXHAUSTED),
        (empty, (0, 0, 0), {}, S.INVALID),
        (empty, (np.nan, 0, 1), {}, S.INVALID),
        (empty, (np.inf, 0, 1), {}, S.INVALID),
    ):
        marched = march_one(buffer, origin, direction, **kwargs)
        assert S(int(marched.status[0])) is status, (direction, kwargs)
        answered = status is S.HIT
        assert bool(marched.resolved[0]) is answered
        assert bool((marched.pixel[0] >= 0).all()) is answered
        assert bool(np.isfinite(marched.t[0])) is answered


def test_a_ray_that_starts_outside_the_view_is_not_marched():
    for origin, status in (((0, 0, 1), S.NEAR), ((0, 0, -0.05), S.NEAR), ((9, 0, -2), S.OFFSCREEN)):
        marched = march_one(wall(), origin, (0, 0, -1))
        assert S(int(marched.status[0])) is status
        assert marched.steps[0] == 0
        assert marched.t_free[0] == 0


def test_a_ray_does_not_meet_the_surface_it_starts_on():
    # A floor seen at an angle: mirrored rays leave it upwards and never meet it again.
    height = width = 32
    rows = np.arange(height) + 0.5
    slope = 0.001
    depth = np.repeat((0.01 + slope * rows)[:, None], width, axis=1)
    buffer = synthetic.gbuffer(depth, ddy=np.full_like(depth, slope))
    pixel = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
    start = np.concatenate([pixel + 0.5, depth.reshape(-1, 1)], axis=1)
    origin = hrt.unproject(buffer.camera, start)
    rays = hrt.Rays.from_arrays(origin, np.tile([0.0, 1.0, 0.1], (len(origin), 1)), pixel)
    marched = through(rays, buffer)
    assert not marched.resolved.any()
    assert (marched.status == S.OFFSCREEN).any()


def test_the_tilted_plane_answers_where_the_flat_cell_blocks():
    # One pixel is a plane so steep that the ray crosses it well before its centre's depth.
    depth = np.full((1, 9), 0.001)
    depth[0, 4] = 0.05
    ddx = np.zeros_like(depth)
    ddx[0, 4] = 0.04
    buffer = synthetic.gbuffer(depth, ddx)
    starts = hrt.unproject(buffer.camera, [[0.5, 0.5, 0.0499]])
    ends = hrt.unproject(buffer.camera, [[8.5, 0.5, 0.0479]])
    marched = march_one(buffer, starts[0], ends[0] - starts[0])
    assert marched.status[0] == S.HIT
    assert tuple(marched.pixel[0]) == (4, 0)
    x = hrt.project(buffer.camera, starts + marched.t[0] * (ends - starts))[0, 0]
    # In front of the plane at x = 4, behind it at x = 5: depth 0.0499 - 0.00025 (x - 0.5) meets
    # 0.05 + 0.04 (x - 4.5).
    np.testing.assert_allclose(x, (0.0499 + 0.000125 - 0.05 + 0.18) / 0.04025, rtol=1e-4)


def test_steps_are_counted_by_level():
    rng = np.random.default_rng(1)
    buffer = synthetic.random_gbuffer(rng, 37, 23)
    rays = synthetic.random_rays(rng, buffer, 500)
    screen = hrt.prepare(buffer, "paper")
    by_level = screen.technique.steps_by_level(rays, screen)
    assert by_level.shape == (len(hrt.build_depth_pyramid(buffer)),)
    assert by_level.sum() == hrt.march(rays, screen).steps.sum() > 0


def test_an_empty_view_is_crossed_in_few_steps():
    buffer = synthetic.gbuffer(np.zeros((1024, 1024)))
    marched = march_one(buffer, (-1.0, -0.3, -2), (1, 0.3, 0), technique=hrt.Paper(samples=1))
    assert marched.status[0] == S.OFFSCREEN
    assert marched.steps[0] <= 2 * len(hrt.build_depth_pyramid(buffer))


def test_the_default_budget_is_never_used_up():
    # The worst case: every pixel blocks at level 1 and frees at level 0.
    width, height = 257, 5
    depth = np.zeros((height, width))
    depth[::2] = 0.06
    buffer = synthetic.gbuffer(depth)
    y = 1.5
    start = hrt.unproject(buffer.camera, [[0.5, y, 0.05]])[0]
    end = hrt.unproject(buffer.camera, [[width - 0.5, y, 0.05]])[0]
    marched = march_one(buffer, start, end - start, technique=hrt.Paper(samples=1))
    assert marched.status[0] == S.OFFSCREEN
    assert width <= marched.steps[0] <= 2 * (width + height) + 2


def test_nothing_to_march():
    rays = hrt.Rays.from_arrays(np.empty((0, 3)), np.empty((0, 3)))
    buffer = wall()
    marched = through(rays, buffer)
    assert len(marched) == 0


@pytest.mark.parametrize(
    ("kwargs", "argument"),
    [
        ({"technique": "magic"}, "unknown technique 'magic'"),
        ({"technique": 4}, "technique: expected one of"),
        ({"threads": 0}, "threads"),
    ],
)
def test_bad_arguments(kwargs, argument):
    with pytest.raises(hrt.HybridRTError, match=argument):
        march_one(wall(), (0, 0, -2), (0, 0, -1), **kwargs)


@pytest.mark.parametrize(
    ("parameters", "argument"),
    [({"samples": 0}, "samples"), ({"samples": 2.5}, "samples"), ({"max_steps": 0}, "max_steps")],
)
def test_bad_parameters(parameters, argument):
    with pytest.raises(hrt.ArgumentError, match=argument):
        hrt.Paper(**parameters)
