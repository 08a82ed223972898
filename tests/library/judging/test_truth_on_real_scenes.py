"""Robust Embree against the truth on mirror rays of a real scene: every disagreement explained."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt import Verdict
from naive import judge as naive
from support import DATA

SPONZA = DATA / "sponza.npz"
pytestmark = pytest.mark.skipif(not SPONZA.is_file(), reason="sponza.npz is not there")
CAMERA = hrt.Camera.look_at((-10, 1.5, 0), (5, 3, 0), width=426, height=240)


@pytest.fixture(scope="module")
def scene():
    return hrt.load_scene(SPONZA)


@pytest.fixture(scope="module")
def truth(scene):
    return hrt.Truth(scene)


@pytest.fixture(scope="module")
def rays(scene):
    return hrt.mirror_rays(hrt.rasterize(scene, CAMERA))


def test_every_disagreement_with_robust_embree_is_explained(scene, truth, rays):
    path = "packet" if hrt.embree_problem() is None else "run"
    embree = hrt.EmbreeTracer(scene, path=path).intersect(rays)
    n = len(rays)
    assert n > 100_000
    judged = hrt.judge(
        rays, embree, np.ones(n, bool), embree, scene, CAMERA, truth=truth, every=True
    )
    found = truth.nearest(rays)
    assert ((found.t_error <= 2.0**-30 * found.t) | (found.prim_id < 0)).all()
    differ = np.flatnonzero(found.prim_id != embree.prim_id)
    assert len(differ) > 0
    agree = np.ones(n, bool)
    agree[differ] = False
    assert (judged.verdict[agree] == Verdict.CORRECT).all()
    assert np.quantile(judged.error_t[agree & (found.prim_id >= 0)], 0.99) < 1e-5
    triangles = scene.vertices[scene.faces]
    for i in differ:
        named = [p for p in (int(found.prim_id[i]), int(embree.prim_id[i])) if p >= 0]
        looks = {
            p: naive.touch(
                rays.origin[i], rays.direction[i], rays.t_near[i], rays.t_far[i], triangles[p]
            )
            for p in named
        }
        if found.prim_id[i] >= 0:
            state, t, _ = looks[int(found.prim_id[i])]
            assert state == "hit"
            assert abs(naive.Fraction(found.t[i]) - t) <= naive.Fraction(found.t_error[i])
        if embree.prim_id[i] >= 0:
            state, t_embree, tolerance = looks[int(embree.prim_id[i])]
            if state == "hit":
                assert found.prim_id[i] >= 0
                assert (t, int(found.prim_id[i])) < (t_embree, int(embree.prim_id[i]))
        right = (
            found.prim_id[i] < 0
            if embree.prim_id[i] < 0
            else state != "missed" and (found.prim_id[i] < 0 or t_embree <= t + tolerance)
        )
        assert right == (judged.verdict[i] == Verdict.CORRECT)
        assert judged.reference_wrong[i] == (not right)


def test_truth_is_the_brute_force_answer(scene, truth, rays):
    some = rays.take(np.arange(0, len(rays), len(rays) // 150))
    found, brute = truth.nearest(some), hrt.BruteForceTracer(scene).intersect(some)
    sure = ~found.exact
    assert sure.sum() > 100
    assert (found.prim_id[sure] == brute.prim_id[sure]).all()
    np.testing.assert_allclose(found.t, brute.t, rtol=1e-6)
