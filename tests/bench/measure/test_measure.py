import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.experiments import load_experiment
from hybrid_rt_bench.measure import environment as env
from hybrid_rt_bench.measure import plan, shade, strongest

PAPER = load_experiment("paper")


def quad_scene():
    """Return a floor of two triangles at y = 0."""
    corners = np.array([(-4, 0, -4), (4, 0, -4), (4, 0, 4), (-4, 0, 4)], np.float32)
    return hrt.Scene.from_arrays(corners, np.array([(0, 1, 2), (0, 2, 3)], np.int32))


class SlowTracer:
    """A tracer that takes a given time on a given clock."""

    def __init__(self, seconds, clock):
        self.seconds, self.clock = seconds, clock

    def intersect(self, rays):
        self.clock.now += self.seconds * len(rays)

    def with_path(self, *, threads):
        assert threads == 1
        return self


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def test_strongest_is_the_fastest_whatever_the_order():
    clock = Clock()
    costs = {"a": 5e-9, "b": 1e-9, "c": 3e-9, "d": 4e-9, "e": 2e-9, "f": 9e-9}
    rays = hrt.Rays.from_arrays(np.zeros((1000, 3)), np.ones((1000, 3)))
    contenders = [strongest.Candidate(k, SlowTracer(s, clock)) for k, s in costs.items()]
    for order in (contenders, contenders[::-1]):
        choice = strongest.choose(order, rays, 512, clock=clock)
        assert choice.best.label == "b"
        assert choice.nanoseconds == pytest.approx({k: 1e9 * s for k, s in costs.items()})


class DisturbedTracer(SlowTracer):
    """A tracer that something else holds up for a while, three calls of four."""

    calls = 0

    def intersect(self, rays):
        super().intersect(rays)
        self.calls += 1
        if self.calls % 4:
            self.clock.now += 1.0


def test_what_disturbs_some_blocks_of_every_round_does_not_count():
    """Whole rounds would all be disturbed, and the slower candidate would win."""
    clock = Clock()
    n = 5 * strongest.SHORTEST
    rays = hrt.Rays.from_arrays(np.zeros((n, 3)), np.ones((n, 3)))
    contenders = [
        strongest.Candidate("slow", SlowTracer(2e-9, clock)),
        strongest.Candidate("fast", DisturbedTracer(1e-9, clock)),
    ]
    choice = strongest.choose(contenders, rays, n, clock=clock)
    assert choice.best.label == "fast"
    assert choice.nanoseconds == pytest.approx({"slow": 2.0, "fast": 1.0})


@pytest.mark.parametrize(("n", "sample"), [(0, 100), (1, 100), (5000, 9000), (10**6, 131072)])
def test_blocks_are_apart_and_as_many_rays_as_asked_for(n, sample):
    blocks = strongest._blocks(n, sample, strongest.SHORTEST)
    places = np.concatenate([np.arange(n)[block] for block in blocks])
    assert len(np.unique(places)) == len(places) == min(n, sample)


def test_candidates_are_every_path_that_can_differ_in_both_modes():
    robust, default = (hrt.EmbreeTracer(quad_scene(), robust=mode) for mode in (True, False))
    found = strongest.candidates(robust, default)
    labels = [candidate.label for candidate in found]
    assert len(set(labels)) == len(labels) == 2 * (1 + 4 + 3 + 2)
    ways = {(c.tracer.path, c.tracer.width, c.tracer.coherent, c.tracer.order) for c in found}
    assert len(ways) == len(found) / 2
    for candidate in found:
        assert ("coherent" in candidate.label) is candidate.tracer.coherent
        assert ("by direction" in candidate.label) is (candidate.tracer.order == "direction")
        assert ("robust" in candidate.label) is candidate.tracer.robust
        assert candidate.label.startswith(candidate.tracer.path)
    rays = hrt.primary_rays(hrt.Camera.look_at((0, 2, 3), (0, 0, 0), width=16, height=16))
    answers = [candidate.tracer.intersect(rays).prim_id for candidate in found]
    assert all((answer == answers[0]).all() for answer in answers)


def test_a_missing_scene_is_stood_in_for_and_named(monkeypatch, tmp_path):
    monkeypatch.setenv("HYBRID_RT_DATA", str(tmp_path))
    found = plan.make_plan(PAPER)
    stand_ins = [entry.stand_in for entry in PAPER.scenes]
    assert [scene.spec.name for scene in found.scenes] == stand_ins
    assert [scene.row for scene in found.scenes] == ["", "", ""]  # none is the paper's own
    assert len(found.notes) == 3
    assert all(str(tmp_path) in note and "stands in" in note for note in found.notes)


