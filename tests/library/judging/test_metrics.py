"""Each verdict by hand, all of them against the exact judge, and the intervals."""

import math

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt import Verdict
from naive import judge as naive

# Looking along -z from the origin: two squares of two triangles, at z = -5 (0, 1) and z = -10
# (2, 3); 4 is 0 once more, 5 lies behind the camera, 6 has no area.
VERTICES = [
    [(-4, -4, -5), (4, -4, -5), (4, 4, -5)],
    [(-4, -4, -5), (4, 4, -5), (-4, 4, -5)],
    [(-8, -8, -10), (8, -8, -10), (8, 8, -10)],
    [(-8, -8, -10), (8, 8, -10), (-8, 8, -10)],
    [(-4, -4, -5), (4, -4, -5), (4, 4, -5)],
    [(-9, -9, 5), (9, -9, 5), (0, 9, 5)],
    [(-1, 0, -2), (0, 0, -2), (1, 0, -2)],
]
CAMERA = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=100, height=100, near=0.1)


@pytest.fixture(scope="module")
def scene():
    vertices = np.array(VERTICES, np.float32).reshape(-1, 3)
    return hrt.Scene.from_arrays(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))


def hits_of(*answers):
    """Hits from (prim_id, t); t is of no consequence to most verdicts."""
    hits = hrt.Hits.empty(len(answers))
    for i, (prim, t) in enumerate(answers):
        hits.prim_id[i], hits.t[i] = prim, t
    return hits


def judge_one(scene, direction, claim, reference, *, pixel=None, origin=(0, 0, 0), **options):
    rays = hrt.Rays.from_arrays(np.array([origin], float), np.array([direction], float), **options)
    px = None if pixel is None else np.array([pixel], np.int32)
    resolved = np.ones(1, bool)
    judged = hrt.judge(rays, hits_of(claim), resolved, hits_of(reference), scene, CAMERA, px)
    return Verdict(judged.verdict[0]), judged.error_t[0], judged.error_px[0]


MISS = (-1, math.inf)
DOWN = (0.2, -0.3, -1.0)  # through triangles 0 and 2, well inside; pixel (60, 65)
PIXEL = (59, 64)
CORNER = (4.0, -4.0, -5.0)


def test_same_primitive_is_correct(scene):
    verdict, error_t, error_px = judge_one(scene, DOWN, (0, 5.05), (0, 5.0), pixel=PIXEL)
    assert verdict is Verdict.CORRECT
    assert error_t == pytest.approx(0.01, rel=1e-5)
    assert error_px == pytest.approx(0.5, rel=1e-5)


def test_right_primitive_at_a_distant_pixel_is_correct_and_its_error_is_told(scene):
    verdict, _, error_px = judge_one(scene, DOWN, (0, 5.0), (0, 5.0), pixel=(30, 64))
    assert verdict is Verdict.CORRECT
    assert error_px == pytest.approx(29.5, rel=1e-5)


def test_both_miss_is_correct_without_errors(scene):
    verdict, error_t, error_px = judge_one(scene, (0, 0, 1.0), MISS, MISS)
    assert verdict is Verdict.CORRECT
    assert np.isnan([error_t, error_px]).all()


def test_unresolved_rays_are_not_looked_at(scene):
    rays = hrt.Rays.from_arrays([(0.0, 0, 0)] * 2, [DOWN] * 2)
    claimed, reference = hits_of((3, 1.0), (0, 5.0)), hits_of((0, 5.0), (0, 5.0))
    judged = hrt.judge(rays, claimed, np.array([False, True]), reference, scene, CAMERA)
    assert judged.verdict.tolist() == [Verdict.UNRESOLVED, Verdict.CORRECT]
    assert np.isnan(judged.error_px[0])


def test_shared_edge_is_a_tie(scene):
    assert judge_one(scene, (1, 1, -5.0), (0, 1.0), (1, 1.0))[0] is Verdict.TIE


