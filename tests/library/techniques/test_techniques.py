"""Each switch and parameter of the techniques beside the paper's."""

import numpy as np
import pytest

import hybrid_rt as hrt
from support import synthetic
from support.screens import through

S = hrt.MarchStatus
NEAR = 0.1
NARROW = np.degrees(2 * np.arctan(0.5 / 100))  # a row of pixels with a focal length of 100 pixels


def row(depth):
    return synthetic.gbuffer(depth, near=NEAR, vfov_deg=NARROW)


EMPTY = row(np.zeros((1, 65)))


def wall_in_a_row(surface, z_wall=5.0, width=65, hole=None):
    """Return a view, one pixel high, of a wall at z_view `surface` over columns 30 to 34."""
    depth = np.full((1, width), NEAR / z_wall)
    depth[0, 30:35] = NEAR / surface
    if hole is not None:
        depth[0, hole] = 0.0
    return row(depth)


def across(buffer, z_start, z_end, mode, x_from=0.5, x_to=64.5, **limits):
    """March one ray over the row, from one z_view to another."""
    ends = [[x_from, 0.5, NEAR / z_start], [x_to, 0.5, NEAR / z_end]]
    start, end = hrt.unproject(buffer.camera, ends)
    limits = {name: [value] for name, value in limits.items()}
    rays = hrt.Rays.from_arrays([start], [end - start], **limits)
    return through(rays, buffer, mode)


@pytest.mark.parametrize(
    "mode",
    [lambda t: hrt.Linear(t, stride=0.005, max_steps=10**4), hrt.PixelDDA],
    ids=["linear", "dda"],
)
def test_thickness_decides_whether_a_ray_is_behind_a_surface_or_in_it(mode):
    # The ray runs at z = 3, one unit behind a post at z = 2 and in front of a wall at z = 5.
    buffer = wall_in_a_row(2.0)
    thin = across(buffer, 3, 3, mode(0.5))
    assert S(int(thin.status[0])) is S.HIDDEN
    assert not thin.resolved[0]
    thick = across(buffer, 3, 3, mode(1.5))
    assert S(int(thick.status[0])) is S.HIT
    assert tuple(thick.pixel[0]) == (30, 0)
    # Both were free up to the post and no farther.
    for marched in (thin, thick):
        assert 29 <= 0.5 + 64 * marched.t_free[0] <= 30.01


def test_the_default_thickness_is_a_share_of_the_scene():
    buffer = wall_in_a_row(2.0)
    diagonal = np.sqrt(3.0)  # of the triangle of unit vectors
    assert buffer.scene.diagonal == pytest.approx(diagonal)
    for technique in (hrt.Linear, hrt.PixelDDA, hrt.HiZ):
        assert technique().thickness == hrt.Share(0.005)
    edge = 2.0 + 0.005 * diagonal
    for z, status in ((edge - 1e-3, S.HIT), (edge + 1e-3, S.HIDDEN)):
        assert S(int(across(buffer, z, z, "dda").status[0])) is status


def test_linear_strides_over_what_is_thinner_than_a_stride():
    buffer = wall_in_a_row(2.0)
    found = [
        bool(across(buffer, 3, 3, hrt.Linear(1.5, stride=s, max_steps=500)).resolved[0])
        for s in (0.002, 0.5)
    ]
    assert found == [True, False]


def test_linear_refinement_closes_in_on_the_surface():
    buffer = wall_in_a_row(2.0)
    pixels = [
        int(across(buffer, 3, 3, hrt.Linear(1.5, stride=0.04, refinements=r)).pixel[0, 0])
        for r in (0, 8)
    ]
    assert pixels == [32, 30]


def test_linear_steps_are_a_share_of_the_distance_of_the_start():
    buffer = wall_in_a_row(2.0, z_wall=50.0)
    mode = hrt.Linear(1e-3, stride=0.01, max_steps=10**4)
    near, far = (across(buffer, z, z, mode, x_to=25).steps[0] for z in (3.0, 30.0))
    assert near == far > 10


def test_dda_reads_every_strideth_pixel():
    for stride, steps in ((1, 65), (2, 33), (16, 5)):
        assert across(EMPTY, 3, 3, hrt.PixelDDA(stride=stride)).steps[0] == steps
    assert across(EMPTY, 3, 3, hrt.PixelDDA(stride=16, jitter=0.75)).steps[0] == 4


def test_dda_jitter_moves_the_samples():
    # Samples every 16 pixels from 0.5 read columns 0, 16, 32, 48, 64; half a stride on, 8, 24, 40.
    buffer = wall_in_a_row(2.0)
    straight = across(buffer, 3, 3, hrt.PixelDDA(1.5, stride=16))
    moved = across(buffer, 3, 3, hrt.PixelDDA(1.5, stride=16, jitter=0.5))
    assert tuple(straight.pixel[0]) == (32, 0)
    assert not moved.resolved[0]