def test_a_scene_asked_for_by_name_has_no_stand_in(monkeypatch, tmp_path):
    monkeypatch.setenv("HYBRID_RT_DATA", str(tmp_path))
    found = plan.make_plan(PAPER, scenes=["sponza", "sphere"])
    assert [scene.spec.name for scene in found.scenes] == ["sphere"]
    assert "sponza" in found.notes[0]
    with pytest.raises(plan.NothingToRunError, match="sponza"):
        plan.make_plan(PAPER, scenes=["sponza"])


def test_quick_takes_the_first_cameras_of_each_scene():
    quick = load_experiment("paper", quick=True)
    found = plan.make_plan(quick, scenes=["sphere"])
    every = tuple(plan.make_plan(PAPER, scenes=["sphere"]).scenes[0].spec.cameras)
    assert found.scenes[0].cameras == every[: quick.cameras]


def test_cameras_are_taken_by_the_scenes_that_have_them():
    found = plan.make_plan(PAPER, scenes=["sphere", "cornell"], cameras=["close"])
    assert [scene.cameras for scene in found.scenes] == [("close",)]
    assert "cornell" in found.notes[0]
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'close'"):
        plan.make_plan(PAPER, scenes=["sphere"], cameras=["clos"])


def test_sizes_of_one_scene_are_told_apart():
    street = [{"name": "street", "size": size} for size in (2**10, 5000)]
    experiment = PAPER.model_validate(
        {**PAPER.model_dump(by_alias=True), "scenes": [*street, {"name": "sphere"}]}
    )
    for scenes, wanted in ((None, 3), (["street"], 2)):
        found = plan.make_plan(experiment, scenes=scenes).scenes
        assert [scene.name for scene in found] == ["street 2^10", "street 5000", "sphere"][:wanted]
        assert [scene.size for scene in found] == [2**10, 5000, None][:wanted]


def test_a_scene_that_stands_in_for_two_is_measured_once(monkeypatch, tmp_path):
    monkeypatch.setenv("HYBRID_RT_DATA", str(tmp_path))
    both = [{"name": name, "stand_in": "sphere"} for name in ("nori_sphere", "conference")]
    experiment = PAPER.model_validate({**PAPER.model_dump(by_alias=True), "scenes": both})
    found = plan.make_plan(experiment)
    assert [scene.name for scene in found.scenes] == ["sphere"]
    assert "'sphere' is measured only once" in found.notes[-1]


def test_problems_name_what_would_spoil_timings():
    quiet = {
        "load_average": 0.0, "logical_cores": 8, "threads": 8,
        "packet_path": "available",
    }  # fmt: skip
    before = env.problems(quiet)
    for key, value, said in (
        ("load_average", 6.0, "busy"),
        ("packet_path", "no library", "no library"),
        ("threads", 9, "9 threads on 8"),
    ):
        found = env.problems({**quiet, key: value})
        assert len(found) == len(before) + 1
        assert any(said in text for text in found)


def test_normals_face_the_viewer_from_either_side():
    for height in (2.0, -2.0):
        camera = hrt.Camera.look_at((0, height, 3), (0, 0, 0), width=16, height=12)
        gbuffer = hrt.rasterize(quad_scene(), camera)
        n = shade.normals(gbuffer)
        assert np.allclose(n[gbuffer.prim_id >= 0], (0, np.sign(height), 0))
        assert (n[gbuffer.prim_id < 0] == 0).all()


def test_a_surface_under_a_roof_is_darker():
    camera = hrt.Camera.look_at((0, 1, 6), (0, 0, 0), width=40, height=30)
    floor = quad_scene()
    roof = hrt.Scene.from_arrays(
        np.concatenate([floor.vertices, floor.vertices + np.float32([0, 0.6, 0])]),
        np.concatenate([floor.faces, floor.faces + 4]),
    )
    brightness = []
    for scene in (floor, roof):
        gbuffer = hrt.rasterize(scene, camera)
        rays = hrt.mirror_rays(gbuffer)
        image = shade.shaded(gbuffer, rays, hrt.EmbreeTracer(scene))
        brightness.append(image[gbuffer.prim_id[..., None].repeat(3, 2) == 0].mean())
    assert brightness[1] < 0.8 * brightness[0]
