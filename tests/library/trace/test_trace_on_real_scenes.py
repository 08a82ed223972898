"""All ways to trace agree on camera and mirror rays of a real scene."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt import Verdict
from support import DATA

SPONZA = DATA / "sponza.npz"
pytestmark = pytest.mark.skipif(not SPONZA.is_file(), reason="sponza.npz is not there")
CAMERA = hrt.Camera.look_at((-10, 1.5, 0), (5, 3, 0), width=320, height=180)
REASON = hrt.embree_problem()
WAYS = [{"path": "run"}]
if REASON is None:
    WAYS += [
        {"path": "packet", "width": w, "coherent": c} for w in (1, 4, 8, 16) for c in (False, True)
    ]
    WAYS += [
        {"path": "packet", "width": w, "coherent": True, "order": "direction"} for w in (8, 16)
    ]


@pytest.fixture(scope="module")
def scene():
    return hrt.load_scene(SPONZA)


@pytest.fixture(scope="module", params=[True, False], ids=["robust", "default"])
def tracer(request, scene):
    return hrt.EmbreeTracer(scene, robust=request.param, path="run" if REASON else "packet")


def camera_rays(camera):
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    pixels = np.stack([x.ravel(), y.ravel(), np.full(x.size, 1.0)], axis=1)
    points = hrt.unproject(camera, pixels)
    return hrt.Rays.from_arrays(np.tile(camera.eye, (len(points), 1)), points - camera.eye)


def mirrored(scene, rays, hits):
    """Mirror rays from a hair above the surface."""
    at = hits.prim_id >= 0
    o, d = rays.origin[at].astype(float), rays.direction[at].astype(float)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    a, b, c = np.moveaxis(scene.vertices[scene.faces[hits.prim_id[at]]].astype(float), 1, 0)
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    n *= -np.sign((n * d).sum(axis=1, keepdims=True))
    p = o + ((a - o) * n).sum(axis=1, keepdims=True) / (d * n).sum(axis=1, keepdims=True) * d
    return hrt.Rays.from_arrays(p + 1e-4 * n, d - 2 * (d * n).sum(axis=1, keepdims=True) * n)


def test_every_way_agrees_on_sponza(scene, tracer):
    reference = tracer.with_path("run")
    primary = camera_rays(CAMERA)
    mirror = mirrored(scene, primary, reference.intersect(primary))
    for rays in (primary, mirror):
        expected = reference.intersect(rays)
        assert (expected.prim_id >= 0).mean() > 0.9
        every = np.ones(len(rays), bool)
        for way in WAYS:
            other = tracer.with_path(**way)
            hits = other.intersect(rays)
            judged = hrt.judge(rays, hits, every, expected, scene, CAMERA)
            counts = {name: rate.count for name, rate in hrt.rates(judged).items()}
            # Boxes of BVH nodes are rounded otherwise in packets than ray by ray, and the default
            # mode loses a few rays at edges that way.
            same = counts["correct"] + counts["tie"]
            assert same >= len(rays) - (0 if tracer.robust else 10), (way, counts)
            both = (judged.verdict == Verdict.CORRECT) & (hits.prim_id >= 0)
            np.testing.assert_allclose(hits.t[both], expected.t[both], rtol=1e-5)
            assert (other.occluded(rays) == (hits.prim_id >= 0)).mean() > 0.9999


def test_brute_force_agrees_with_embree_on_sponza(scene, tracer):
    rays = camera_rays(CAMERA.resized(32, 18))
    truth = hrt.BruteForceTracer(scene).intersect(rays)
    hits = tracer.intersect(rays)
    judged = hrt.judge(rays, hits, np.ones(len(rays), bool), truth, scene, CAMERA)
    assert np.isin(judged.verdict, [Verdict.CORRECT, Verdict.TIE]).all()
    assert judged.error_t[truth.prim_id >= 0].max() < 1e-5
