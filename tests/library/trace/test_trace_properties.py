"""What holds for any rays and triangles."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import hybrid_rt as hrt
from naive import triangle as naive

PATH = "packet" if hrt.embree_problem() is None else "run"
lattice = st.integers(-3, 3)
points = st.tuples(lattice, lattice, lattice)
# A main axis of a power of two keeps every quotient exact, so that edges are met exactly.
directions = st.tuples(lattice, lattice, st.sampled_from([-4, 4]), st.integers(0, 2)).map(
    lambda d: tuple(np.roll(d[:3], d[3]))
)
scenes = st.lists(st.tuples(points, points, points), min_size=1, max_size=5)
many_rays = st.lists(st.tuples(points, directions), min_size=1, max_size=12)


def make(triangles, rays):
    vertices = np.array(triangles, np.float32).reshape(-1, 3)
    faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    origin, direction = np.array(rays, np.float32).transpose(1, 0, 2)
    return hrt.Scene.from_arrays(vertices, faces), hrt.Rays.from_arrays(origin, direction)


@settings(max_examples=80, deadline=None)
@given(scenes, many_rays)
def test_brute_force_is_exact_on_a_lattice(triangles, rays):
    """Edges, vertices, duplicates, triangles without area, edge-on rays: all of them occur."""
    scene, rays = make(triangles, rays)
    hits = hrt.BruteForceTracer(scene, threads=1).intersect(rays)
    for i in range(len(rays)):
        best = naive.nearest(rays.origin[i], rays.direction[i], triangles)
        if best is None:
            assert hits.prim_id[i] == -1
        else:
            assert hits.t[i] == np.float32(float(best[0]))
            named = naive.intersect(rays.origin[i], rays.direction[i], triangles[hits.prim_id[i]])
            assert named is not None
            assert float(named[0]) == float(best[0])


@settings(max_examples=50, deadline=None)
@given(scenes, many_rays, st.randoms(use_true_random=False))
def test_permuting_rays_permutes_hits(triangles, rays, random):
    scene, rays = make(triangles, rays)
    order = list(range(len(rays)))
    random.shuffle(order)
    for tracer in (
        hrt.BruteForceTracer(scene, threads=1),
        hrt.EmbreeTracer(scene, path=PATH, width=4, threads=1),
    ):
        hits, permuted = tracer.intersect(rays), tracer.intersect(rays.take(np.array(order)))
        assert (hits.prim_id[order] == permuted.prim_id).all()
        assert hits.t[order].tobytes() == permuted.t.tobytes()


@settings(max_examples=50, deadline=None)
@given(scenes, many_rays, st.integers(0, 4), st.integers(0, 8))
def test_limits_keep_exactly_the_hits_between_them(triangles, rays, near, far):
    """Against the answer without limits: a first hit within them stays, one after them goes."""
    scene, rays = make(triangles, rays)
    tracer = hrt.BruteForceTracer(scene, threads=1)
    n = len(rays)
    limited = hrt.Rays.from_arrays(
        rays.origin, rays.direction, None, np.full(n, near / 4), np.full(n, far / 4)
    )
    first, hits = tracer.intersect(rays), tracer.intersect(limited)
    stays = (first.t >= near / 4) & (first.t <= far / 4)
    assert (hits.t[stays] == first.t[stays]).all()
    assert (hits.prim_id[first.t > far / 4] == -1).all()
    found = hits.prim_id >= 0
    assert ((hits.t[found] >= near / 4) & (hits.t[found] <= far / 4)).all()
    assert (tracer.occluded(limited) == found).all()


@settings(max_examples=50, deadline=None)
@given(scenes, many_rays)
def test_judge_finds_the_truth_right_against_itself_and_against_misses(triangles, rays):
    scene, rays = make(triangles, rays)
    n = len(rays)
    truth = hrt.BruteForceTracer(scene, threads=1).intersect(rays)
    camera = hrt.Camera.look_at((0, 0, 9), (0, 0, 0), width=64, height=48)
    every = np.ones(n, bool)
    itself = hrt.judge(rays, truth, every, truth, scene, camera)
    assert (itself.verdict == hrt.Verdict.CORRECT).all()
    assert (itself.error_t[truth.prim_id >= 0] <= 1e-7).all()
    nothing = hrt.Hits.empty(n)
    blind = hrt.judge(rays, nothing, every, truth, scene, camera)
    expected = np.where(truth.prim_id >= 0, hrt.Verdict.FALSE_MISS, hrt.Verdict.CORRECT)
    assert (blind.verdict == expected).all()
    reference = hrt.judge(rays, truth, every, nothing, scene, camera)
    expected = np.where(truth.prim_id >= 0, hrt.Verdict.REFERENCE_WRONG, hrt.Verdict.CORRECT)
    assert (reference.verdict == expected).all()
