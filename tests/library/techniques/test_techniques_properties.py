"""What must hold for every technique, any rays and any view."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybrid_rt as hrt
from hybrid_rt import _threads
from naive import pyramid as naive
from support import synthetic
from support.screens import through

FIELDS = ("status", "resolved", "pixel", "prim_id", "t", "t_free", "steps")
S = hrt.MarchStatus
seeds = st.integers(0, 2**32 - 1)
thicknesses = st.sampled_from([hrt.Share(0.005), 1e-6, 0.05, 1.0, 1e6])
modes = st.one_of(
    st.builds(
        hrt.Linear,
        thicknesses,
        st.sampled_from([1e-6, 0.01, 0.1, 10.0]),
        st.integers(0, 6),
        st.integers(1, 200),
    ),
    st.builds(
        hrt.PixelDDA,
        thicknesses,
        st.integers(1, 40),
        st.floats(0, 1),
        st.one_of(st.none(), st.integers(1, 50)),
    ),
    st.builds(
        hrt.HiZ,
        thicknesses,
        st.floats(0, 1),
        st.floats(0, 1),
        st.booleans(),
        st.booleans(),
        st.integers(1, 200),
    ),
    st.builds(hrt.SlopeAware, st.integers(1, 8), st.one_of(st.none(), st.integers(1, 50))),
)


def case(seed, n=200):
    rng = np.random.default_rng(seed)
    width, height = (int(x) for x in rng.integers(1, 70, 2))
    buffer = synthetic.random_gbuffer(rng, width, height)
    return rng, buffer, synthetic.random_rays(rng, buffer, n)


@settings(max_examples=40, deadline=None)
@given(seeds, modes)
def test_permuting_rays_permutes_results(seed, mode):
    rng, buffer, rays = case(seed)
    order = rng.permutation(len(rays))
    straight = through(rays, buffer, mode)
    permuted = through(rays.take(order), buffer, mode)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(straight, name)[order], getattr(permuted, name))


@settings(max_examples=25, deadline=None)
@given(seeds, modes)
def test_the_number_of_threads_changes_nothing(seed, mode):
    _, buffer, rays = case(seed, n=3000)
    one = through(rays, buffer, mode, threads=1)
    all_ = through(rays, buffer, mode, threads=_threads.available())
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(all_, name))


@settings(max_examples=80, deadline=None)
@given(seeds, modes)
def test_answers_hold_together(seed, mode):
    _, buffer, rays = case(seed)
    marched = through(rays, buffer, mode)
    hit = marched.prim_id >= 0
    miss = marched.resolved & ~hit
    x, y = marched.pixel[hit].T
    np.testing.assert_array_equal(marched.prim_id[hit], buffer.prim_id[y, x])
    assert (marched.pixel[~hit] == -1).all()
    assert np.isinf(marched.t[~hit]).all()
    assert marched.resolved[hit].all()
    assert not np.isnan(marched.t).any()
    assert not np.isnan(marched.t_free).any()
    # A hit of a single ray is never in the pixel that it starts from.
    assert not (marched.pixel[hit] == rays.pixel[hit]).all(axis=1).any()
    exhausted = marched.status == S.EXHAUSTED
    if isinstance(mode, hrt.HiZ):
        assert np.isin(marched.status[hit], [S.HIT, S.EXHAUSTED]).all()
        assert np.isin(marched.status[miss], [S.MISS, S.EXHAUSTED]).all()
        assert mode.exhausted_hits or not marched.resolved[exhausted].any()
        assert not (mode.trace_background and miss.any())
    else:
        assert not miss.any()
        np.testing.assert_array_equal(hit, marched.status == S.HIT)
    assert marched.resolved[marched.status == S.HIT].all()
    screen = hrt.prepare(buffer, mode)
    assert screen.technique.steps_by_level(rays, screen).sum() == marched.steps.sum()
    if mode.max_steps is None:
        assert not exhausted.any()
    else:
        extra = mode.refinements if isinstance(mode, hrt.Linear) else 0
        assert marched.steps.max() <= mode.max_steps + extra
    # float32 rounding of s allows the last digits of t to cross the limits
    assert (marched.t[hit] >= rays.t_near[hit] * (1 - 1e-4)).all()
    assert (marched.t[hit] <= rays.t_far[hit] * (1 + 1e-4)).all()
    assert (marched.t_free[hit] <= marched.t[hit] * (1 + 1e-4)).all()


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_switches_of_hiz_touch_only_their_own_rays(seed):
    _, buffer, rays = case(seed)
    settings_ = {"thickness": 0.5, "max_steps": 6}
    strict = hrt.HiZ(exhausted_hits=False, trace_background=True, **settings_)
    base = through(rays, buffer, strict)
    for exhausted in (False, True):
        for traced in (False, True):
            mode = hrt.HiZ(exhausted_hits=exhausted, trace_background=traced, **settings_)
            other = through(rays, buffer, mode)
            np.testing.assert_array_equal(base.status, other.status)
            new = other.resolved & ~base.resolved
            assert other.resolved[base.resolved].all()
            allowed = ([S.EXHAUSTED] if exhausted else []) + ([] if traced else [S.MISS])
            assert np.isin(base.status[new], allowed).all()


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_a_thicker_slab_never_loses_a_dda_hit(seed):
    _, buffer, rays = case(seed)
    hits = [through(rays, buffer, hrt.PixelDDA(t)).resolved for t in (0.01, 0.1, 1.0, 10.0)]
    for thin, thick in itertools.pairwise(hits):
        assert thick[thin].all()


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_slope_planes_bound_the_pixels_below_them(seed):
    rng = np.random.default_rng(seed)
    width, height = (int(x) for x in rng.integers(1, 40, 2))
    buffer = synthetic.random_gbuffer(rng, width, height)
    pyramid = hrt.build_slope_pyramid(buffer)
    y, x = np.nonzero(buffer.depth > 0)
    bottom = pyramid.level(0).astype(np.float64)
    np.testing.assert_array_equal(bottom[y, x, 0], buffer.depth[y, x])
    assert np.isinf(bottom[buffer.depth <= 0][:, 0]).all()
    for level in range(len(pyramid)):
        side = 2.0**level
        cells = pyramid.level(level).astype(np.float64)
        assert not np.isnan(cells).any()
        a, bx, by = cells[y >> level, x >> level].T
        xc, yc = ((x >> level) + 0.5) * side, ((y >> level) + 0.5) * side
        for corner_x in (0, 1):
            for corner_y in (0, 1):
                px, py = x + corner_x, y + corner_y
                own = bottom[y, x]
                pixel = own[:, 0] + own[:, 1] * (corner_x - 0.5) + own[:, 2] * (corner_y - 0.5)
                bound = a + bx * (px - xc) + by * (py - yc)
                scale = np.abs(a) + np.abs(bx * (px - xc)) + np.abs(by * (py - yc))
                assert (bound >= pixel - 1e-14 * scale).all()
        empty = np.isneginf(cells[..., 0])
        covered = np.zeros_like(empty)
        covered[y >> level, x >> level] = True
        np.testing.assert_array_equal(empty, ~covered)


@pytest.mark.parametrize("level", [1, 3])
def test_one_plane_is_bounded_by_itself(level):
    x, y = np.meshgrid(np.arange(16) + 0.5, np.arange(16) + 0.5)
    depth = 0.05 + 0.001 * x + 0.002 * y
    buffer = synthetic.gbuffer(depth, np.full_like(depth, 0.001), np.full_like(depth, 0.002))
    cell = hrt.build_slope_pyramid(buffer).level(level)[0, 0]
    half = 2.0**level / 2
    np.testing.assert_allclose(cell, [0.05 + 0.003 * half, 0.001, 0.002], rtol=1e-5)


def test_the_slope_pyramid_does_not_depend_on_threads():
    buffer = synthetic.random_gbuffer(np.random.default_rng(2), 67, 41)
    one = hrt.build_slope_pyramid(buffer, threads=1)
    all_ = hrt.build_slope_pyramid(buffer, threads=_threads.available())
    for index in range(len(one)):
        np.testing.assert_array_equal(one.level(index), all_.level(index))
    assert [one.level(i).shape[:2] for i in range(len(one))] == [
        level.shape for level in naive.pyramid(buffer.depth)
    ]
