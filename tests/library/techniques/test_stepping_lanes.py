"""The marches that step, a ray in each lane: the answers of single rays, bit by bit.

What these answers are worth is tested in test_march.py, test_techniques.py and their naive and
property files.
"""

import dataclasses
import os
import subprocess
import sys

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels.techniques.placing import LANES
from hybrid_rt_scenes.hard_cases import get_hard_case, hard_case_names
from naive.stepping import driver as naive
from support import synthetic
from support.machines import MACHINES, machine
from support.soup import random_rays, random_scene

FIELDS = ("status", "resolved", "pixel", "prim_id", "t", "t_free", "steps")
TECHNIQUES = (
    hrt.Paper(),
    hrt.Paper(samples=1),
    hrt.Paper(samples=2, max_steps=9),
    hrt.SlopeAware(),
    hrt.SlopeAware(samples=3, max_steps=12),
    hrt.HiZ(),
    hrt.HiZ(max_steps=7, exhausted_hits=True, trace_background=False),
    hrt.HiZ(border=0.0, threshold=0.9),
    hrt.PixelDDA(),
    hrt.PixelDDA(stride=3, jitter=0.3, max_steps=11),
    hrt.Linear(),
    hrt.Linear(stride=0.2, refinements=0, max_steps=6),
    hrt.Linear(thickness=0.3, stride=0.05, refinements=7),
)
NAMES = [f"{k} {each.name}" for k, each in enumerate(TECHNIQUES)]
SIZES = ((24, 16), (16, 9), (1, 33), (41, 1), (7, 5), (1, 1), (64, 48), (130, 70))
ODD = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1e30, -1e30, 1e-40, 3e38)


def assert_same_as_single_rays(rays, gbuffer, technique):
    screen = hrt.prepare(gbuffer, technique)
    marched, by_level = naive.march(rays, screen)
    lanes = hrt.march(rays, screen)
    for name in FIELDS:
        a, b = getattr(lanes, name), getattr(marched, name)
        bits = {"t": np.int32, "t_free": np.int32}.get(name, a.dtype)
        np.testing.assert_array_equal(a.view(bits), b.view(bits), err_msg=name)
    counted = technique.steps_by_level(rays, screen)
    np.testing.assert_array_equal(counted, by_level)
    return lanes


def cameras(width, height):
    """Return views of the soup, from outside and amid it, by cameras of both kinds."""
    size = {"width": width, "height": height}
    usual = hrt.Camera.look_at((0.2, 0.3, 6.0), (0, 0, 0), near=0.1, **size)
    return (
        usual,
        hrt.Camera.look_at((0.2, 0.1, 0.3), (1, 2, 0), vfov_deg=100, near=1e-3, **size),
        dataclasses.replace(usual, aspect=1.7, shift_px=(3.25, -7.5)),
        hrt.Camera.orthographic(
            (0.2, 0.3, 6.0), (0, 0, 0), view_height=6.0, near=0.1, far=9.0, **size
        ),
    )


@pytest.mark.parametrize("technique", TECHNIQUES, ids=NAMES)
def test_synthetic_views(technique):
    rng = np.random.default_rng(5)
    for width, height in SIZES:
        buffer = synthetic.random_gbuffer(rng, width, height)
        assert_same_as_single_rays(synthetic.random_rays(rng, buffer, 300), buffer, technique)


@pytest.mark.parametrize("technique", TECHNIQUES, ids=NAMES)
def test_soups_and_cameras(technique):
    rng = np.random.default_rng(6)
    for width, height in SIZES[:3]:
        scene = random_scene(rng, 60)
        for camera in cameras(width, height):
            gbuffer = hrt.rasterize(scene, camera)
            assert_same_as_single_rays(random_rays(rng, scene, camera, 300), gbuffer, technique)
            if (gbuffer.prim_id >= 0).any():
                assert_same_as_single_rays(hrt.mirror_rays(gbuffer), gbuffer, technique)
                shadows = hrt.ambient_occlusion_rays(gbuffer, 0.7, 3)
                assert_same_as_single_rays(shadows, gbuffer, technique)


