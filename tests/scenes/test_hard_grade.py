"""Grading, on a case whose answers can be read off."""

import dataclasses

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_scenes.hard.case import BuiltCase, stored
from hybrid_rt_scenes.hard_cases import get_hard_case, grade, hard_case_names


def small_case(directions):
    """Two squares, 4 and 8 away from the eye; the nearer is 2 wide, the other 20."""
    vertices = [
        (-1, -1, -4), (1, -1, -4), (1, 1, -4), (-1, 1, -4),
        (-10, -10, -8), (10, -10, -8), (10, 10, -8), (-10, 10, -8),
    ]  # fmt: skip
    scene = hrt.Scene.from_arrays(vertices, [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)])
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=64, height=64, near=0.1)
    d = np.asarray(directions, np.float32)
    return BuiltCase("small", scene, camera, hrt.Rays.from_arrays(np.zeros_like(d), d))


def marched(prim_id, t, resolved=None, t_free=None, pixel=None):
    n = len(prim_id)
    answers = hrt.Marched.unfilled(n)
    answers.status[:] = hrt.MarchStatus.HIT
    answers.resolved[:] = True if resolved is None else resolved
    answers.prim_id[:] = prim_id
    answers.t[:] = t
    answers.t_free[:] = 0 if t_free is None else t_free
    answers.pixel[:] = -1 if pixel is None else pixel
    return answers


def test_each_kind_of_answer_is_counted_as_what_it_is():
    # Straight at the near square (triangle 0), past it to the far one (triangle 2), and sideways.
    case = small_case([(0.3, -0.4, -4), (3, -4, -8), (0, 1, 0), (-0.4, 0.3, -4)])
    np.testing.assert_array_equal(case.truth.prim_id, [0, 2, -1, 1])
    right = marched([0, 2, -1, 1], [1, 1, np.inf, 1])
    result = grade(case, right, exact=True)
    assert (result.correct, result.tie, result.wrong, result.unresolved) == (4, 0, 0, 0)

    wrong = grade(case, marched([2, -1, 3, 1], [2, np.inf, 5, 1.0001]))
    assert (wrong.false_hit, wrong.false_miss, wrong.imprecise) == (2, 1, 1)
    assert wrong.first == {"false_hit": [0, 2], "false_miss": [1], "imprecise": [3]}
    assert wrong.wrong == 3
    assert grade(case, marched([2, -1, 3, 1], [2, np.inf, 5, 1.0001]), exact=True).wrong == 4


def test_unresolved_rays_are_never_wrong_except_when_handed_over_too_far():
    case = small_case([(0.3, -0.4, -4), (0, 1, 0)])
    nothing = marched([-1, -1], [np.inf, np.inf], resolved=[False, False], t_free=[0.999, np.inf])
    assert grade(case, nothing, exact=True).passed
    assert grade(case, nothing, exact=True).unresolved == 2
    too_far = marched([-1, -1], [np.inf, np.inf], resolved=[False, False], t_free=[1.01, np.inf])
    assert grade(case, too_far).passed
    result = grade(case, too_far, exact=True)
    assert (result.false_free, result.first) == (1, {"false_free": [0]})


def test_another_triangle_within_a_pixel_is_a_wrong_primitive():
    # The diagonal of the near square is shared by triangles 0 and 1; half a pixel is 0.0625 here.
    case = small_case([(0.03, -0.03, -4)])
    result = grade(case, marched([1], [1]))
    assert (result.wrong_primitive, result.wrong) == (1, 0)
    assert not grade(case, marched([1], [1]), exact=True).passed
    assert grade(small_case([(0, 0, -4)]), marched([1], [1]), exact=True).tie == 1


def test_a_ray_that_projects_to_a_point_is_judged_by_depth():
    """All its points are on the same pixel, also those of the far square."""
    case = small_case([(0, 0, -4)])
    assert grade(case, marched([2], [2])).false_hit == 1


def test_a_pixel_vouches_for_its_answer_within_a_pixel():
    case = small_case([(3.3, -0.4, -1)])
    rays = dataclasses.replace(case.rays, origin=np.full_like(case.rays.origin, (-3, 0, -3)))
    case = dataclasses.replace(case, rays=rays)
    np.testing.assert_array_equal(case.truth.prim_id, [0])
    x, y = np.floor(hrt.project(case.camera, [(0.3, -0.4, -4)])[0, :2]).astype(int)
    # The point at t = 1.2 lies five pixels aside.
    assert grade(case, marched([1], [1.2], pixel=[(x, y)])).wrong_primitive == 1
    assert grade(case, marched([1], [1.2], pixel=[(x + 3, y)])).false_hit == 1
    assert grade(case, marched([1], [1.2])).false_hit == 1


def test_nan_and_unknown_triangles_are_false_hits():
    case = small_case([(0.3, -0.4, -4)] * 3)
    assert grade(case, marched([0, 99, 99], [np.nan, 5, np.inf])).false_hit == 3


def test_another_number_of_answers_is_refused():
    with pytest.raises(hrt.ArgumentError, match="answers"):
        grade(small_case([(0, 0, -4)]), marched([0, 0], [1, 1]))
    with pytest.raises(hrt.ArgumentError, match="answers"):
        grade(small_case([(0, 0, -4)]), "hits")


def test_a_tracer_may_be_graded():
    case = small_case([(0.3, -0.4, -4), (0, 1, 0)])
    hits = hrt.BruteForceTracer(case.scene).intersect(case.rays)
    assert grade(case, hits, exact=True).correct == 2


def test_unknown_case_is_answered_with_the_nearest():
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'slivers'"):
        get_hard_case("silvers")
    assert len(set(hard_case_names())) == len(hard_case_names()) > 40


def test_depth_formats_store_what_they_can_hold():
    depth = np.array([[1, 0.5, 1e-3, 1e-6, 1e-9, 0]], np.float32)
    assert stored(depth, "float32") is depth
    half = 0.5 / (2**16 - 1)
    np.testing.assert_allclose(stored(depth, "unorm16"), depth, atol=half * 1.01, rtol=0)
    assert stored(depth, "unorm16")[0, 3] == 0  # beyond the last step: background
    np.testing.assert_allclose(stored(depth, "unorm24"), depth, atol=2**-24, rtol=0)
    assert stored(depth, "unorm24")[0, 4] == 0
    assert stored(depth, "standard_z")[0, 4] == 0
    np.testing.assert_allclose(stored(depth, "standard_z"), depth, atol=2**-24, rtol=0)


def test_case_hands_its_depth_format_to_the_gbuffer():
    case = small_case([(0, 0, -4)])
    coarse = dataclasses.replace(case, depth_format="unorm16")
    steps = coarse.gbuffer.depth.astype(np.float64) * (2**16 - 1)
    np.testing.assert_allclose(steps, np.round(steps), atol=2e-3)
    np.testing.assert_array_equal(coarse.gbuffer.prim_id, case.gbuffer.prim_id)
