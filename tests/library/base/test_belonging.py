"""Rays, screens and tracers of different scenes or views are refused, whatever the combination."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

import hybrid_rt as hrt


def place(shift, size):
    """Return a scene, moved along x, and two views of it that differ in their size."""
    box = np.array([[-5, 0, -5], [5, 0, -5], [5, 0, 5], [-5, 0, 5], [5, 6, -4], [-5, 6, -4]])
    faces = [[0, 1, 2], [0, 2, 3], [0, 1, 4], [0, 4, 5]]
    scene = hrt.Scene.from_arrays(box + np.array([shift, 0, 0]), faces, name=f"moved {shift}")
    camera = hrt.Camera.look_at((shift, 1.5, 4), (shift, 0.8, -4), width=size, height=20)
    return [(scene, camera), (scene, camera.resized(size + 1, 20))]


VIEWS = [*place(0.0, 32), *place(0.25, 32)]
GBUFFERS = [hrt.rasterize(scene, camera) for scene, camera in VIEWS]
RAYS = [hrt.mirror_rays(gbuffer) for gbuffer in GBUFFERS]
TRACERS = [hrt.BruteForceTracer(scene) for scene, _ in VIEWS]


@pytest.mark.parametrize("name", list(hrt.TECHNIQUES))
def test_only_what_belongs_together_is_taken(name):
    screens = [hrt.prepare(gbuffer, name) for gbuffer in GBUFFERS]
    taken = 0
    for r, s, t in itertools.product(range(4), range(4), range(4)):
        call = lambda: hrt.trace_hybrid(RAYS[r], screens[s], TRACERS[t])  # noqa: E731, B023
        if r == s and VIEWS[s][0] is VIEWS[t][0]:
            call()
            taken += 1
            continue
        with pytest.raises(hrt.ArgumentError, match=r"^(rays|tracer): expected .* got "):
            call()
        with pytest.raises(hrt.ArgumentError, match=r"^(rays|tracer): expected .* got "):
            hrt.occluded_hybrid(RAYS[r], screens[s], TRACERS[t])
    assert taken == 8


def test_march_and_tracers_refuse_rays_of_another_scene():
    screen = hrt.prepare(GBUFFERS[0], "paper")
    for rays in RAYS[1:]:
        with pytest.raises(hrt.ArgumentError, match=r"^rays: "):
            hrt.march(rays, screen)
    with pytest.raises(hrt.ArgumentError, match=r"rays of another scene, 'moved 0\.25'"):
        TRACERS[0].intersect(RAYS[2])
    with pytest.raises(hrt.ArgumentError, match="rays of another scene"):
        hrt.EmbreeTracer(VIEWS[0][0]).occluded(RAYS[2])
    hits = TRACERS[2].intersect(RAYS[2])
    with pytest.raises(hrt.ArgumentError, match="rays of another scene"):
        hrt.judge(RAYS[2], hits, np.ones(len(hits), bool), hits, *VIEWS[0])


def test_detached_rays_go_anywhere_and_start_from_no_pixel():
    rays = RAYS[2].detached()
    assert (rays.pixel == -1).all()
    assert rays.scene is None
    assert rays.camera is None
    marched = hrt.march(rays, hrt.prepare(GBUFFERS[0], "certified"))
    truth = TRACERS[0].intersect(rays)
    assert marched.resolved.any()
    assert (marched.prim_id == truth.prim_id)[marched.resolved].all()


def test_an_equal_scene_is_the_same_scene():
    scene, _ = VIEWS[0]
    twin = hrt.Scene.from_arrays(scene.vertices, scene.faces)
    result = hrt.trace_hybrid(RAYS[0], hrt.prepare(GBUFFERS[0], "paper"), hrt.EmbreeTracer(twin))
    assert len(result.hits) == len(RAYS[0])
    other = scene.vertices.copy()
    other[0, 0] = np.nextafter(other[0, 0], np.float32(9))
    near = hrt.EmbreeTracer(hrt.Scene.from_arrays(other, scene.faces))
    with pytest.raises(hrt.ArgumentError, match=r"^tracer: "):
        hrt.trace_hybrid(RAYS[0], hrt.prepare(GBUFFERS[0], "paper"), near)


def test_a_screen_serves_techniques_that_read_the_same_and_no_others():
    screen = hrt.prepare(GBUFFERS[0], hrt.Certified(lists=4))
    few = hrt.Certified(lists=4, max_tests=1)
    assert screen.of(few).data is screen.data
    assert np.array_equal(
        few.march(RAYS[0], screen).t, hrt.march(RAYS[0], hrt.prepare(GBUFFERS[0], few)).t
    )
    for other in (hrt.Certified(lists=5), hrt.Certified(lists=4, cell=2), hrt.Paper(), hrt.HiZ()):
        with pytest.raises(hrt.ArgumentError, match=r"^technique: expected one that reads what"):
            screen.of(other)
        with pytest.raises(hrt.ArgumentError, match=r"^technique: "):
            other.march(RAYS[0], screen)


def test_screens_cannot_be_put_together_by_hand_nor_changed():
    screen = hrt.prepare(GBUFFERS[0], "paper")
    other = hrt.prepare(GBUFFERS[2], "paper")
    with pytest.raises(hrt.ArgumentError, match=r"one that hybrid_rt.prepare has made"):
        hrt.Screen(screen.technique, screen.gbuffer, other.data, 0.0)
    with pytest.raises(AttributeError, match="does not change"):
        screen.data = other.data
    with pytest.raises(hrt.ArgumentError, match=r"^screen: expected a Screen"):
        hrt.march(RAYS[0], GBUFFERS[0])


class Own:
    """A tracer of one's own, with answers to choose."""

    def __init__(self, scene, answer):
        self.scene, self.answer = scene, answer

    def intersect(self, rays):
        return self.answer(hrt.BruteForceTracer(self.scene).intersect(rays))


