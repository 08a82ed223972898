"""The workloads that can be measured, and the lights that they need."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.measure.workloads import OCCLUSION_REACH, WORKLOADS, get_workload
from hybrid_rt_scenes import SceneSpec, automatic_lights, get_scene, read_definition

NAMES = [
    "mirror", "glossy_0.1", "glossy_0.3", "glossy_0.6", "diffuse",
    "ambient_occlusion", "shadow_point", "shadow_area", "shadow_sun",
]  # fmt: skip


@pytest.fixture(scope="module")
def view():
    spec = get_scene("sphere")
    return spec, hrt.rasterize(spec.load(), spec.camera("front", 96, 54))


def test_all_workloads_are_there():
    assert list(WORKLOADS) == NAMES
    for name in NAMES:
        assert get_workload(name).name == name
        assert get_workload(name).any_hit == (name == "ambient_occlusion" or "shadow" in name)
    with pytest.raises(hrt.UnknownNameError, match="unknown workload 'difuse'; did you mean"):
        get_workload("difuse")


def same(a, b):
    fields = ("origin", "direction", "pixel", "t_near", "t_far")
    return all(np.array_equal(getattr(a, f), getattr(b, f)) for f in fields)


def test_workloads_are_the_rays_that_they_say(view):
    spec, buffer = view
    low, high = buffer.scene.bounds
    lights = spec.lights
    expected = {
        "mirror": hrt.mirror_rays(buffer),
        "glossy_0.1": hrt.glossy_rays(buffer, 0.1, 5),
        "glossy_0.3": hrt.glossy_rays(buffer, 0.3, 5),
        "glossy_0.6": hrt.glossy_rays(buffer, 0.6, 5),
        "diffuse": hrt.diffuse_rays(buffer, 5),
        "ambient_occlusion": hrt.ambient_occlusion_rays(
            buffer, OCCLUSION_REACH * float(np.linalg.norm(high - low)), 5
        ),
        "shadow_point": hrt.shadow_rays(buffer, lights.point_light),
        "shadow_area": hrt.shadow_rays(buffer, lights.area_light, 5),
        "shadow_sun": hrt.shadow_rays(buffer, lights.directional_light),
    }
    for name in NAMES:
        rays = WORKLOADS[name].make(spec, buffer, 5)
        assert same(rays, expected[name]), name
        random = name not in ("mirror", "shadow_point", "shadow_sun")
        assert same(rays, WORKLOADS[name].make(spec, buffer, 6)) != random, name


def test_a_scene_without_lights_gets_some_by_its_bounds(view):
    spec, buffer = view
    bare = SceneSpec.model_validate({**spec.model_dump(), "lights": None})
    lights = bare.lights_of(buffer.scene)
    assert lights == automatic_lights(buffer.scene)
    assert spec.lights_of(buffer.scene) == spec.lights
    low, high = buffer.scene.bounds
    assert (low < lights.point).all()
    assert (lights.point < high).all()
    rays = WORKLOADS["shadow_point"].make(bare, buffer, 0)
    free = ~hrt.EmbreeTracer(buffer.scene).occluded(rays)
    assert 0.3 < free.mean() < 1


GOOD = """
title = "A"
description = "B"
[[mesh]]
generator = "sphere"
[lights]
sun = [0, -1, 0]
point = [0, 2, 0]
area = [[0, 2, 0], [1, 0, 0], [0, 0, 1]]
[cameras.front]
eye = [0, 1, 9]
target = [0, 0, 0]
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("sun =", "sunn =", "unknown key of scene.toml [lights] 'sunn'; did you mean 'sun'"),
        ("[0, -1, 0]", "[0, 0, 0]", "direction: expected a direction of finite length"),
        ("[0, 0, 1]]", "[2, 0, 0]]", "edge_v: expected an edge that is not parallel"),
        ("[0, 0, 1]]", "[0, 0]]", "lights.area"),
        ("point = [0, 2, 0]", "", "lights.point: expected a value, got none"),
        ("point = [0, 2, 0]", "point = [0, nan, 0]", "position: expected three finite numbers"),
    ],
)
def test_wrong_lights_are_named(tmp_path, old, new, words):
    path = tmp_path / "scene.toml"
    path.write_text(GOOD)
    assert read_definition(path).lights.sun == (0, -1, 0)
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(hrt.HybridRTError) as caught:
        read_definition(path)
    assert "scene.toml" in str(caught.value)
    assert words in str(caught.value)