def test_shared_vertex_is_a_tie(scene):
    assert judge_one(scene, (-4, -4, -5.0), (0, 1.0), (1, 1.0))[0] is Verdict.TIE


def test_coplanar_duplicate_is_a_tie(scene):
    assert judge_one(scene, DOWN, (4, 5.0), (0, 5.0))[0] is Verdict.TIE


def test_neighbour_grazed_within_rounding_is_a_tie(scene):
    inside_1 = (1.0, np.nextafter(np.float32(1), np.float32(2)), -5.0)
    assert judge_one(scene, inside_1, (0, 1.0), (1, 1.0))[0] is Verdict.TIE


def test_neighbour_grazed_beyond_rounding_is_not_a_tie(scene):
    inside_1 = (1.0, 1.001, -5.0)
    assert judge_one(scene, inside_1, (0, 1.0), (1, 1.0))[0] is Verdict.WRONG_PRIMITIVE


def test_miss_past_a_grazed_silhouette_is_a_tie(scene):
    outside = (np.nextafter(np.float32(8), np.float32(9)), -2.0, -10.0)
    assert judge_one(scene, outside, MISS, (2, 1.0))[0] is Verdict.TIE
    assert judge_one(scene, outside, (2, 1.0), MISS)[0] is Verdict.TIE


def test_answer_behind_a_grazed_silhouette_is_a_tie(scene):
    outside = (np.nextafter(np.float32(4), np.float32(9)), -1.0, -5.0)
    assert judge_one(scene, outside, (2, 2.0), (0, 1.0))[0] is Verdict.TIE
    assert judge_one(scene, outside, (0, 1.0), (2, 2.0))[0] is Verdict.TIE


def test_hit_where_nothing_is_is_a_false_hit(scene):
    verdict, error_t, error_px = judge_one(scene, (0, 1.0, 0), (0, 5.0), MISS, pixel=PIXEL)
    assert verdict is Verdict.FALSE_HIT
    assert np.isnan(error_t)
    assert error_px == np.inf


def test_hit_at_a_distant_pixel_is_a_false_hit(scene):
    verdict, _, error_px = judge_one(scene, DOWN, (1, 5.0), (0, 5.0), pixel=(50, 64))
    assert verdict is Verdict.FALSE_HIT
    assert error_px == pytest.approx(9.5, rel=1e-5)


def test_farther_hit_within_the_pixel_is_a_wrong_primitive(scene):
    verdict, error_t, error_px = judge_one(scene, DOWN, (2, 10.0), (0, 5.0), pixel=PIXEL)
    assert verdict is Verdict.WRONG_PRIMITIVE
    assert error_t == pytest.approx(1.0)
    assert error_px == pytest.approx(0.5, rel=1e-5)


def test_pixel_for_a_true_hit_behind_the_camera_is_a_false_hit(scene):
    verdict, error_t, error_px = judge_one(
        scene, (0, 0, 1.0), (0, 4.0), (5, 7.0), pixel=PIXEL, origin=(0, 0, -2)
    )
    assert verdict is Verdict.FALSE_HIT
    assert error_t == pytest.approx(3 / 7)
    assert error_px == np.inf


def test_tracer_answer_behind_the_camera_has_no_pixel_error(scene):
    verdict, error_t, error_px = judge_one(scene, (0, 0, 1.0), (5, 5.0), (5, 5.0))
    assert verdict is Verdict.CORRECT
    assert error_t == 0
    assert np.isnan(error_px)


def test_miss_where_something_is_is_a_false_miss(scene):
    verdict, error_t, error_px = judge_one(scene, DOWN, MISS, (0, 5.0))
    assert verdict is Verdict.FALSE_MISS
    assert np.isnan([error_t, error_px]).all()


def test_nearer_true_hit_shows_the_reference_wrong(scene):
    verdict, error_t, error_px = judge_one(scene, DOWN, (0, 5.0), (2, 10.0), pixel=PIXEL)
    assert verdict is Verdict.REFERENCE_WRONG
    assert error_t == pytest.approx(0, abs=1e-7)
    assert error_px == pytest.approx(0.5, rel=1e-5)


