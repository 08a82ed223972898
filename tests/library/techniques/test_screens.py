"""What a screen says of itself, and that it is one of its own view."""

import dataclasses

import numpy as np
import pytest

import hybrid_rt as hrt
from support.soup import random_scene

CAMERA = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=24, height=16)
ONE = random_scene(np.random.default_rng(1), 40)
TECHNIQUES = list(hrt.TECHNIQUES)


def view(scene=ONE, camera=CAMERA):
    return hrt.rasterize(scene, camera)


@pytest.mark.parametrize("name", TECHNIQUES)
def test_a_screen_knows_what_it_is_of(name):
    buffer = view()
    screen = hrt.prepare(buffer, name)
    assert screen.technique == hrt.TECHNIQUES[name]()
    assert screen.gbuffer is buffer
    assert (screen.scene, screen.camera) == (ONE, CAMERA)
    assert screen.seconds >= 0
    assert (screen.nbytes > 0) == (screen.data is not None)
    by_object = hrt.TECHNIQUES[name]().prepare(buffer)
    rays = hrt.mirror_rays(buffer)
    np.testing.assert_array_equal(hrt.march(rays, screen).status, hrt.march(rays, by_object).status)


def test_a_gbuffer_with_other_depths_is_a_view_of_its_own():
    buffer = view()
    nearer = dataclasses.replace(buffer, depth=np.where(buffer.depth > 0, 1.0, 0.0))
    rays = hrt.mirror_rays(buffer)
    before = hrt.march(rays, hrt.prepare(buffer, "paper"))
    after = hrt.march(rays, hrt.prepare(nearer, "paper"))
    assert (before.status != after.status).any()
