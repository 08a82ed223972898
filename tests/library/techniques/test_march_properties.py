"""What must hold for the march of any rays through any view."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import hybrid_rt as hrt
from hybrid_rt import _threads
from support import synthetic
from support.screens import through

FIELDS = ("status", "resolved", "pixel", "prim_id", "t", "t_free", "steps")
seeds = st.integers(0, 2**32 - 1)


def case(seed, n=200):
    rng = np.random.default_rng(seed)
    width, height = (int(x) for x in rng.integers(1, 70, 2))
    buffer = synthetic.random_gbuffer(rng, width, height)
    return rng, buffer, synthetic.random_rays(rng, buffer, n)


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_permuting_rays_permutes_results(seed):
    rng, buffer, rays = case(seed)
    order = rng.permutation(len(rays))
    straight = through(rays, buffer)
    permuted = through(rays.take(order), buffer)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(straight, name)[order], getattr(permuted, name))


@settings(max_examples=15, deadline=None)
@given(seeds, st.integers(1, 8))
def test_the_number_of_threads_changes_nothing(seed, samples):
    _, buffer, rays = case(seed, n=3000)
    one = through(rays, buffer, hrt.Paper(samples), threads=1)
    all_ = through(rays, buffer, hrt.Paper(samples), threads=_threads.available())
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(all_, name))


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_answers_hold_together(seed):
    _, buffer, rays = case(seed)
    marched = through(rays, buffer)
    hit = marched.status == hrt.MarchStatus.HIT
    x, y = marched.pixel[hit].T
    np.testing.assert_array_equal(marched.prim_id[hit], buffer.prim_id[y, x])
    assert (marched.prim_id[hit] >= 0).all()
    assert (marched.prim_id[~hit] == -1).all()
    assert (marched.pixel[~hit] == -1).all()
    assert not np.isnan(marched.t).any()
    assert not np.isnan(marched.t_free).any()
    # float32 rounding of s allows the last digits of t to cross the limits
    assert (marched.t[hit] >= rays.t_near[hit] * (1 - 1e-4)).all()
    assert (marched.t[hit] <= rays.t_far[hit] * (1 + 1e-4)).all()
    exhausted = marched.status == hrt.MarchStatus.EXHAUSTED
    assert not exhausted.any()