def test_true_hit_where_the_reference_misses_shows_the_reference_wrong(scene):
    assert judge_one(scene, DOWN, (0, 5.0), MISS)[0] is Verdict.REFERENCE_WRONG


def test_true_miss_where_the_reference_hits_falsely_shows_the_reference_wrong(scene):
    assert judge_one(scene, (0, 1.0, 0), MISS, (0, 5.0))[0] is Verdict.REFERENCE_WRONG


def test_triangle_without_area_is_never_the_truth(scene):
    through = (0.0, 0.0, -1.0)
    short = judge_one(scene, through, MISS, (6, 2.0), t_far=[3.0])
    assert short[0] is Verdict.REFERENCE_WRONG
    assert judge_one(scene, through, (6, 2.0), (0, 5.0), pixel=(20, 20))[0] is Verdict.FALSE_HIT


def test_hits_outside_the_rays_limits_do_not_count(scene):
    limits = {"t_near": [6.0], "t_far": [20.0]}
    assert judge_one(scene, DOWN, (2, 10.0), (0, 5.0), **limits)[0] is Verdict.REFERENCE_WRONG
    assert judge_one(scene, DOWN, (0, 5.0), (2, 10.0), pixel=(9, 9), **limits)[0] is (
        Verdict.FALSE_HIT
    )


def test_third_nearer_triangle_that_both_overlook_is_found(scene):
    """Claim and reference name triangles of the far square, the near one is in front of both."""
    verdict, error_t, _ = judge_one(scene, DOWN, (2, 10.0), (3, 10.0), pixel=(20, 20))
    assert verdict is Verdict.FALSE_HIT
    assert error_t == pytest.approx(1.0)
    assert judge_one(scene, DOWN, MISS, (2, 10.0))[0] is Verdict.FALSE_MISS
    assert judge_one(scene, DOWN, (2, 10.0), MISS, pixel=PIXEL)[0] is Verdict.WRONG_PRIMITIVE


def test_reference_that_errs_is_counted_whatever_the_claim(scene):
    rays = hrt.Rays.from_arrays([(0.0, 0, 0)] * 5, [DOWN] * 5)
    claimed = hits_of((0, 5.0), (2, 10.0), (2, 10.0), (0, 5.0), MISS)
    reference = hits_of((2, 10.0), (3, 10.0), (2, 10.0), (0, 5.0), (2, 10.0))
    resolved = np.array([True, True, True, True, False])
    judged = hrt.judge(rays, claimed, resolved, reference, scene, CAMERA)
    assert judged.reference_wrong.tolist() == [True, True, False, False, False]
    assert [Verdict(v).name for v in judged.verdict] == [
        "REFERENCE_WRONG", "WRONG_PRIMITIVE", "CORRECT", "CORRECT", "UNRESOLVED"
    ]  # fmt: skip
    rate = hrt.rates(judged)["reference_wrong"]
    assert (rate.count, rate.total) == (2, 4)
    thorough = hrt.judge(rays, claimed, resolved, reference, scene, CAMERA, every=True)
    assert thorough.reference_wrong.tolist() == [True, True, True, False, False]
    assert [Verdict(v).name for v in thorough.verdict] == [
        "REFERENCE_WRONG", "WRONG_PRIMITIVE", "WRONG_PRIMITIVE", "CORRECT", "UNRESOLVED"
    ]  # fmt: skip


def test_error_of_t_is_taken_from_the_float64_truth(scene):
    """The nearest float32 is not the true t, and the judge sees by how much it is not."""
    direction = np.array((0.1, 0.1, -3), np.float32)
    t = np.float32(5 / 3)
    _, error_t, _ = judge_one(scene, direction, (0, t), (0, t))
    assert error_t == pytest.approx(abs(float(t) * 3 / 5 - 1), rel=1e-6)
    assert error_t > 1e-9


