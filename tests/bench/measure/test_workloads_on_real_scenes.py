"""Workloads on real views: lights that light, and hybrids that answer as they should."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.measure.workloads import WORKLOADS
from hybrid_rt_scenes import get_scene, scene_names

CLOSED = {"kitchen", "conference"}  # no sun comes in


@pytest.mark.parametrize("name", scene_names())
def test_the_lights_of_a_scene_hang_in_the_open_and_light_it(name):
    spec = get_scene(name)
    assert spec.lights is not None
    if (why := spec.missing()) is not None:
        pytest.skip(why)
    scene = spec.load(size=2**16 if spec.resizable else None)
    tracer = hrt.EmbreeTracer(scene, build_quality="low")
    low, high = scene.bounds
    d = np.random.default_rng(0).normal(size=(300, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    point = spec.lights.point
    away = tracer.intersect(hrt.Rays.from_arrays(np.tile(point, (300, 1)), d)).t
    assert away.min() > 0.01 * np.linalg.norm(high - low)
    lit = {"point": [], "area": [], "sun": []}
    for camera in spec.cameras:
        buffer = hrt.rasterize(scene, spec.camera(camera, 96, 54))
        for kind, light in (
            ("point", spec.lights.point_light),
            ("area", spec.lights.area_light),
            ("sun", spec.lights.directional_light),
        ):
            free = ~tracer.occluded(hrt.shadow_rays(buffer, light))
            lit[kind].append(free.sum() / (buffer.prim_id >= 0).sum())
    for kind, shares in lit.items():
        if kind == "sun" and name in CLOSED:
            assert max(shares) < 0.02
        else:  # some of a view is lit, and not all of it
            assert max(shares) > 0.15, kind
            assert min(shares) < 0.97, kind


@pytest.fixture(scope="module")
def nave():
    spec = get_scene("sponza")
    if (why := spec.missing()) is not None:
        pytest.skip(why)
    scene = spec.load()
    buffer = hrt.rasterize(scene, spec.camera("nave", 480, 270))
    return spec, buffer, hrt.prepare(buffer, "paper"), hrt.EmbreeTracer(scene)


@pytest.mark.parametrize("name", WORKLOADS)
def test_workloads_are_resolved_in_part_and_mostly_right(nave, name):
    spec, buffer, screen, tracer = nave
    workload = WORKLOADS[name]
    rays = workload.make(spec, buffer, 1)
    covered = (buffer.prim_id >= 0).sum()
    assert 0.3 * covered < len(rays) <= covered
    own = buffer.prim_id[rays.pixel[:, 1], rays.pixel[:, 0]]
    # but for slivers seen edge-on, whose depth the raster clamps off their plane
    assert (tracer.intersect(rays).prim_id == own).mean() < 1e-4
    if workload.any_hit:
        result = hrt.occluded_hybrid(rays, screen, tracer)
        truth = tracer.occluded(rays)
        assert 0.02 < truth.mean() < 0.9
        wrong = result.occluded != truth
    else:
        result = hrt.trace_hybrid(rays, screen, tracer)
        truth = tracer.intersect(rays)
        assert (truth.prim_id >= 0).mean() > 0.8
        # off by more than a tenth of the way
        t = np.stack([result.hits.t, truth.t])
        hit = np.isfinite(t)
        t[~hit] = 0
        wrong = (hit[0] != hit[1]) | (np.abs(t[0] - t[1]) > 0.1 * t[1])
    assert not wrong[~result.resolved].any()
    assert 0.01 < result.resolved.mean() < 0.7
    assert wrong[result.resolved].mean() < 0.15
