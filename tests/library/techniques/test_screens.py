"""Screens, rays and tracers of one scene and view go together; of others they are refused."""

import dataclasses

import numpy as np
import pytest

import hybrid_rt as hrt
from support.soup import random_scene

CAMERA = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=24, height=16)
ASIDE = hrt.Camera.look_at((1, 0, 6), (0, 0, 0), width=24, height=16)
ONE, OTHER = (random_scene(np.random.default_rng(seed), 40) for seed in (1, 2))
TECHNIQUES = list(hrt.TECHNIQUES)
HYBRIDS = [hrt.trace_hybrid, hrt.occluded_hybrid]


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


@pytest.mark.parametrize("name", TECHNIQUES)
def test_rays_of_another_scene_or_view_are_refused(name):
    screen = hrt.prepare(view(), name)
    tracer = hrt.EmbreeTracer(ONE)
    for other, said in (
        (view(scene=OTHER), "rays: expected rays of scene"),
        (view(camera=ASIDE), "rays: expected rays of the screen's view"),
    ):
        rays = hrt.mirror_rays(other)
        calls = [lambda r: hrt.march(r, screen)]
        calls += [lambda r, hybrid=hybrid: hybrid(r, screen, tracer) for hybrid in HYBRIDS]
        for call in calls:
            with pytest.raises(hrt.ArgumentError, match=said):
                call(rays)
            call(rays.detached())


@pytest.mark.parametrize("hybrid", HYBRIDS)
@pytest.mark.parametrize("make", [hrt.EmbreeTracer, hrt.BruteForceTracer])
def test_a_tracer_of_another_scene_is_refused(hybrid, make):
    buffer = view()
    rays, screen = hrt.mirror_rays(buffer), hrt.prepare(buffer, "paper")
    with pytest.raises(hrt.ArgumentError, match="tracer: expected a tracer of scene"):
        hybrid(rays, screen, make(OTHER))
    hybrid(rays, screen, make(ONE))


@pytest.mark.parametrize("make", [hrt.EmbreeTracer, hrt.BruteForceTracer])
def test_a_tracer_refuses_rays_of_another_scene(make):
    tracer = make(OTHER)
    rays = hrt.mirror_rays(view())
    for call in (tracer.intersect, tracer.occluded):
        with pytest.raises(hrt.ArgumentError, match="rays: expected rays of scene"):
            call(rays)
        call(rays.detached())


def test_the_same_scene_loaded_twice_is_the_same_scene():
    again = hrt.Scene.from_arrays(ONE.vertices, ONE.faces, ONE.object_id)
    buffer = view()
    rays, screen = hrt.mirror_rays(buffer), hrt.prepare(buffer, "certified")
    result = hrt.trace_hybrid(rays, screen, hrt.EmbreeTracer(again))
    assert len(result.hits) == len(rays)


def test_a_screen_cannot_be_changed_or_put_together():
    screen = hrt.prepare(view(), "certified")
    with pytest.raises(AttributeError):
        screen.gbuffer = view(camera=ASIDE)
    with pytest.raises(hrt.ArgumentError, match="screen: expected one that hybrid_rt"):
        hrt.Screen(hrt.Paper(), screen.gbuffer, None, 0.0)
    with pytest.raises(hrt.ArgumentError, match="technique: expected one that reads"):
        screen.of(hrt.Paper())


def test_arrays_cannot_be_written_to_afterwards():
    buffer = view()
    rays = hrt.mirror_rays(buffer)
    held = [buffer.depth, buffer.prim_id, rays.origin, rays.t_near, ONE.vertices, ONE.faces]
    for array in held:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    vertices = np.eye(3, dtype=np.float32)
    scene = hrt.Scene.from_arrays(vertices, [[0, 1, 2]])
    vertices[0] = 99
    np.testing.assert_array_equal(scene.vertices, np.eye(3))


def test_a_gbuffer_with_other_depths_is_a_view_of_its_own():
    buffer = view()
    nearer = dataclasses.replace(buffer, depth=np.where(buffer.depth > 0, 1.0, 0.0))
    rays = hrt.mirror_rays(buffer)
    before = hrt.march(rays, hrt.prepare(buffer, "paper"))
    after = hrt.march(rays, hrt.prepare(nearer, "paper"))
    assert (before.status != after.status).any()


def test_a_technique_of_ones_own_is_registered_and_its_answers_are_checked(monkeypatch):
    len(hrt.TECHNIQUES)  # all are found before what is known is copied
    monkeypatch.setattr(hrt.TECHNIQUES, "_things", dict(hrt.TECHNIQUES._things))

    class Wrong(hrt.Technique):
        name = "wrong-on-purpose"
        description = "Names a triangle that the scene does not have"

        def _march(self, rays, screen, any_hit, threads):
            marched = hrt.Marched.unresolved(len(rays))
            marched.prim_id[:] = len(screen.scene)
            return marched

    hrt.register(Wrong)
    assert hrt.register(Wrong) is Wrong  # as a cell of a notebook does that is run again
    assert "wrong-on-purpose" in hrt.TECHNIQUES
    buffer = view()
    with pytest.raises(hrt.ArgumentError, match="'wrong-on-purpose' returns"):
        hrt.march(hrt.mirror_rays(buffer), hrt.prepare(buffer, "wrong-on-purpose"))
    with pytest.raises(hrt.ArgumentError, match="one that is not taken"):
        hrt.register(type("Paper", (hrt.Paper,), {"__module__": "elsewhere"}))
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'certified'"):
        hrt.prepare(buffer, "certifed")