def test_dda_takes_a_ray_straight_from_the_eye_for_one_pixel():
    buffer = wall_in_a_row(2.0)
    marched = across(buffer, 3, 30, hrt.PixelDDA(), x_from=10.5, x_to=10.5)
    assert S(int(marched.status[0])) is S.HIT
    assert marched.steps[0] == 1
    z = 3 + marched.t[0] * 27
    assert z == pytest.approx(5.0, rel=1e-4)


def test_hiz_thickness_and_threshold_set_the_confidence():
    buffer = wall_in_a_row(2.0)
    # The ray enters the post behind it by 0.3 of the thickness: smoothstep(0.3) = 0.216.
    behind = NEAR / np.interp(30.0, [2.5, 64.5], [NEAR / 2.0, NEAR / 3.0]) - 2.0
    for threshold, hit in ((0.78, True), (0.79, False)):
        mode = hrt.HiZ(behind / 0.3, threshold=threshold, border=0.0, max_steps=200)
        marched = across(buffer, 2.0, 3.0, mode, x_from=2.5)
        assert bool(marched.resolved[0]) is hit
        assert S(int(marched.status[0])) is (S.HIT if hit else S.HIDDEN)


def test_hiz_does_not_trust_what_lies_at_the_border():
    depth = np.full((40, 40), NEAR / 5.0)
    buffer = synthetic.gbuffer(depth, near=NEAR)
    start = hrt.unproject(buffer.camera, [[20.5, 20.5, NEAR / 2], [2.5, 20.5, NEAR / 2]])
    end = hrt.unproject(buffer.camera, [[22.5, 20.5, NEAR / 6], [1.5, 20.5, NEAR / 6]])
    rays = hrt.Rays.from_arrays(start, end - start)
    for border, hits in ((0.0, [True, True]), (0.1, [True, False]), (1.0, [False, False])):
        marched = through(rays, buffer, hrt.HiZ(1.0, border=border))
        assert marched.resolved.tolist() == hits


def test_hiz_does_not_hit_a_surface_that_faces_away():
    # A plane that comes nearer to the right; a ray behind it, going right, sees its back.
    x = np.arange(32) + 0.5
    slope = 0.001
    depth = (0.02 + slope * x)[None, :]
    buffer = synthetic.gbuffer(depth, np.full_like(depth, slope), near=NEAR)
    ends = hrt.unproject(buffer.camera, [[4.5, 0.5, 0.0249], [28.5, 0.5, 0.0264]])
    for direction, hit in ((ends[1] - ends[0], True), (ends[0] - ends[1], False)):
        start = ends[0] if hit else ends[1]
        rays = hrt.Rays.from_arrays([start], [direction])
        mode = hrt.HiZ(100.0, threshold=0.5, border=0.0)
        marched = through(rays, buffer, mode)
        assert bool(marched.resolved[0]) is hit


def test_hiz_switch_of_the_background():
    for trace, resolved in ((False, True), (True, False)):
        marched = across(EMPTY, 3, 1e9, hrt.HiZ(trace_background=trace), x_to=40, t_far=np.inf)
        assert S(int(marched.status[0])) is S.MISS
        assert bool(marched.resolved[0]) is resolved
        assert marched.prim_id[0] == -1
        assert np.isinf(marched.t[0])
    # One that leaves the image is never resolved; nor is one that ends in front of a wall.
    assert not across(EMPTY, 3, 3, hrt.HiZ()).resolved[0]
    wall = wall_in_a_row(2.0)
    marched = across(wall, 1.5, 1.5, hrt.HiZ(), x_to=20, t_far=0.5)
    assert S(int(marched.status[0])) is S.MISS
    assert not marched.resolved[0]


def test_hiz_switch_of_rays_that_ran_out_of_steps():
    # Five reads bring the ray close in front of the tilted wall, not to it.
    buffer = row(np.full((1, 65), NEAR / 5.0))
    full = across(buffer, 4.99, 5.5, hrt.HiZ(1.0, border=0.0))
    assert S(int(full.status[0])) is S.HIT
    for accepted in (True, False):
        mode = hrt.HiZ(1.0, border=0.0, max_steps=1, exhausted_hits=accepted)
        marched = across(buffer, 4.99, 5.5, mode)
        assert S(int(marched.status[0])) is S.EXHAUSTED
        assert bool(marched.resolved[0]) is accepted
        assert bool(marched.prim_id[0] >= 0) is accepted
        assert bool(np.isfinite(marched.t[0])) is accepted
        far_off = across(buffer, 2.0, 5.5, mode)  # farther than the thickness from the surface
        assert not far_off.resolved[0]


def test_hiz_out_of_steps_over_the_background_is_a_miss_unless_traced():
    for trace in (True, False):
        mode = hrt.HiZ(max_steps=1, trace_background=trace)
        marched = across(EMPTY, 3, 3, mode)
        assert S(int(marched.status[0])) is S.EXHAUSTED
        assert bool(marched.resolved[0]) is not trace
        assert marched.prim_id[0] == -1


def tilted_floor(height=48, width=32, slope=0.002):
    depth = np.repeat((0.01 + slope * (np.arange(height) + 0.5))[:, None], width, axis=1)
    return synthetic.gbuffer(depth, ddy=np.full_like(depth, slope), near=NEAR)


