"""The judge of any-hit answers, on rays whose truth is known by construction."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt import Verdict

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)
SCENE = hrt.Scene.from_arrays(CORNERS, np.array([(0, 1, 2)], np.int32))
# Through the inside, past the triangle, and so near to an edge that float32 cannot tell.
PLACES = [(0.25, 0.25), (2.0, 2.0), (0.25, -1e-8)]


def rays():
    origin = [(x, y, 1.0) for x, y in PLACES]
    return hrt.Rays.from_arrays(origin, [(0, 0, -1.0)] * len(PLACES))


@pytest.mark.parametrize(
    ("claim", "verdicts"),
    [
        ((True, False, False), (Verdict.CORRECT, Verdict.CORRECT, Verdict.CORRECT)),
        ((False, True, True), (Verdict.FALSE_MISS, Verdict.FALSE_HIT, Verdict.TIE)),
    ],
)
def test_claims_are_held_against_the_truth(claim, verdicts):
    judged = hrt.judge_occlusion(rays(), claim, [True] * 3, [True, False, False], SCENE)
    assert tuple(judged.verdict) == verdicts
    assert not judged.reference_wrong.any()
    assert np.isnan(judged.error_t).all()
    assert np.isnan(judged.error_px).all()


def test_a_wrong_reference_is_told_apart():
    right = [True, False, False]
    judged = hrt.judge_occlusion(rays(), right, [True] * 3, [False, True, True], SCENE)
    wrong = Verdict.REFERENCE_WRONG
    assert tuple(judged.verdict) == (wrong, wrong, Verdict.TIE)
    assert tuple(judged.reference_wrong) == (True, True, False)


def test_unresolved_rays_are_not_looked_at():
    judged = hrt.judge_occlusion(rays(), [False, True, True], [False] * 3, [True] * 3, SCENE)
    assert (judged.verdict == Verdict.UNRESOLVED).all()
    assert hrt.rates(judged)["alpha"].count == 0


def test_limits_of_the_ray_count():
    short = hrt.Rays.from_arrays([(0.25, 0.25, 1.0)] * 2, [(0, 0, -1.0)] * 2, t_far=[0.5, 1.5])
    judged = hrt.judge_occlusion(short, [True, False], [True] * 2, [False, True], SCENE)
    assert tuple(judged.verdict) == (Verdict.FALSE_HIT, Verdict.FALSE_MISS)


@pytest.mark.parametrize("name", ["claimed", "resolved", "reference"])
def test_arrays_of_other_lengths_are_refused(name):
    arguments = {key: [True] * 3 for key in ("claimed", "resolved", "reference")}
    arguments[name] = [True] * 2
    with pytest.raises(hrt.ArgumentError, match=name):
        hrt.judge_occlusion(rays(), **arguments, scene=SCENE)


def test_a_truth_of_another_scene_is_refused():
    other = hrt.Truth(hrt.Scene.from_arrays(CORNERS + 1, np.array([(0, 1, 2)], np.int32)))
    flags = [True] * 3
    with pytest.raises(hrt.ArgumentError, match="truth"):
        hrt.judge_occlusion(rays(), flags, flags, flags, SCENE, truth=other)