def test_a_tracer_of_ones_own_is_asked_for_what_is_unresolved():
    scene, _ = VIEWS[0]
    screen = hrt.prepare(GBUFFERS[0], "certified")
    own = hrt.trace_hybrid(RAYS[0], screen, Own(scene, lambda hits: hits))
    ours = hrt.trace_hybrid(RAYS[0], screen, TRACERS[0])
    assert np.array_equal(own.hits.prim_id, ours.hits.prim_id)
    assert 0 < own.resolved.sum() < len(RAYS[0])


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda hits: hrt.Hits(*(a[:1] for a in hits.arrays)), r"\.t: expected an array of shape"),
        (lambda hits: None, "expected a Hits"),
        (lambda hits: replace(hits, prim_id=hits.prim_id + 99), r"\.prim_id: expected values from"),
        (lambda hits: replace(hits, t=hits.t * np.nan), r"\.t: expected a finite t"),
        (lambda hits: replace(hits, u=hits.u.astype(object)), r"\.u: expected"),
    ],
    ids=["short", "none", "no such triangle", "no t", "objects"],
)
def test_a_tracer_that_answers_otherwise_is_refused(answer, said):
    screen = hrt.prepare(GBUFFERS[0], "paper")
    with pytest.raises(hrt.ArgumentError, match=f"^what the tracer returns.*{said}"):
        hrt.trace_hybrid(RAYS[0], screen, Own(VIEWS[0][0], answer))


@pytest.mark.parametrize("tracer", [None, "embree", object(), hrt.EmbreeTracer])
def test_what_is_no_tracer_is_refused_before_anything_is_marched(tracer):
    with pytest.raises(hrt.ArgumentError, match=r"^tracer: expected a tracer"):
        hrt.trace_hybrid(RAYS[0], hrt.prepare(GBUFFERS[0], "paper"), tracer)
