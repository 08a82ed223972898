"""Directions of any length give the same answers, t in units of their length."""

from dataclasses import fields

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_scenes import get_scene

POWERS = (-149, -126, -60, -24, -1, 1, 24, 60, 100, 127)


@pytest.fixture(scope="module")
def view():
    spec = get_scene("cornell")
    scene = spec.load()
    return hrt.rasterize(scene, spec.camera(next(iter(spec.cameras)), 48, 36))


def along_powers(rays, power):
    """Return rays whose directions are powers of two, that long, and which of them can be so."""
    direction = np.zeros_like(rays.direction)
    rows = np.arange(len(rays))
    axis = np.abs(rays.direction).argmax(axis=1)
    direction[rows, axis] = np.sign(rays.direction[rows, axis])
    plain = hrt.Rays(rays.origin, direction, rays.pixel, scene=rays.scene, camera=rays.camera)
    long = np.ldexp(direction, power).astype(np.float32)
    scaled = hrt.Rays(rays.origin, long, rays.pixel, scene=rays.scene, camera=rays.camera)
    return plain, scaled


@pytest.mark.parametrize("name", list(hrt.TECHNIQUES))
def test_the_length_of_a_direction_plays_no_part(view, name):
    screen = hrt.prepare(view, name)
    rays = hrt.mirror_rays(view)
    for power in POWERS:
        plain, scaled = along_powers(rays, power)
        one, other = hrt.march(plain, screen), hrt.march(scaled, screen)
        for field in ("status", "resolved", "pixel", "prim_id", "steps"):
            assert np.array_equal(getattr(one, field), getattr(other, field)), (power, field)
        hit = one.prim_id >= 0
        assert hit.any()
        with np.errstate(over="ignore"):
            expected = np.ldexp(one.t[hit].astype(np.float64), -power)
        largest = float(np.finfo(np.float32).max)
        assert np.allclose(
            other.t[hit], np.minimum(expected, largest), rtol=2.0**-22, atol=2.0**-149
        )


@pytest.mark.parametrize("tracer", ["embree", "brute", "run"])
def test_a_hit_beyond_float32_keeps_a_finite_t(view, tracer):
    traced = (
        hrt.EmbreeTracer(view.scene, path="run")
        if tracer == "run"
        else hrt.TRACERS[tracer](view.scene)
    )
    rays, short = along_powers(hrt.mirror_rays(view), -149)
    expected, hits = traced.intersect(rays), traced.intersect(short)
    assert (expected.prim_id >= 0).any()
    assert np.array_equal(hits.prim_id, expected.prim_id)
    assert np.array_equal(np.isfinite(hits.t), hits.prim_id >= 0)


def test_the_longest_direction_ends(view):
    """3e38 pixels a step kept "dda" in a loop without end."""
    rays = hrt.Rays(view.camera.eye + np.zeros((8, 3)), np.full((8, 3), 3e38, np.float32))
    for name in hrt.TECHNIQUES:
        marched = hrt.march(rays, hrt.prepare(view, name))
        assert len(fields(marched)) > 0
        assert len(set(marched.status.tolist())) == 1