def test_slope_frees_rays_that_leave_a_floor():
    buffer = tilted_floor()
    height, width = buffer.depth.shape
    pixel = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
    start = np.concatenate([pixel + 0.5, buffer.depth.reshape(-1, 1)], axis=1)
    origin = hrt.unproject(buffer.camera, start)
    rays = hrt.Rays.from_arrays(origin, np.tile([0.0, 0.75, -1.0], (len(origin), 1)), pixel)
    hidden = [(through(rays, buffer, mode).status == S.HIDDEN).sum() for mode in ("paper", "slope")]
    assert hidden[0] > 100
    assert hidden[1] == 0


def test_slope_answers_with_the_tilted_plane():
    buffer = tilted_floor()
    ends = np.array([[16.5, 5.5, 0.05], [16.5, 30.5, 0.03]])
    start, end = hrt.unproject(buffer.camera, ends)
    marched = through(hrt.Rays.from_arrays([start], [end - start]), buffer, "slope")
    assert S(int(marched.status[0])) is S.HIT
    at = hrt.project(buffer.camera, start + marched.t * (end - start)[None])[0]
    # 0.05 - 0.0008 (y - 5.5) = 0.01 + 0.002 y
    np.testing.assert_allclose(at[1], (0.05 + 0.0008 * 5.5 - 0.01) / 0.0028, rtol=1e-5)
    assert tuple(marched.pixel[0]) == (16, int(at[1]))


def test_slope_reads_fewer_cells_with_coarser_ones():
    wide = row(np.zeros((1, 1025)))
    assert across(wide, 3, 3, hrt.SlopeAware(samples=1), x_to=1024.5).steps[0] < 30


def test_every_technique_ends_by_its_budget():
    for mode in (
        hrt.Linear(max_steps=1),
        hrt.PixelDDA(max_steps=1),
        hrt.SlopeAware(max_steps=1),
        hrt.HiZ(max_steps=1, trace_background=True),
    ):
        marched = across(EMPTY, 3, 3, mode)
        assert S(int(marched.status[0])) is S.EXHAUSTED
        assert marched.steps[0] == 1
        assert not marched.resolved[0]


@pytest.mark.parametrize("mode", ["linear", "dda", "hiz", "slope"])
def test_rays_that_cannot_start(mode):
    buffer = wall_in_a_row(2.0)
    origin = [(0, 0, -2), (np.nan, 0, 0), (0, 0, 1), (9, 0, -2)]
    direction = [(0, 0, 0), (0, 0, 1), (0, 0, -1), (0, 0, -1)]
    rays = hrt.Rays.from_arrays(origin, direction)
    marched = through(rays, buffer, mode)
    assert marched.status.tolist() == [S.INVALID, S.INVALID, S.NEAR, S.OFFSCREEN]
    assert not marched.resolved.any()
    assert (marched.t_free == 0).all()
    assert (marched.steps == 0).all()


@pytest.mark.parametrize("mode", ["linear", "dda", "hiz", "slope"])
def test_nothing_to_march(mode):
    buffer = wall_in_a_row(2.0)
    rays = hrt.Rays.from_arrays(np.empty((0, 3)), np.empty((0, 3)))
    assert len(through(rays, buffer, mode)) == 0


@pytest.mark.parametrize(
    ("mode", "parameters", "argument"),
    [
        (hrt.Linear, {"thickness": 0.0}, "thickness"),
        (hrt.Linear, {"thickness": "1"}, "thickness"),
        (hrt.Linear, {"stride": 0}, "stride"),
        (hrt.Linear, {"stride": float("nan")}, "stride"),
        (hrt.Linear, {"refinements": -1}, "refinements"),
        (hrt.Linear, {"max_steps": 0}, "max_steps"),
        (hrt.PixelDDA, {"thickness": -1}, "thickness"),
        (hrt.PixelDDA, {"stride": 0}, "stride"),
        (hrt.PixelDDA, {"stride": 1.5}, "stride"),
        (hrt.PixelDDA, {"jitter": 1.01}, "jitter"),
        (hrt.PixelDDA, {"jitter": True}, "jitter"),
        (hrt.PixelDDA, {"max_steps": 0}, "max_steps"),
        (hrt.HiZ, {"thickness": float("inf")}, "thickness"),
        (hrt.HiZ, {"threshold": -0.1}, "threshold"),
        (hrt.HiZ, {"border": float("nan")}, "border"),
        (hrt.HiZ, {"exhausted_hits": 1}, "exhausted_hits"),
        (hrt.HiZ, {"trace_background": None}, "trace_background"),
        (hrt.HiZ, {"max_steps": None}, "max_steps"),
        (hrt.SlopeAware, {"samples": 0}, "samples"),
        (hrt.SlopeAware, {"max_steps": 0}, "max_steps"),
    ],
)
def test_bad_parameters(mode, parameters, argument):
    with pytest.raises(hrt.ArgumentError, match=f"^{argument}: expected"):
        mode(**parameters)
