"""All ways to trace give the same answers, within their limits, and refuse what they cannot do."""

import numba
import numpy as np
import pytest

import hybrid_rt as hrt
from naive import triangle as naive

WAYS = {
    "packet-1": {"path": "packet", "width": 1},
    "packet-4": {"path": "packet", "width": 4},
    "packet-8": {"path": "packet", "width": 8},
    "packet-16": {"path": "packet", "width": 16},
    "packet-8-coherent": {"path": "packet", "width": 8, "coherent": True},
    "packet-16-coherent": {"path": "packet", "width": 16, "coherent": True},
    "run": {"path": "run"},
}
REASON = hrt.packet_available()


def soup(seed, faces=300):
    """Large triangles that cross each other, in no order."""
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(3 * faces, 3)).astype(np.float32)
    return hrt.Scene.from_arrays(vertices, np.arange(3 * faces, dtype=np.int32).reshape(-1, 3))


def random_rays(seed, n, **limits):
    rng = np.random.default_rng(seed)
    origin = 2 * rng.normal(size=(n, 3))
    return hrt.Rays.from_arrays(origin, 0.5 * rng.normal(size=(n, 3)) - origin, **limits)


@pytest.fixture(scope="module")
def scene():
    return soup(1)


@pytest.fixture(scope="module", params=[True, False], ids=["robust", "default"])
def tracer(request, scene):
    return hrt.EmbreeTracer(scene, robust=request.param, path="packet" if not REASON else "run")


@pytest.fixture(scope="module", params=WAYS)
def way(request, tracer):
    if REASON and WAYS[request.param]["path"] == "packet":
        pytest.skip(REASON)
    return tracer.with_path(**WAYS[request.param])


def assert_explained(scene, rays, hits, other):
    """Assert that two answers differ only where exact arithmetic says that they tie."""
    triangles = scene.vertices[scene.faces]
    for i in np.flatnonzero(hits.prim_id != other.prim_id):
        ts = []
        for prim in (hits.prim_id[i], other.prim_id[i]):
            assert prim >= 0, f"ray {i}: only one of them hits"
            exact = naive.intersect(rays.origin[i], rays.direction[i], triangles[prim])
            assert exact is not None, f"ray {i} does not hit {prim}"
            ts.append(float(exact[0]))
        assert ts[0] == pytest.approx(ts[1], rel=2e-6), f"ray {i}"


@pytest.mark.parametrize("n", [0, 1, 7, 1000, 2051])
def test_every_way_agrees_with_brute_force(scene, way, n):
    rays = random_rays(n, n)
    hits, truth = way.intersect(rays), hrt.BruteForceTracer(scene).intersect(rays)
    assert len(hits) == n
    same = hits.prim_id == truth.prim_id
    assert_explained(scene, rays, hits, truth)
    both = same & (hits.prim_id >= 0)
    assert both.sum() >= 0.6 * n
    np.testing.assert_allclose(hits.t[both], truth.t[both], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(hits.u[both], truth.u[both], atol=1e-5)
    np.testing.assert_allclose(hits.v[both], truth.v[both], atol=1e-5)
    np.testing.assert_allclose(hits.n_g[both], truth.n_g[both], atol=1e-5)
    miss = hits.prim_id < 0
    assert np.isinf(hits.t[miss]).all()
    assert not hits.u[miss].any()
    assert not hits.v[miss].any()
    assert not hits.n_g[miss].any()
    assert (way.occluded(rays) == ~miss).all()


def test_same_bits_for_any_number_of_threads(way):
    rays = random_rays(5, 5001)
    one = way.with_path(threads=1).intersect(rays)
    two = way.with_path(threads=min(2, numba.config.NUMBA_NUM_THREADS)).intersect(rays)
    for name in ("t", "prim_id", "u", "v", "n_g"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes(), name