def test_truth_is_built_once_and_used_for_many_judgements(scene):
    truth = hrt.Truth(scene)
    rays = hrt.Rays.from_arrays([(0.0, 0, 0)], [DOWN])
    one = np.ones(1, bool)
    agreed, other = hits_of((0, 5.0)), hits_of((2, 10.0))
    hrt.judge(rays, agreed, one, agreed, scene, CAMERA, truth=truth)
    assert "_bvh" not in vars(truth)
    judged = hrt.judge(rays, agreed, one, other, scene, CAMERA, truth=truth)
    assert judged.verdict[0] == Verdict.REFERENCE_WRONG
    tree = vars(truth)["_bvh"]
    hrt.judge(rays, other, one, agreed, scene, CAMERA, truth=truth)
    assert vars(truth)["_bvh"] is tree


@pytest.mark.parametrize("every", [False, True])
def test_exact_judge_agrees_on_random_claims(scene, every):
    """Rays through many edges, vertices and duplicates."""
    rng = np.random.default_rng(7)
    n = 800
    origin = rng.integers(-2, 3, (n, 3)).astype(np.float32)
    direction = rng.integers(-8, 9, (n, 3)).astype(np.float32)
    direction[np.arange(n), rng.choice(3, n, p=[0.1, 0.1, 0.8])] = rng.choice([-8, 8], n)
    nudged = rng.random(n) < 0.3
    direction[nudged] = np.nextafter(direction[nudged], np.float32(np.inf))
    t_near = rng.choice(np.array([0, 0, 0.5, 1], np.float32), n)
    t_far = rng.choice(np.array([np.inf, np.inf, 1, 2], np.float32), n)
    rays = hrt.Rays.from_arrays(origin, direction, None, t_near, t_far)
    claim, ref = (hits_of(*[(p, 1.0 if p >= 0 else np.inf) for p in rng.integers(-1, 7, n)])
                  for _ in range(2))  # fmt: skip
    pixel = rng.integers(-1, 60, (n, 2)).astype(np.int32)
    ahead = np.flatnonzero(direction[:, 2] < 0)[::2]  # half of these claim about the right pixel
    t = (-5 - origin[ahead, 2]) / direction[ahead, 2]
    points = origin[ahead].astype(float) + t[:, None] * direction[ahead]
    pixel[ahead] = np.maximum(hrt.project(CAMERA, points)[:, :2], -1)
    judged = hrt.judge(rays, claim, np.ones(n, bool), ref, scene, CAMERA, pixel, every=every)
    seen = set()
    for i in range(n):
        c, r = int(claim.prim_id[i]), int(ref.prim_id[i])
        verdict, true, reference_wrong = naive.verdict(
            origin[i], direction[i], t_near[i], t_far[i], c, r, np.array(VERTICES), every
        )
        t_true = {"reference": 1.0, None: None}.get(true, true)
        error_px = np.nan
        if c >= 0:
            error_px = pixel_error(origin[i], direction[i], t_true, pixel[i])
        assert judged.error_px[i] == pytest.approx(error_px, rel=1e-6, abs=1e-4, nan_ok=True), i
        if verdict == "WRONG":
            verdict = "WRONG_PRIMITIVE" if error_px <= 1 else "FALSE_HIT"
        assert Verdict(judged.verdict[i]).name == verdict, f"ray {i}: claim {c}, reference {r}"
        assert judged.reference_wrong[i] == reference_wrong
        seen.add(verdict)
    assert seen == {v.name for v in Verdict} - {"UNRESOLVED"}


def pixel_error(origin, direction, t_true, pixel):
    if t_true is None:
        return np.inf
    true = [float(o) + float(t_true) * float(d) for o, d in zip(origin, direction, strict=True)]
    claimed = [float(o) + float(d) for o, d in zip(origin, direction, strict=True)]  # t = 1
    if true[2] < 0:
        x, y, _ = naive.on_screen(CAMERA, true)
    if min(pixel) >= 0:
        if true[2] >= 0:
            return np.inf
        return max(abs(pixel[0] + 0.5 - x), abs(pixel[1] + 0.5 - y))
    if true[2] >= 0 and claimed[2] >= 0:
        return np.nan
    if true[2] >= 0 or claimed[2] >= 0:
        return np.inf
    cx, cy, _ = naive.on_screen(CAMERA, claimed)
    return max(abs(cx - x), abs(cy - y))


