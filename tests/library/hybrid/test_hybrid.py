"""The hybrid: the march's answers, the tracer's answers for the rest, nothing lost or mixed up."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels.hybrid import CHUNK, answer_hits
from support.screens import through

S = hrt.MarchStatus


def room():
    """Return a box seen from inside with a ball of triangles in it, and a view of it."""
    rng = np.random.default_rng(3)
    corners = np.array([[x, y, z] for x in (-2, 2) for y in (-1, 2) for z in (-3, 3)], float)
    quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    centres = rng.uniform((-1.5, -0.8, -2), (1.5, 1.5, 1), (60, 3))
    shards = centres[:, None] + 0.25 * rng.normal(size=(60, 3, 3))
    vertices = np.concatenate([corners, shards.reshape(-1, 3)])
    faces = np.concatenate([np.array(faces), 8 + np.arange(180).reshape(60, 3)])
    scene = hrt.Scene.from_arrays(vertices, faces)
    camera = hrt.Camera.look_at((0, 0.4, 2.5), (0, 0, 0), width=160, height=120, near=0.05)
    return scene, hrt.rasterize(scene, camera)


@pytest.fixture(scope="module")
def case():
    scene, buffer = room()
    rays = hrt.mirror_rays(buffer)
    return scene, buffer, rays, hrt.EmbreeTracer(scene)


@pytest.mark.parametrize("mode", ["paper", "linear", "dda", "hiz", "slope"])
def test_resolved_rays_from_the_march_the_others_from_the_tracer(case, mode):
    _scene, buffer, rays, tracer = case
    assert len(rays) > 3 * CHUNK  # more than one chunk is put together
    marched = through(rays, buffer, mode)
    result = hrt.trace_hybrid(rays, hrt.prepare(buffer, mode), tracer)
    resolved = marched.resolved
    assert 0.1 < resolved.mean() < 0.9
    np.testing.assert_array_equal(result.resolved, resolved)
    np.testing.assert_array_equal(result.status, marched.status)
    np.testing.assert_array_equal(result.pixel, marched.pixel)
    np.testing.assert_array_equal(result.hits.prim_id[resolved], marched.prim_id[resolved])
    np.testing.assert_array_equal(result.hits.t[resolved], marched.t[resolved])
    traced = tracer.intersect(rays.take(~resolved))
    for name in ("t", "prim_id", "u", "v", "n_g"):
        got = getattr(result.hits, name)[~resolved]
        np.testing.assert_array_equal(got, getattr(traced, name))
    assert set(result.timings) == {"march", "compaction", "fallback", "merge"}
    assert all(seconds > 0 for seconds in result.timings.values())


def test_answers_of_the_march_are_complete_hits(case):
    scene, buffer, rays, tracer = case
    result = hrt.trace_hybrid(rays, hrt.prepare(buffer, "paper"), tracer)
    hits, r = result.hits, result.resolved
    a, b, c = (scene.vertices[scene.faces[hits.prim_id[r], k]].astype(float) for k in range(3))
    normal = np.cross(b - a, c - a)
    np.testing.assert_allclose(hits.n_g[r], normal, rtol=1e-5, atol=1e-6)
    u, v = hits.u[r, None], hits.v[r, None]
    on_triangle = (1 - u - v) * a + u * b + v * c
    on_ray = rays.origin[r] + hits.t[r, None] * rays.direction[r]
    np.testing.assert_allclose(on_triangle, on_ray, atol=2e-4)


def answered(resolved, rays, prim, distance, scene):
    """Return (t, prim_id, u, v, n_g) by NumPy in float64, -7 in the rows of unresolved rays."""
    a, b, c = (scene.vertices[scene.faces[prim, k]].astype(float) for k in range(3))
    normal = np.cross(b - a, c - a)
    q = rays.origin + distance[:, None].astype(float) * rays.direction - a
    with np.errstate(invalid="ignore"):
        u = (np.cross(q, c - a) * normal).sum(axis=1) / (normal**2).sum(axis=1)
        v = (np.cross(b - a, q) * normal).sum(axis=1) / (normal**2).sum(axis=1)
    hit = prim >= 0
    normal[~hit], u[~hit], v[~hit] = 0, 0, 0
    rows = distance, prim, u, v, normal
    return [np.where(resolved if x.ndim == 1 else resolved[:, None], x, -7) for x in rows]


@pytest.mark.parametrize("share", [0.0, 0.1, 0.6, 1.0])
@pytest.mark.parametrize("n", [1, 7, 16, 33, 1000, CHUNK + 5])
def test_rows_of_resolved_rays_are_written_and_no_others(case, n, share):
    scene, _buffer, rays, _tracer = case
    rng = np.random.default_rng(n)
    rays = rays.take(np.arange(n))
    resolved = rng.random(n) < share
    prim = rng.integers(-1, len(scene.faces), n).astype(np.int32)
    distance = np.where(prim < 0, np.inf, rng.uniform(0, 5, n)).astype(np.float32)
    rows = [np.full(n, -7, t) for t in (np.float32, np.int32, np.float32, np.float32)]
    rows.append(np.full((n, 3), -7, np.float32))
    answer_hits(
        resolved, rays.origin, rays.direction, prim, distance, scene.vertices, scene.faces, *rows
    )  # fmt: skip
    for got, expected in zip(rows, answered(resolved, rays, prim, distance, scene), strict=True):
        np.testing.assert_allclose(got, expected, rtol=2e-6, atol=1e-6)


def test_most_answers_of_the_march_agree_with_the_tracer(case):
    scene, buffer, rays, tracer = case
    result = hrt.trace_hybrid(rays, hrt.prepare(buffer, "paper"), tracer)
    reference = hrt.BruteForceTracer(scene).intersect(rays)
    same = result.hits.prim_id == reference.prim_id
    assert same.mean() > 0.98
    np.testing.assert_allclose(result.hits.t[same], reference.t[same], rtol=1e-3)


def test_the_number_of_threads_changes_nothing(case):
    _scene, buffer, rays, tracer = case
    one = hrt.trace_hybrid(rays, hrt.prepare(buffer, "paper"), tracer, threads=1)
    two = hrt.trace_hybrid(rays, hrt.prepare(buffer, "paper"), tracer)
    for name in ("t", "prim_id", "u", "v", "n_g"):
        np.testing.assert_array_equal(getattr(one.hits, name), getattr(two.hits, name))


def test_rays_that_all_fall_back_and_rays_that_all_resolve(case):
    _scene, buffer, rays, tracer = case
    resolved = through(rays, buffer).resolved
    for part, share in ((rays.take(resolved), 1.0), (rays.take(~resolved), 0.0)):
        result = hrt.trace_hybrid(part, hrt.prepare(buffer, "paper"), tracer)
        assert result.resolved.mean() == share
        assert len(result.hits) == len(part)


def test_no_rays(case):
    _scene, buffer, rays, tracer = case
    result = hrt.trace_hybrid(rays.take(np.zeros(0, int)), hrt.prepare(buffer, "paper"), tracer)
    assert len(result.hits) == 0


def test_invalid_rays_hit_nothing(case):
    _scene, buffer, _rays, tracer = case
    bad = hrt.Rays.from_arrays([[0, 0, 0]] * 3, [[0, 0, 0], [np.nan, 0, 1], [0, np.inf, 0]])
    result = hrt.trace_hybrid(bad, hrt.prepare(buffer, "paper"), tracer)
    assert (result.status == S.INVALID).all()
    assert (result.hits.prim_id == -1).all()
    assert np.isinf(result.hits.t).all()


@pytest.fixture(scope="module")
def certain():
    scene, _ = room()
    camera = hrt.Camera.look_at((0, 0.4, 2.5), (0, 0, 0), width=160, height=120, near=0.05)
    buffer = hrt.rasterize(scene, camera)
    return scene, buffer, hrt.mirror_rays(buffer), hrt.EmbreeTracer(scene)


@pytest.mark.parametrize(
    "parameters", [{"hand_over": False}, {"hand_over": True}, {"probes": 2}, {"vectors": False}]
)
def test_certified_is_the_tracer_ties_apart(certain, parameters):
    scene, buffer, rays, tracer = certain
    result = hrt.trace_hybrid(
        rays, hrt.prepare(buffer, hrt.Certified(lists=4, **parameters)), tracer
    )
    assert 0.2 < result.resolved.mean() < 0.95
    reference = tracer.intersect(rays)
    everything = np.ones(len(rays), bool)
    judged = hrt.judge(rays, result.hits, everything, reference, scene, buffer.camera)
    right = np.isin(judged.verdict, [hrt.Verdict.CORRECT, hrt.Verdict.TIE])
    assert right.all()
    assert (result.hits.prim_id == reference.prim_id).mean() > 0.999
    same = result.hits.prim_id == reference.prim_id
    np.testing.assert_allclose(result.hits.t[same], reference.t[same], rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(result.hits.u[same], reference.u[same], atol=1e-3)


class OnlyIntersects:
    """A tracer that takes no indices."""

    def __init__(self, tracer):
        self.scene, self.intersect = tracer.scene, tracer.intersect


@pytest.mark.parametrize(
    "mode", ["paper", hrt.Certified(lists=4, probes=4), hrt.Certified(lists=4)]
)
def test_a_tracer_that_writes_in_place_and_one_that_does_not_give_the_same(
    case, certain, mode, monkeypatch
):
    _scene, buffer, rays, tracer = case if mode == "paper" else certain
    slow = hrt.trace_hybrid(rays, hrt.prepare(buffer, mode), OnlyIntersects(tracer))

    def no_copy(rays, index):
        raise AssertionError("rays were copied")

    monkeypatch.setattr(hrt.Rays, "take", no_copy)
    fast = hrt.trace_hybrid(rays, hrt.prepare(buffer, mode), tracer)
    assert 0.1 < fast.resolved.mean() < 0.95
    for name in ("t", "prim_id", "u", "v", "n_g"):
        np.testing.assert_array_equal(getattr(fast.hits, name), getattr(slow.hits, name))
    assert (fast.marched.prim_id[~fast.resolved] == -1).all()


def test_hand_over_starts_rays_later_and_before_their_hit(certain):
    _scene, buffer, rays, tracer = certain
    starts = []

    class Recorder:
        scene = tracer.scene

        def intersect(self, rest):
            starts.append(rest)
            return tracer.intersect(rest)

    for hand_over in (False, True):
        mode = hrt.Certified(lists=4, hand_over=hand_over)
        result = hrt.trace_hybrid(rays, hrt.prepare(buffer, mode), Recorder())
    own, handed = starts
    left = rays.take(~result.resolved)
    np.testing.assert_array_equal(own.t_near, left.t_near)
    assert (handed.t_near >= own.t_near).all()
    assert (handed.t_near > own.t_near).mean() > 0.5
    assert (handed.t_near <= np.maximum(result.marched.t_free[~result.resolved], own.t_near)).all()
    true = tracer.intersect(left).t
    assert (handed.t_near < true).all()


def test_an_unknown_mode(case):
    _scene, buffer, rays, tracer = case
    with pytest.raises(hrt.UnknownNameError, match="unknown technique 'psychic'"):
        hrt.trace_hybrid(rays, hrt.prepare(buffer, "psychic"), tracer)
