"""All ways to trace give the same answers, within their limits, and refuse what they cannot do."""

import dataclasses
import gc

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
    "packet-8-by-direction": {"path": "packet", "width": 8, "order": "direction"},
    "packet-16-by-direction": {
        "path": "packet",
        "width": 16,
        "order": "direction",
        "coherent": True,
    },
    "run": {"path": "run"},
}
REASON = hrt.embree_problem()
needs_packets = pytest.mark.skipif(REASON is not None, reason=str(REASON))
FIELDS = ("t", "prim_id", "u", "v", "n_g")


def soup(seed, faces=300):
    """Large triangles that cross each other, in no order."""
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(3 * faces, 3)).astype(np.float32)
    return hrt.Scene.from_arrays(vertices, np.arange(3 * faces, dtype=np.int32).reshape(-1, 3))


def random_rays(seed, n, **limits):
    """Rays from around the soup towards its middle."""
    rng = np.random.default_rng(seed)
    origin = 2 * rng.normal(size=(n, 3))
    return hrt.Rays.from_arrays(origin, 0.5 * rng.normal(size=(n, 3)) - origin, **limits)


@pytest.fixture(scope="module")
def scene():
    return soup(1)


@pytest.fixture(scope="module")
def truth(scene):
    return hrt.BruteForceTracer(scene)


@pytest.fixture(scope="module", params=[True, False], ids=["robust", "default"])
def tracer(request, scene):
    return hrt.EmbreeTracer(scene, robust=request.param, path="run" if REASON else "packet")


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


def assert_same_bits(one, other):
    for name in FIELDS:
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name


