"""The registry of techniques."""

import dataclasses

import numpy as np
import pytest

import hybrid_rt as hrt
import synthetic
from hybrid_rt.techniques import modes
from hybrid_rt_bench.measure.techniques import TECHNIQUES, get_technique


def box(size):
    return hrt.Scene.from_arrays(size * np.eye(3), [[0, 1, 2]])


def test_every_mode_is_a_technique_under_its_own_name():
    for name, technique in TECHNIQUES.items():
        assert technique.name == name
        assert technique.mode == modes.named(name)
        assert technique.description
        assert technique.reference


@pytest.mark.parametrize("technique", TECHNIQUES.values(), ids=TECHNIQUES)
def test_points_are_of_one_kind_and_told_apart(technique):
    points = technique.points(box(1.0))
    labels = [label for label, _ in points]
    assert len(set(labels)) == len(labels)
    assert max(map(len, labels)) <= 60
    assert all(type(mode) is type(technique.mode) for _, mode in points)
    assert len({mode for _, mode in points}) == len(points)


@pytest.mark.parametrize("technique", TECHNIQUES.values(), ids=TECHNIQUES)
def test_the_default_is_one_of_the_points(technique):
    scene = box(2.0)
    default = technique.mode
    if hasattr(default, "thickness"):
        default = dataclasses.replace(default, thickness=default.thickness_in(scene))
    assert default in [mode for _, mode in technique.points(scene)]


@pytest.mark.parametrize("name", ["linear", "dda", "hiz"])
def test_thicknesses_follow_the_scene(name):
    small, large = (get_technique(name).points(box(size)) for size in (1.0, 100.0))
    for (label, a), (same, b) in zip(small, large, strict=True):
        assert label == same
        assert b.thickness == pytest.approx(100 * a.thickness)
        assert dataclasses.replace(a, thickness=1.0) == dataclasses.replace(b, thickness=1.0)
    share = dict(small)[next(label for label, _ in small if label.startswith("thickness 0.5 %"))]
    assert share.thickness == pytest.approx(0.005 * np.sqrt(3))


def test_every_point_marches():
    rng = np.random.default_rng(3)
    buffer = synthetic.random_gbuffer(rng, 30, 20)
    rays = synthetic.random_rays(rng, buffer, 100)
    pyramid = hrt.build_depth_pyramid(buffer)
    for technique in TECHNIQUES.values():
        for _, mode in technique.points(buffer.scene):
            assert len(hrt.march(rays, buffer, pyramid, mode)) == 100


def test_parameters_in_words():
    assert get_technique("paper").parameters == {"samples": "4", "max_steps": "no limit"}
    words = get_technique("hiz").parameters
    assert words["thickness"] == "0.5 %"
    assert words["exhausted_hits"] == "yes"
    assert words["trace_background"] == "no"
    assert words["max_steps"] == "32"


def test_unknown_technique_is_answered_with_the_nearest():
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'linear'"):
        get_technique("liner")
