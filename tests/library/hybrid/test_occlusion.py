"""The any-hit hybrid: occluded or free, from the march or from the tracer, nothing mixed up."""

import numba
import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels.hybrid import CHUNK
from support.screens import through


@pytest.fixture(scope="module")
def room():
    """Return (scene, G-buffer) of a box seen from inside, with shards in it."""
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


def ambient(buffer):
    return hrt.ambient_occlusion_rays(buffer, 0.7)


def lamp(buffer):
    return hrt.shadow_rays(buffer, hrt.PointLight((0.2, 1.6, 0.4)))


def panel(buffer):
    return hrt.shadow_rays(buffer, hrt.AreaLight((-1, 1.9, -1), (2, 0, 0), (0, 0, 1)))


MAKERS = [ambient, lamp, panel]


@pytest.mark.parametrize("make", MAKERS)
def test_resolved_rays_from_the_march_the_others_from_the_tracer(room, make):
    scene, buffer = room
    rays, tracer = make(buffer), hrt.EmbreeTracer(scene)
    assert len(rays) > 2 * CHUNK  # more than one chunk is put together
    marched = through(rays, buffer, any_hit=True)
    result = hrt.occluded_hybrid(rays, hrt.prepare(buffer, "paper"), tracer)
    resolved = marched.resolved
    assert 0.02 < resolved.mean() < 0.9
    assert result.occluded.dtype == np.bool_
    for name in ("status", "resolved", "pixel"):
        np.testing.assert_array_equal(getattr(result, name), getattr(marched, name))
    np.testing.assert_array_equal(result.occluded[resolved], marched.prim_id[resolved] >= 0)
    traced = tracer.occluded(rays.take(~resolved))
    assert 0 < traced.sum() < len(traced)
    np.testing.assert_array_equal(result.occluded[~resolved], traced)
    assert set(result.timings) == {"march", "compaction", "fallback", "merge"}


@pytest.mark.parametrize("make", MAKERS)
def test_equals_the_tracer_alone_and_brute_force_but_for_the_errors_of_the_paper(room, make):
    scene, buffer = room
    rays = make(buffer)
    embree = hrt.EmbreeTracer(scene)
    result = hrt.occluded_hybrid(rays, hrt.prepare(buffer, "paper"), embree)
    slow = hrt.occluded_hybrid(rays, hrt.prepare(buffer, "paper"), hrt.BruteForceTracer(scene))
    truth = hrt.BruteForceTracer(scene).occluded(rays)
    assert 0.02 < truth.mean() < 0.98
    assert (embree.occluded(rays) != truth).mean() < 1e-4
    assert (result.occluded != slow.occluded).mean() < 1e-4
    np.testing.assert_array_equal(slow.occluded[~slow.resolved], truth[~slow.resolved])
    assert (slow.occluded != truth).mean() < 0.02


class Counting:
    """Answer True for a ray whose number, hidden in its direction, is odd."""

    def __init__(self, scene):
        self.scene = scene

    def occluded(self, rays):
        self.asked = rays
        return (rays.direction[:, 0].astype(int) % 2).astype(bool)


def test_every_answer_goes_to_its_own_ray(room):
    """Resolved to a hit, resolved to a miss and unresolved, in an irregular order."""
    scene, buffer = room
    rng = np.random.default_rng(0)
    n = 3 * CHUNK + 17
    direction = np.column_stack([np.arange(n), np.ones(n), np.ones(n)])
    rays = hrt.Rays.from_arrays(rng.normal(size=(n, 3)), direction)
    resolved, prim = rng.random(n) < 0.4, rng.integers(-1, 1, n).astype(np.int32)
    marched = hrt.Marched.unfilled(n)
    marched.resolved[:], marched.prim_id[:] = resolved, prim
    tracer = Counting(scene)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hrt.Paper, "march", lambda *a, **k: marched)
        result = hrt.occluded_hybrid(rays, hrt.prepare(buffer, "paper"), tracer)
    np.testing.assert_array_equal(tracer.asked.direction, rays.direction[~resolved])
    expected = np.where(resolved, prim >= 0, np.arange(n) % 2 == 1)
    np.testing.assert_array_equal(result.occluded, expected)


def test_the_same_for_any_number_of_threads(room):
    scene, buffer = room
    rays = ambient(buffer)
    tracer = hrt.EmbreeTracer(scene)
    one = hrt.occluded_hybrid(rays, hrt.prepare(buffer, "paper"), tracer, threads=1)
    threads = numba.get_num_threads()
    more = hrt.occluded_hybrid(rays, hrt.prepare(buffer, "paper"), tracer, threads=threads)
    np.testing.assert_array_equal(one.occluded, more.occluded)
    np.testing.assert_array_equal(one.status, more.status)
    assert numba.get_num_threads() == threads


def test_no_rays_and_all_rays_unresolved(room):
    scene, buffer = room
    tracer = hrt.EmbreeTracer(scene)
    none = hrt.occluded_hybrid(ambient(buffer).take([]), hrt.prepare(buffer, "paper"), tracer)
    assert (len(none.occluded), len(none.resolved)) == (0, 0)
    rays = ambient(buffer).take(np.arange(50))
    exhausted = hrt.occluded_hybrid(rays, hrt.prepare(buffer, hrt.Paper(max_steps=1)), tracer)
    np.testing.assert_array_equal(exhausted.occluded, tracer.occluded(rays))


def test_any_hit_changes_nothing_in_the_march_of_the_paper(room):
    _, buffer = room
    rays = ambient(buffer)
    a, b = (through(rays, buffer, any_hit=any_hit) for any_hit in (False, True))
    for name in ("status", "resolved", "pixel", "prim_id", "t", "t_free", "steps"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_bad_input_is_named(room):
    scene, buffer = room
    rays = ambient(buffer)
    tracer = hrt.EmbreeTracer(scene)
    with pytest.raises(hrt.ArgumentError, match=r"^rays: expected a Rays"):
        hrt.occluded_hybrid(None, hrt.prepare(buffer, "paper"), tracer)
    with pytest.raises(hrt.UnknownNameError, match=r"^unknown technique 'papr'"):
        hrt.occluded_hybrid(rays, hrt.prepare(buffer, "papr"), tracer)
    with pytest.raises(hrt.ArgumentError, match=r"^threads: expected an integer >= 1"):
        hrt.occluded_hybrid(rays, hrt.prepare(buffer, "paper"), tracer, threads=0)
    with pytest.raises(hrt.ArgumentError, match=r"^any_hit: expected True or False"):
        through(rays, buffer, any_hit="yes")
