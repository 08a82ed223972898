"""The certified march in the lanes of vectors: the answers of the march of single rays, bit by bit.

What these answers are worth is tested in test_certified.py, for both.
"""

import dataclasses
import os
import subprocess
import sys

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels.techniques.certified import slots
from hybrid_rt_scenes.hard_cases import get_hard_case, hard_case_names
from support.machines import MACHINES, machine
from support.screens import through
from support.soup import FORMS, random_rays, random_scene

S = hrt.MarchStatus
FIELDS = ("status", "resolved", "pixel", "prim_id", "t", "t_free", "steps")
SIZES = ((24, 16), (16, 9), (1, 33), (41, 1), (7, 5), (1, 1), (64, 48))
ODD = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1e30, -1e30, 1e-40, 3e38)


def assert_same(one, other, rows=slice(None)):
    """Rows of two `Marched` hold the same bits."""
    for name in FIELDS:
        a, b = getattr(one, name)[rows], getattr(other, name)[rows]
        assert a.dtype == b.dtype
        bits = {"t": np.int32, "t_free": np.int32}.get(name, a.dtype)
        np.testing.assert_array_equal(a.view(bits), b.view(bits), err_msg=name)


def assert_work_is_that_of(marched):
    """What the lanes counted fits the march, and together."""
    work = marched.work
    assert work.lanes == slots.W
    assert work.steps == marched.steps.sum()
    assert work.tests == marched.tests
    assert work.passes <= work.looks <= work.steps + work.tests
    assert work.rests <= work.looks
    assert work.tests <= work.planes <= work.entries
    assert all(np.isnan(share) or 0 < share <= 1 for share in work.busy.values())
    assert np.isnan(work.busy["step"]) == (work.steps == 0)


def assert_vectors_change_nothing(rays, gbuffer, technique, any_hit=False, **parameters):
    screen = hrt.prepare(gbuffer, technique)
    lanes, single = (
        hrt.march(
            rays,
            screen.of(dataclasses.replace(technique, vectors=vectors, **parameters)),
            any_hit=any_hit,
        )
        for vectors in (True, False)
    )
    assert_same(lanes, single)
    assert lanes.tests == single.tests
    assert single.work is None
    assert_work_is_that_of(lanes)
    assert lanes.steps_by_level is None
    assert single.steps_by_level.sum() == single.steps.sum()
    return lanes


@pytest.mark.parametrize("seed", range(5))
def test_lists_of_another_view(seed):
    rng = np.random.default_rng(700 + seed)
    scene = random_scene(rng, 80)
    camera = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=40, height=24)
    rays = odd_rays(rng, scene, camera, 400)
    gbuffer = hrt.rasterize(scene, camera)
    assert_vectors_change_nothing(rays, gbuffer, hrt.Certified(**FORMS[seed]))


def odd_rays(rng, scene, camera, n):
    """Return rays of all kinds, some with odd numbers in them, some that end before they start."""
    rays = random_rays(rng, scene, camera, n)
    origin, direction = rays.origin.copy(), rays.direction.copy()
    t_near, t_far = rays.t_near.copy(), rays.t_far.copy()
    for values in (origin, direction):
        at = rng.random(values.shape) < 0.02
        values[at] = rng.choice(np.array(ODD, np.float32), at.sum())
    direction[rng.random(n) < 0.02] = 0
    t_near[rng.random(n) < 0.02] = np.inf
    t_far[rng.random(n) < 0.02] = 0
    return hrt.Rays(origin, direction, rays.pixel, t_near, t_far)


def random_case(seed, n=2000, *, length=None):
    """Return (rays, gbuffer, technique) of a random scene and camera."""
    rng = np.random.default_rng(seed)
    width, height = SIZES[seed % len(SIZES)]
    scene = random_scene(rng, 24 + 8 * (seed % 5))
    camera = hrt.Camera.look_at(
        (0.1, 0.2, 5), (0.2, 0, -1), vfov_deg=(70, 20, 120)[seed % 3], width=width, height=height,
        near=(0.1, 1.5)[seed % 2],
    )  # fmt: skip
    technique = hrt.Certified(lists=length or (1, 2, 4, 16)[seed % 4])
    return odd_rays(rng, scene, camera, n), hrt.rasterize(scene, camera), technique


@pytest.mark.parametrize("seed", range(28))
def test_the_same_ray_for_ray(seed):
    case = random_case(seed)
    marched = assert_vectors_change_nothing(*case, any_hit=seed % 3 == 2)
    assert (marched.status == S.INVALID).any()
    assert marched.steps.sum() > 0
    assert marched.resolved.any() or 1 in case[1].depth.shape


@pytest.mark.parametrize("n", [0, 1, 15, 16, 17, 1023, 1025])
def test_any_number_of_rays(n):
    assert len(assert_vectors_change_nothing(*random_case(0, n))) == n