@pytest.mark.parametrize("n", [0, 1, 7, 1000, 2051])
def test_every_way_agrees_with_brute_force(scene, truth, way, n):
    rays = random_rays(n, n)
    hits, true = way.intersect(rays), truth.intersect(rays)
    assert len(hits) == n
    assert_explained(scene, rays, hits, true)
    both = (hits.prim_id == true.prim_id) & (hits.prim_id >= 0)
    assert both.sum() >= 0.6 * n
    np.testing.assert_allclose(hits.t[both], true.t[both], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(hits.u[both], true.u[both], atol=1e-5)
    np.testing.assert_allclose(hits.v[both], true.v[both], atol=1e-5)
    np.testing.assert_allclose(hits.n_g[both], true.n_g[both], atol=1e-5)
    assert (way.occluded(rays) == (hits.prim_id >= 0)).all()


def test_brute_force_agrees_with_exact_arithmetic(truth, scene):
    rays = random_rays(3, 12)
    hits = truth.intersect(rays)
    triangles = scene.vertices[scene.faces]
    for i in range(len(rays)):
        best = naive.nearest(rays.origin[i], rays.direction[i], triangles)
        if best is None:
            assert hits.prim_id[i] == -1
            continue
        assert hits.prim_id[i] == best[1]
        assert hits.t[i] == np.float32(float(best[0]))
        _, u, v = naive.intersect(rays.origin[i], rays.direction[i], triangles[best[1]])
        assert hits.u[i] == pytest.approx(float(u), abs=1e-7)
        assert hits.v[i] == pytest.approx(float(v), abs=1e-7)


def test_barycentrics_name_the_point_that_t_names(scene, way):
    rays = random_rays(4, 500)
    hits = way.intersect(rays)
    at = hits.prim_id >= 0
    a, b, c = np.moveaxis(scene.vertices[scene.faces[hits.prim_id[at]]].astype(float), 1, 0)
    u, v = hits.u[at, None].astype(float), hits.v[at, None].astype(float)
    on_triangle = (1 - u - v) * a + u * b + v * c
    on_ray = rays.origin[at] + hits.t[at, None].astype(float) * rays.direction[at]
    np.testing.assert_allclose(on_triangle, on_ray, atol=1e-5)


def test_a_miss_has_the_values_of_a_miss_after_any_hit(way):
    """embreex leaves u, v and Ng of the hit before; Embree leaves the packet's fields alone."""
    rays = random_rays(6, 64)
    away = np.arange(64) % 2 == 1
    direction = np.where(away[:, None], rays.origin, rays.direction)
    rays = dataclasses.replace(rays, direction=direction)
    hits = way.intersect(rays)
    assert (hits.prim_id[~away] >= 0).sum() > 16
    miss = hits.prim_id < 0
    assert miss.sum() > 16
    assert np.isposinf(hits.t[miss]).all()
    for name in ("u", "v", "n_g"):
        assert not getattr(hits, name)[miss].any()


def limited(rays, t_near=None, t_far=None):
    return hrt.Rays.from_arrays(rays.origin, rays.direction, rays.pixel, t_near, t_far)


def test_t_near_skips_what_lies_before_it(scene, truth, way):
    rays = random_rays(7, 1000)
    first = truth.intersect(rays)
    hit = first.prim_id >= 0
    factor = np.where(np.arange(1000) % 2 == 0, 0.999, 1.001)  # neighbours differ, in one packet
    rays = limited(rays, t_near=np.where(hit, first.t * factor, 0))
    hits, true = way.intersect(rays), truth.intersect(rays)
    assert_explained(scene, rays, hits, true)
    kept = hit & (factor < 1)
    assert (hits.prim_id[kept] == first.prim_id[kept]).mean() > 0.99
    assert (hits.prim_id[hit & (factor > 1)] != first.prim_id[hit & (factor > 1)]).all()
    assert (hits.t >= rays.t_near).all()
    np.testing.assert_allclose(hits.t, true.t, rtol=1e-4)
    assert (way.occluded(rays) == (true.prim_id >= 0)).all()


def test_t_far_ends_a_ray(truth, way):
    rays = random_rays(8, 1000)
    first = truth.intersect(rays)
    hit = first.prim_id >= 0
    factor = np.where(np.arange(1000) % 2 == 0, 0.999, 1.001)
    rays = limited(rays, t_far=np.where(hit, first.t * factor, np.inf))
    hits = way.intersect(rays)
    assert ((hits.prim_id >= 0) == (hit & (factor > 1))).all()
    assert (way.occluded(rays) == (hits.prim_id >= 0)).all()


def test_an_empty_range_holds_no_hit(truth, way):
    rays = random_rays(9, 100)
    n = len(rays)
    for empty in (
        limited(rays, t_near=np.full(n, 2.0), t_far=np.full(n, 1.0)),
        limited(rays, t_far=np.full(n, -1.0)),
        limited(rays, t_near=np.full(n, np.inf)),
    ):
        for tracer in (way, truth):
            assert (tracer.intersect(empty).prim_id == -1).all()
            assert not tracer.occluded(empty).any()


def test_invalid_rays_hit_nothing_and_leave_their_neighbours_alone(truth, way):
    rays = random_rays(10, 200)
    origin, direction = rays.origin.copy(), rays.direction.copy()
    bad = np.arange(200) % 5 == 2
    values = [np.nan, np.inf, -np.inf]
    for k, i in enumerate(np.flatnonzero(bad)):
        if k % 4 == 3:
            direction[i] = 0
        else:
            (origin, direction)[k % 2][i, k % 3] = values[k % 4]
    spoilt = dataclasses.replace(rays, origin=origin, direction=direction)
    for tracer in (way, truth):
        expected, hits = tracer.intersect(rays), tracer.intersect(spoilt)
        assert (hits.prim_id[bad] == -1).all()
        assert np.isposinf(hits.t[bad]).all()
        assert (hits.prim_id[~bad] == expected.prim_id[~bad]).all()
        assert (hits.t[~bad] == expected.t[~bad]).all()
        assert not tracer.occluded(spoilt)[bad].any()


@pytest.mark.parametrize("exponent", [-126, -100, -60, -20, 20, 60, 100])
def test_length_of_the_direction_does_not_matter(way, truth, exponent):
    """Embree inverts nothing below 1e-18, so rays with shorter directions miss everything."""
    rays = random_rays(11, 300)
    scaled = hrt.Rays.from_arrays(rays.origin, rays.direction * np.float32(2.0**exponent))
    for tracer in (way, truth):
        hits, expected = tracer.intersect(scaled), tracer.intersect(rays)
        assert (hits.prim_id == expected.prim_id).mean() > 0.99
        with np.errstate(over="ignore"):
            t = expected.t * np.float32(2.0**-exponent)
        np.testing.assert_allclose(hits.t, t, rtol=1e-5)
        assert (tracer.occluded(scaled) == (expected.prim_id >= 0)).all()


def test_same_bits_for_any_number_of_threads(way, truth, scene):
    rays = random_rays(5, 5001)
    two = min(2, numba.config.NUMBA_NUM_THREADS)
    assert_same_bits(
        way.with_path(threads=1).intersect(rays), way.with_path(threads=two).intersect(rays)
    )
    rays = rays.take(np.arange(500))
    assert_same_bits(
        hrt.BruteForceTracer(scene, threads=1).intersect(rays),
        hrt.BruteForceTracer(scene, threads=two).intersect(rays),
    )


def test_permuted_rays_give_permuted_hits(way):
    rays = random_rays(12, 1003)
    order = np.random.default_rng(0).permutation(1003)
    hits, permuted = way.intersect(rays), way.intersect(rays.take(order))
    assert_same_bits(hrt.Hits(*(getattr(hits, name)[order] for name in FIELDS)), permuted)


def marked(n):
    """Hits that no tracer writes, to see which rows it leaves alone."""
    hits = hrt.Hits.unfilled(n)
    for array in hits.arrays:
        array[...] = 77
    return hits


def rows(hits, index):
    return hrt.Hits(*(getattr(hits, name)[index] for name in FIELDS))


@pytest.mark.parametrize("m", [0, 1, 5, 333, 2051])
def test_rays_by_index_get_the_bits_of_the_rays_taken(way, truth, m):
    rays = random_rays(31, 3000)
    indices = np.random.default_rng(m).permutation(3000)[:m].astype(np.int32)
    rest = np.setdiff1d(np.arange(3000), indices)
    for tracer in (way, truth):
        hits, occluded = marked(3000), np.full(3000, 2, np.uint8).view(np.bool_)
        tracer.intersect_into(rays, hits, indices)
        tracer.occluded_into(rays, occluded, indices)
        expected = tracer.intersect(rays.take(indices))
        assert_same_bits(rows(hits, indices), expected)
        assert_same_bits(rows(hits, rest), marked(len(rest)))
        assert (occluded[indices] == tracer.occluded(rays.take(indices))).all()
        assert (occluded.view(np.uint8)[rest] == 2).all()


def test_without_indices_every_row_is_written(way, truth):
    rays = random_rays(32, 777)
    for tracer in (way, truth):
        hits, occluded = marked(777), np.full(777, 2, np.uint8).view(np.bool_)
        tracer.intersect_into(rays, hits)
        tracer.occluded_into(rays, occluded)
        assert_same_bits(hits, tracer.intersect(rays))
        assert (occluded == tracer.occluded(rays)).all()


def test_t_near_of_the_call_stands_in_for_that_of_the_rays(way, truth):
    """As a march hands rays over: only at the indices, and the rays themselves keep theirs."""
    rays = random_rays(33, 1000)
    first = truth.intersect(rays)
    t_near = np.where(first.prim_id >= 0, first.t * 1.001, 0.5).astype(np.float32)
    indices = np.arange(0, 1000, 3)
    t_near[np.arange(1000) % 3 != 0] = np.nan  # not looked at
    moved = limited(rays.take(indices), t_near=t_near[indices])
    for tracer in (way, truth):
        hits, occluded = marked(1000), np.empty(1000, np.bool_)
        tracer.intersect_into(rays, hits, indices, t_near)
        tracer.occluded_into(rays, occluded, indices, t_near)
        assert_same_bits(rows(hits, indices), tracer.intersect(moved))
        assert (hits.prim_id[indices] != first.prim_id[indices]).any()
        assert (occluded[indices] == tracer.occluded(moved)).all()
    assert not rays.t_near.any()


def test_a_row_of_an_invalid_ray_becomes_a_miss(way, truth):
    rays = random_rays(34, 40)
    direction = rays.direction.copy()
    direction[7] = np.nan
    rays = dataclasses.replace(rays, direction=direction)
    for tracer in (way, truth):
        hits = marked(40)
        tracer.intersect_into(rays, hits, np.array([3, 7]))
        assert_same_bits(rows(hits, [7]), hrt.Hits.empty(1))


@pytest.mark.parametrize(
    ("argument", "change"),
    [
        ("indices", {"indices": np.array([0, 10])}),
        ("indices", {"indices": np.array([-1])}),
        ("indices", {"indices": np.array([0.5])}),
        ("indices", {"indices": np.array([[0, 1]])}),
        ("t_near", {"t_near": np.zeros(9, np.float32)}),
        ("hits", {"hits": None}),
        ("hits.t", {"hits": hrt.Hits.empty(9)}),
        ("hits.u", {"hits": dataclasses.replace(hrt.Hits.empty(10), u=np.zeros(10))}),
        ("hits.v", {"hits": dataclasses.replace(hrt.Hits.empty(10), v=np.zeros(20, "f4")[::2])}),
        ("hits.prim_id", {"hits": dataclasses.replace(hrt.Hits.empty(10), prim_id=[0] * 10)}),
        (
            "hits.n_g",
            {
                "hits": dataclasses.replace(
                    hrt.Hits.empty(10), n_g=np.broadcast_to(np.float32(0), (10, 3))
                )
            },
        ),
    ],
)
def test_places_that_cannot_be_read_or_written_are_refused(way, truth, argument, change):
    for tracer in (way, truth):
        hits = hrt.Hits.empty(10)
        with pytest.raises(hrt.ArgumentError) as error:
            tracer.intersect_into(random_rays(35, 10), **({"hits": hits} | change))
        assert error.value.argument == argument
        assert_same_bits(hits, hrt.Hits.empty(10))


def test_flags_that_cannot_be_written_are_refused(way, truth):
    rays = random_rays(36, 10)
    for tracer in (way, truth):
        for flags in (np.zeros(9, np.bool_), np.zeros(10, np.int8), np.zeros(20, np.bool_)[::2]):
            with pytest.raises(hrt.ArgumentError, match="occluded: expected a writable"):
                tracer.occluded_into(rays, flags)


def test_inputs_are_never_written(way, truth):
    rays = random_rays(13, 100, t_near=np.full(100, 0.1), t_far=np.full(100, 3.0))
    before = rays.take(np.arange(100))
    for tracer in (way, truth):
        tracer.intersect(rays)
        tracer.occluded(rays)
    for name in ("origin", "direction", "pixel", "t_near", "t_far"):
        assert (getattr(rays, name) == getattr(before, name)).all(), name


def test_scenes_do_not_mix(scene, tracer):
    """embreex ignores meshes that come after the first ray; here each scene has its own."""
    other = soup(2, faces=20)
    second = hrt.EmbreeTracer(other, robust=tracer.robust, path=tracer.path)
    rays = random_rays(14, 300)
    for one, its_scene in ((tracer, scene), (second, other)):
        assert_explained(
            its_scene, rays, one.intersect(rays), hrt.BruteForceTracer(its_scene).intersect(rays)
        )


def test_what_the_caller_does_to_his_vertices_later_is_nothing_to_the_tracer():
    vertices = np.array([(-1, -1, -2), (1, -1, -2), (0, 1, -2)], np.float32)
    scene = hrt.Scene.from_arrays(vertices, np.array([[0, 1, 2]], np.int32))
    tracer = hrt.EmbreeTracer(scene, path="run" if REASON else "packet")
    vertices[:] = 100
    rays = hrt.Rays.from_arrays(np.zeros((1, 3)), np.array([(0.0, 0, -1)]))
    assert tracer.intersect(rays).t[0] == pytest.approx(2)


def test_zero_area_triangles_are_never_hit_and_keep_their_number():
    vertices = np.array(
        [(-1, 0, -1), (0, 0, -1), (1, 0, -1), (0, 3, -2), (-3, -3, -2), (3, -3, -2)]
    )
    faces = np.array([(0, 1, 2), (1, 1, 1), (3, 4, 5)], np.int32)
    scene = hrt.Scene.from_arrays(vertices.astype(np.float32), faces)
    rays = hrt.Rays.from_arrays(np.zeros((9, 3)), np.tile([(0.0, 0, -1)], (9, 1)))
    assert scene.zero_area == 2
    for tracer in (hrt.BruteForceTracer(scene), hrt.EmbreeTracer(scene, path="run")):
        assert (tracer.intersect(rays).prim_id == 2).all()
    if not REASON:
        assert (hrt.EmbreeTracer(scene).intersect(rays).prim_id == 2).all()


@needs_packets
def test_ways_share_what_is_built(scene):
    tracer = hrt.EmbreeTracer(scene, threads=1)
    wide = tracer.with_path(width=16, coherent=True, order="direction")
    assert (wide.path, wide.width, wide.coherent, wide.threads) == ("packet", 16, True, 1)
    assert (wide.order, wide.with_path(width=4).order) == ("direction", "direction")
    assert (tracer.width, tracer.coherent, tracer.order) == (8, False, "given")
    assert wide._bvh.native is tracer._bvh.native
    assert wide.build_seconds == tracer.build_seconds > 0
    run = tracer.with_path("run")
    assert run.path == "run"
    assert tracer.with_path("run")._bvh.embreex is run._bvh.embreex
    assert run.build_seconds > 0


@needs_packets
def test_memory_is_given_back(scene):
    tracer = hrt.EmbreeTracer(scene)
    other = tracer.with_path(width=1)
    release = tracer._bvh.native._finalizer
    del tracer
    gc.collect()
    assert release.alive
    assert other.intersect(random_rays(15, 10)).prim_id.max() >= 0
    del other
    gc.collect()
    assert not release.alive


@pytest.mark.parametrize("quality", ["low", "medium", "high"])
@needs_packets
def test_build_quality_does_not_change_answers(scene, truth, quality):
    rays = random_rays(16, 500)
    tracer = hrt.EmbreeTracer(scene, build_quality=quality)
    assert tracer.build_quality == quality
    assert_explained(scene, rays, tracer.intersect(rays), truth.intersect(rays))


def test_threads_are_those_asked_for_and_numba_gets_its_own_back(scene):
    before = numba.get_num_threads()
    tracer = hrt.EmbreeTracer(scene, threads=1, path="run" if REASON else "packet")
    assert tracer.threads == 1
    assert hrt.BruteForceTracer(scene).threads == before
    tracer.intersect(random_rays(17, 10))
    assert numba.get_num_threads() == before


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"path": "walk"}, "path"),
        ({"width": 2}, "width"),
        ({"threads": 0}, "threads"),
        ({"threads": 100000}, "threads"),
        ({"threads": 1.5}, "threads"),
        ({"robust": "yes"}, "robust"),
        ({"coherent": None}, "coherent"),
        ({"order": "random"}, "order"),
        ({"build_quality": "best"}, "build_quality"),
    ],
)
def test_options_that_do_not_exist_are_refused(scene, options, named):
    with pytest.raises(hrt.ArgumentError) as error:
        hrt.EmbreeTracer(scene, **options)
    assert error.value.argument == named