def test_no_rays_are_judged_without_complaint(scene):
    none = hrt.Rays.from_arrays(np.zeros((0, 3)), np.zeros((0, 3)))
    judged = hrt.judge(none, hits_of(), np.zeros(0, bool), hits_of(), scene, CAMERA)
    assert len(judged) == 0
    assert hrt.rates(judged)["alpha"].total == 0


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"resolved": np.ones(3, bool)}, "resolved"),
        ({"resolved": np.ones(2)}, "resolved"),
        ({"claimed": hits_of((0, 1.0))}, "claimed.t"),
        ({"reference": hits_of((0, 1.0), (7, 1.0))}, "reference.prim_id"),
        ({"pixel": np.zeros((1, 2), np.int32)}, "pixel"),
        ({"pixel_tolerance": 0.0}, "pixel_tolerance"),
        ({"camera": None}, "camera"),
        ({"truth": "the truth"}, "truth"),
        ({"truth": hrt.Truth(hrt.Scene.from_arrays(np.eye(3), [[0, 1, 2]]))}, "truth"),
        ({"every": 2}, "every"),
    ],
)
def test_bad_input_is_named(scene, change, named):
    arguments = {
        "rays": hrt.Rays.from_arrays([(0.0, 0, 0)] * 2, [DOWN] * 2),
        "claimed": hits_of((0, 5.0), (0, 5.0)),
        "resolved": np.ones(2, bool),
        "reference": hits_of((0, 5.0), (0, 5.0)),
        "scene": scene,
        "camera": CAMERA,
    }
    with pytest.raises(hrt.ArgumentError) as error:
        hrt.judge(**(arguments | change))
    assert error.value.argument == named


@pytest.mark.parametrize(
    ("count", "total", "low", "high"),
    [
        (0, 0, 0.0, 1.0),
        (0, 1, 0.0, 1.0),
        (0, 300, 0.0, 0.01),  # rule of three
        (1, 10, 0.002529, 0.445016),  # R: binom.test(1, 10)
        (5, 20, 0.086572, 0.491046),  # R: binom.test(5, 20)
        (10, 10, 0.691503, 1.0),  # R: binom.test(10, 10)
    ],
)
def test_intervals_are_the_known_ones(count, total, low, high):
    rate = hrt.Rate.of(count, total)
    assert rate.low == pytest.approx(low, abs=1e-6)
    assert rate.high == pytest.approx(high, abs=1e-6)
    assert rate.low <= rate.high


def test_interval_of_a_count_that_cannot_be_is_refused():
    with pytest.raises(hrt.ArgumentError, match="count"):
        hrt.Rate.of(3, 2)


def test_rates_count_what_was_judged():
    verdict = np.array([0, 0, 1, 1, 1, 2, 3, 4, 5, 6], np.uint8)
    error_px = np.array([np.nan, np.nan, 0.2, 5.0, np.nan, 0, np.inf, np.nan, 0.9, 0])
    judged = hrt.Judged(verdict, np.full(10, np.nan), error_px, verdict == 6, 1.0)
    rates = hrt.rates(judged)
    assert (rates["alpha"].count, rates["alpha"].total) == (8, 10)
    assert rates["alpha"].value == pytest.approx(0.8)
    counts = {name: rate.count for name, rate in rates.items()}
    assert counts == {
        "alpha": 8, "correct": 3, "tie": 1, "false_hit": 1, "false_miss": 1,
        "wrong_primitive": 1, "reference_wrong": 1, "pixel_error": 2,
    }  # fmt: skip
    assert {rate.total for name, rate in rates.items() if name != "alpha"} == {8}