@pytest.mark.parametrize("name", hard_case_names())
def test_hard_cases(name):
    case = get_hard_case(name).build()
    for technique in TECHNIQUES:
        assert_same_as_single_rays(case.rays, case.gbuffer, technique)


@pytest.mark.parametrize("technique", TECHNIQUES, ids=NAMES)
def test_odd_numbers(technique):
    """NaN, infinities, zeros and the ends of float32 in every place of a ray."""
    rng = np.random.default_rng(7)
    buffer = synthetic.random_gbuffer(rng, 33, 21)
    usual = synthetic.random_rays(rng, buffer, 40 * len(ODD))
    columns = [np.array(a) for a in (usual.origin, usual.direction, usual.pixel)]
    t_near, t_far = np.array(usual.t_near), np.array(usual.t_far)
    for k, odd in enumerate(np.repeat(np.float32(ODD), 40)):
        place = rng.integers(8)
        if place < 6:
            columns[place // 3][k, place % 3] = odd
        elif place == 6 and odd >= 0.0:
            t_near[k] = odd
        elif place == 7 and not np.isnan(odd):
            t_far[k] = odd
    rays = hrt.Rays.from_arrays(*columns, t_near=t_near, t_far=t_far)
    assert_same_as_single_rays(rays, buffer, technique)


@pytest.mark.parametrize("count", [0, 1, LANES - 1, LANES, LANES + 1, 1023, 1025, 2500])
def test_any_number_of_rays(count):
    rng = np.random.default_rng(count)
    buffer = synthetic.random_gbuffer(rng, 40, 30)
    for technique in TECHNIQUES[::3]:
        rays = synthetic.random_rays(rng, buffer, count)
        assert len(assert_same_as_single_rays(rays, buffer, technique)) == count


def test_rays_that_cannot_start():
    """Whole batches of them, and some between others."""
    rng = np.random.default_rng(8)
    buffer = synthetic.random_gbuffer(rng, 40, 30)
    rays = synthetic.random_rays(rng, buffer, 2000)
    direction = np.array(rays.direction)
    direction[:700] = 0.0
    direction[900::3] = np.nan
    lost = hrt.Rays.from_arrays(rays.origin, direction, rays.pixel)
    marched = assert_same_as_single_rays(lost, buffer, hrt.Paper())
    assert (marched.status[:700] == hrt.MarchStatus.INVALID).all()


def everything():
    """Return every technique's answers, and a soup for them, as arrays by name."""
    rng = np.random.default_rng(9)
    scene = random_scene(rng, 80)
    answers = {}
    for k, camera in enumerate(cameras(64, 48)):
        gbuffer = hrt.rasterize(scene, camera)
        rays = random_rays(rng, scene, camera, 3000)
        for technique, name in zip(TECHNIQUES, NAMES, strict=True):
            screen = hrt.prepare(gbuffer, technique)
            marched = hrt.march(rays, screen)
            answers |= {f"{k} {name} {field}": getattr(marched, field) for field in FIELDS}
            answers[f"{k} {name} by level"] = technique.steps_by_level(rays, screen)
    return answers


PROGRAM = """
import sys
import numpy as np
from hybrid_rt.kernels.simd import WIDTH
from library.techniques.test_stepping_lanes import everything

np.savez(sys.argv[1], width=WIDTH, **everything())
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_the_same_on_another_machine(name, tmp_path):
    env, width = machine(name)
    env["PYTHONPATH"] = os.pathsep.join(sys.path)
    path = tmp_path / "answers.npz"
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(path)],
        env=env, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    ours = everything()
    with np.load(path) as theirs:
        assert theirs["width"] == width
        assert set(theirs.files) == {"width", *ours}
        for key, answer in ours.items():
            np.testing.assert_array_equal(theirs[key], answer, err_msg=key)