@pytest.mark.parametrize(
    "budget", [{"max_tests": 1}, {"max_tests": 2}, {"max_steps": 3}, {"max_steps": 1}]
)
@pytest.mark.parametrize("seed", [0, 6, 10])
def test_budgets(seed, budget):
    case = random_case(seed, length=16)
    marched = assert_vectors_change_nothing(*case, **budget)
    if "max_steps" in budget:
        assert (marched.status == S.EXHAUSTED).any()


@pytest.mark.parametrize("name", hard_case_names())
def test_the_hard_set(name):
    case = get_hard_case(name).build()
    for any_hit in (False, True):
        assert_vectors_change_nothing(case.rays, case.gbuffer, hrt.Certified(), any_hit)


@pytest.mark.parametrize("probes", [2, 16])
def test_threads_change_nothing(probes):
    rays, gbuffer, technique = random_case(6, 20000)
    technique = dataclasses.replace(technique, probes=probes)
    one, two = (through(rays, gbuffer, technique, threads=threads) for threads in (1, 2))
    assert_same(one, two)
    assert one.tests == two.tests
    done, again = (dataclasses.asdict(marched.work) for marched in (one, two))
    for name in (name for name in done if not name.endswith("vectors")):
        assert done[name] == again[name], name
    assert done["tests"] > 0


PROGRAM = """
import sys
import numpy as np
import hybrid_rt as hrt
from hybrid_rt.kernels.simd import WIDTH
from library.techniques.test_certified_lanes import FIELDS, random_case
from support.screens import through

marched = through(*random_case(6))
np.savez(sys.argv[1], width=WIDTH, **{name: getattr(marched, name) for name in FIELDS})
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_the_same_on_another_machine(name, tmp_path):
    env, width = machine(name)
    env["PYTHONPATH"] = os.pathsep.join(sys.path)
    path = tmp_path / "marched.npz"
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(path)],
        env=env, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    with np.load(path) as other:
        assert other["width"] == width
        theirs = hrt.Marched(**{field: other[field] for field in FIELDS})
    assert_same(through(*random_case(6)), theirs)


@pytest.mark.parametrize("n", [2000, 2001, 1024 + 16 + 3])
@pytest.mark.parametrize("probes", [1, 2, 4, 8])
def test_probes_decide_what_is_marched_and_change_no_answer(probes, n):
    rays, gbuffer, technique = random_case(6, n)
    # Neighbours alike, as rays of neighbouring pixels are: half of the groups look away.
    away = np.arange(n) // 16 % 2 == 0
    origin, direction = rays.origin.copy(), rays.direction.copy()
    origin[away] = gbuffer.camera.eye
    direction[away] = -np.array(gbuffer.camera.forward)
    rays = dataclasses.replace(rays, origin=origin, direction=direction)
    everything = through(rays, gbuffer, technique)
    marched = through(rays, gbuffer, dataclasses.replace(technique, probes=probes))
    skipped = marched.status == S.SKIPPED
    assert 0.2 < skipped.mean() < 0.9
    assert_same(marched, everything, ~skipped)
    assert marched.tests <= everything.tests
    assert not marched.resolved[skipped].any()
    assert (marched.prim_id[skipped] == -1).all()
    assert (marched.pixel[skipped] == -1).all()
    assert np.isinf(marched.t[skipped]).all()
    assert (marched.t_free[skipped] == 0).all()
    assert (marched.steps[skipped] == 0).all()
    apart = 16 // probes
    for start in range(0, n, 16):
        group = np.arange(start, min(start + 16, n))
        probe = group[apart // 2 :: apart]
        assert not skipped[probe].any()
        left_out = len(probe) > 0 and not marched.resolved[probe].any()
        np.testing.assert_array_equal(skipped[np.setdiff1d(group, probe)], left_out)


def test_arrays_that_cannot_be_written_or_have_gaps():
    rays, gbuffer, technique = random_case(0)
    wide = np.zeros((len(rays), 2), np.float32)
    wide[:, 0] = rays.t_near
    assert not rays.direction.flags.writeable
    others = hrt.Rays(
        np.asfortranarray(rays.origin), rays.direction, rays.pixel, wide[:, 0], rays.t_far
    )
    assert_vectors_change_nothing(others, gbuffer, technique)
    assert_same(through(rays, gbuffer, technique), through(others, gbuffer, technique))


def test_arrays_too_long_for_the_lanes_are_marched_ray_by_ray(monkeypatch):
    case = random_case(0)
    expected = through(*case)
    monkeypatch.setattr("hybrid_rt.techniques.certified.LARGEST_INDEX", 100)
    marched = through(*case)
    assert_same(marched, expected)
    assert marched.steps_by_level is not None