def test_things_that_are_no_scene_and_no_rays_are_refused(scene, truth, way):
    with pytest.raises(hrt.ArgumentError, match="scene: expected a Scene"):
        hrt.EmbreeTracer(scene.vertices)
    with pytest.raises(hrt.ArgumentError, match="scene: expected a Scene"):
        hrt.BruteForceTracer(None)
    for tracer in (way, truth):
        with pytest.raises(hrt.ArgumentError, match="rays: expected a Rays"):
            tracer.intersect(scene)


def test_rays_of_unequal_lengths_cannot_be_made():
    """embreex takes 2 directions for 1000 origins and reads out of bounds."""
    rays = random_rays(18, 50)
    for make in (hrt.Rays, hrt.Rays.from_arrays):
        with pytest.raises(hrt.ArgumentError, match=r"direction: expected 50 rows"):
            make(rays.origin, rays.direction[:2], rays.pixel, rays.t_near, rays.t_far)


def test_strided_read_only_and_double_arrays_are_taken(way, truth):
    """embreex refuses float64; Numba would compile a kernel again for each other layout."""
    rays = random_rays(19, 60)
    odd = hrt.Rays(
        np.asfortranarray(rays.origin),
        rays.direction.astype(np.float64),
        rays.pixel,
        np.broadcast_to(np.float32(0), 60),
        np.broadcast_to(np.float32(np.inf), 60),
    )
    for tracer in (way, truth):
        assert_same_bits(tracer.intersect(odd), tracer.intersect(rays))


@pytest.mark.parametrize("size", [2.0**-50, 2.0**50])
def test_scenes_beyond_the_range_of_embree_are_refused(size):
    """Embree answers with misses there, without a word."""
    vertices = soup(1, faces=2).vertices * np.float32(size)
    scene = hrt.Scene.from_arrays(vertices, np.array([[0, 1, 2]], np.int32))
    with pytest.raises(hrt.ArgumentError, match="scene: expected a largest coordinate from"):
        hrt.EmbreeTracer(scene)
