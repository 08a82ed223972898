"""Experiments of kind "error": what they say, which cells they plan, how a cell is judged."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.experiments import load_experiment, parse_experiment
from hybrid_rt_bench.judged import cell as error_cell
from hybrid_rt_bench.judged import image_error
from hybrid_rt_bench.judged.columns import VERDICTS
from hybrid_rt_bench.judged.run import plan_cells
from hybrid_rt_bench.kinds.error.spec import ErrorExperiment
from hybrid_rt_bench.measure import shade
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.measure.loaded import prepare
from hybrid_rt_bench.measure.points import (
    CHEAPEST,
    LISTS,
    SWITCHES,
    ListsForm,
    View,
    points_of,
)
from hybrid_rt_bench.measure.queries import AnyHit, NearestHit
from hybrid_rt_bench.measure.techniques import TECHNIQUES, get_technique
from hybrid_rt_bench.measure.workloads import get_workload
from hybrid_rt_scenes import get_scene

TEXT = """
schema = 1
kind = "error"
name = "x"
title = "X"
techniques = ["paper", "hiz"]
counted = ["paper"]
resolutions = ["64x48", "128x96"]
timed = ["64x48"]
picture = "64x48"
rounds = 2
[[scenes]]
name = "cornell"
[[workloads]]
name = "mirror"
points = "all"
[[workloads]]
name = "diffuse"
cameras = 1
seeds = 2
"""


@pytest.fixture(scope="module")
def cornell():
    return get_scene("cornell")


@pytest.fixture(scope="module")
def measured(cornell):
    """Measure the mirror and the shadow rays of a small view, all techniques' default points."""
    loaded = prepare(cornell.load(), 1)
    view = View(loaded.scene, cornell.camera(next(iter(cornell.cameras)), 64, 48), 1)
    points = [
        point
        for technique in TECHNIQUES.values()
        for point in points_of(technique, loaded.scene, "default")
    ]
    found = {}
    for name, query in (("mirror", NearestHit()), ("shadow_point", AnyHit())):
        rays = get_workload(name).make(cornell, view.gbuffer, 0)
        cell = error_cell.Cell(query, rays, points, 2, name == "mirror", 1024)
        found[name] = error_cell.measure_cell(loaded, view, cell)
    return found


@pytest.mark.parametrize("quick", [False, True])
def test_the_experiment_of_the_package_asks_for_what_is_there(quick):
    experiment = load_experiment("error", quick=quick)
    assert isinstance(experiment, ErrorExperiment)
    for entry in experiment.workloads:
        get_workload(entry.name)
    assert "mirror" in [entry.name for entry in experiment.workloads]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('counted = ["paper"]', 'counted = ["linear"]', r"counted: expected one of techniques"),
        ('timed = ["64x48"]', 'timed = ["65x48"]', r"timed: expected one of resolutions"),
        ('picture = "64x48"', 'picture = "128x96"', r"picture: expected one of timed .*64x48"),
        ("seeds = 2", "seeds = 0", r"workloads.1.seeds"),
        ("rounds = 2", 'rounds = 2\ncomplete = ["128x96"]', r"complete: expected one of timed"),
        ('points = "all"', 'points = "switch"', r"workloads.0.points: .*'switches'.*'switch'"),
    ],
)
def test_settings_that_do_not_fit_are_refused(old, new, said):
    with pytest.raises(hrt.ArgumentError, match=said):
        parse_experiment(TEXT.replace(old, new), source="x.toml")


def test_other_resolutions_are_timed_as_far_as_they_were_meant_to_be():
    experiment = parse_experiment(TEXT, source="x.toml")
    small, large = experiment.resolutions
    other = Resolution(width=32, height=24)
    assert experiment.overridden([large, small], None).timed == [small]
    changed = experiment.overridden([large, other], 5)
    assert (changed.timed, changed.picture, changed.rounds) == ([other], other, 5)


def test_cells_are_timed_or_counted_as_the_settings_say(cornell):
    experiment = parse_experiment(TEXT, source="x.toml")
    techniques = {name: get_technique(name) for name in experiment.techniques}
    scene = cornell.load()

    def planned(resolution, camera):
        cells = plan_cells(experiment, techniques, scene, resolution, camera)
        return [(c.entry.name, c.seed, c.timed, {p.technique for p in c.points}) for c in cells]

    small, large = experiment.resolutions
    both, one = {"paper", "hiz"}, {"paper"}
    assert planned(small, 0) == [
        ("mirror", 0, True, both), ("diffuse", 0, True, both), ("diffuse", 1, False, one),
    ]  # fmt: skip
    assert planned(small, 1)[1] == ("diffuse", 0, False, one)
    assert all(not timed and names == one for _, _, timed, names in planned(large, 0))
    grid = plan_cells(experiment, techniques, scene, small, 0)[0]
    assert len(grid.points) == sum(len(t.points(scene)) for t in techniques.values())
    assert grid.passes(2) == len(grid.points) + 2 * (len(grid.points) + 2)


@pytest.mark.parametrize("name", TECHNIQUES)
def test_every_technique_has_one_default_point_and_labels_that_differ(name, cornell):
    points = points_of(TECHNIQUES[name], cornell.load(), "all")
    assert sum(point.default for point in points) == 1
    assert len({point.label for point in points}) == len(points)
    (usual,) = points_of(TECHNIQUES[name], cornell.load(), "default")
    assert usual in points


def test_every_switch_is_one_change_of_the_default_and_none_is_measured_twice(cornell):
    points = points_of(TECHNIQUES["certified"], cornell.load(), "switches")
    base, *others = points
    assert (base.label, base.default, base.lists) == ("base", True, ListsForm())
    assert base.mode == TECHNIQUES["certified"].mode
    assert not any(point.default for point in others)
    assert len({point.label for point in points}) == len(points)
    assert len({(point.mode, point.lists) for point in points}) == len(points)
    # Left out is only what the default is already.
    left = {label for label, *_ in SWITCHES} - {point.label for point in points}
    assert len(left) <= 5
    assert f"lists {base.lists.length}" in left
    by_label = {point.label: point for point in points}
    assert by_label["no planes"].lists == ListsForm(planes=False)
    assert by_label["no planes"].mode == base.mode
    assert by_label["one ray at a time"].mode.vectors is False
    assert by_label["4x4 cells, guard x2"].lists == ListsForm(cell=4, guard=2.0)
    cheap = by_label[CHEAPEST[0]]
    assert (cheap.mode.max_tests, cheap.mode.max_steps, cheap.mode.probes) == (4, 32, 1)


def test_the_usual_runs_have_a_small_grid_of_certified(cornell):
    scene = cornell.load()
    assert len(points_of(TECHNIQUES["certified"], scene, "all")) == len(LISTS) <= 5
    assert [p.label for p in points_of(TECHNIQUES["certified"], scene, "cheapest")] == [
        "base", CHEAPEST[0],
    ]  # fmt: skip
    for name in ("paper", "slope", "hiz", "linear", "dda"):
        usual = points_of(TECHNIQUES[name], scene, "default")
        assert points_of(TECHNIQUES[name], scene, "switches") == usual
        assert points_of(TECHNIQUES[name], scene, "cheapest") == usual


def test_lists_have_the_size_that_their_form_says(cornell):
    camera = cornell.camera(next(iter(cornell.cameras)), 64, 48)
    assert ListsForm().camera(camera) == camera
    sizes = {
        ListsForm(cell=4): (16, 12), ListsForm(guard=1.5): (96, 72),
        ListsForm(cell=4, guard=2.0): (32, 24), ListsForm(cell=100): (1, 1),
    }  # fmt: skip
    for form, size in sizes.items():
        seen = form.camera(camera)
        assert (seen.width, seen.height, seen.eye) == (*size, camera.eye)
    wide = ListsForm(cell=4, guard=2.0).camera(camera)
    half = np.tan(np.radians(camera.vfov_deg) / 2)
    assert np.tan(np.radians(wide.vfov_deg) / 2) == pytest.approx(2 * half)


def test_each_form_of_the_lists_is_made_once_and_marched_through():
    sphere = get_scene("sphere")
    scene = sphere.load()
    view = View(scene, sphere.camera("front", 64, 48), 1)
    points = points_of(TECHNIQUES["certified"], scene, "switches")
    by_label = {point.label: point for point in points}
    rays = hrt.mirror_rays(view.gbuffer)
    found = {}
    for label in ("base", "no planes", "4x4 cells", "4x4 cells, guard x2", "guard x2"):
        screen = view.screen(by_label[label])
        assert view.screen(by_label[label]) is screen
        found[label] = hrt.march(rays, screen.gbuffer, screen.pyramid, by_label[label].mode)
    assert view.screen(by_label["no hand-over"]) is view.screen(by_label["base"])
    planes, none = (view.screen(by_label[label]) for label in ("base", "no planes"))
    assert planes.lists.prim_id is none.lists.prim_id
    assert np.isnan(none.lists.planes).all()
    assert not np.isnan(planes.lists.planes).all()
    assert found["no planes"].tests > found["base"].tests
    both = found["base"].resolved & found["no planes"].resolved
    assert both.any()
    assert (found["base"].prim_id[both] == found["no planes"].prim_id[both]).all()
    coarse, guarded = (view.screen(by_label[f"4x4 cells{g}"]) for g in ("", ", guard x2"))
    assert coarse.lists.rest.shape == (12, 16)
    assert guarded.lists.rest.shape == (24, 32)
    assert coarse.nbytes < guarded.nbytes < planes.nbytes
    offscreen = {
        label: np.count_nonzero(marched.status == hrt.MarchStatus.OFFSCREEN)
        for label, marched in found.items()
    }
    assert offscreen["guard x2"] < offscreen["base"]


def test_only_complete_cells_have_all_techniques_and_embrees_modes(cornell):
    text = TEXT.replace('timed = ["64x48"]', 'timed = ["64x48", "128x96"]\ncomplete = ["64x48"]')
    experiment = parse_experiment(text, source="x.toml")
    techniques = {name: get_technique(name) for name in experiment.techniques}
    small, large = (
        plan_cells(experiment, techniques, cornell.load(), resolution, 0)[0]
        for resolution in experiment.resolutions
    )
    assert (small.timed, small.rivals, large.timed, large.rivals) == (True, True, True, False)
    assert {point.technique for point in small.points} == {"paper", "hiz"}
    assert {point.technique for point in large.points} == {"paper"}
    assert len(large.points) == 4  # of the whole grid
    assert large.passes(2) == 4 + 2 * 4
    other = Resolution(width=32, height=24)
    only_large = experiment.overridden([experiment.resolutions[1]], None)
    assert only_large.complete == only_large.timed == [experiment.resolutions[1]]
    assert experiment.overridden([other], None).complete == [other]
    assert parse_experiment(TEXT, source="x.toml").overridden([other], None).complete is None


def test_a_cell_without_rivals_times_its_points_alone(cornell):
    loaded = prepare(cornell.load(), 1)
    view = View(loaded.scene, cornell.camera(next(iter(cornell.cameras)), 64, 48), 1)
    points = points_of(TECHNIQUES["certified"], loaded.scene, "cheapest")
    rays = hrt.mirror_rays(view.gbuffer)
    cell = error_cell.Cell(NearestHit(), rays, points, 2, False, 1024, rivals=False)
    record = error_cell.measure_cell(loaded, view, cell)
    assert [row["point"] for row in record.results] == [point.label for point in points]
    assert len(record.samples) == 2 * len(points)
    assert all(row["speedup"] > 0 and row["prepare_mib"] > 0 for row in record.results)


@pytest.mark.parametrize("workload", ["mirror", "shadow_point"])
def test_counts_of_a_cell_agree_with_its_verdicts(measured, workload):
    record = measured[workload]
    for row in record.results:
        if row["technique"] == "embree":
            assert row["resolved"] == row["rays"] == record.details["rays"]
            continue
        mine = [v for v in record.verdicts if v["technique"] == row["technique"]]
        count = {
            name: sum(v["count"] for v in mine if v["verdict"] == name.upper())
            for name in (*VERDICTS, "correct", "unresolved")
        }
        assert sum(count.values()) == row["rays"]
        assert row["resolved"] == row["rays"] - count["unresolved"]
        assert all(row[name] == count[name] <= row[f"all_{name}"] for name in VERDICTS)
        # What the screen leaves open is traced robustly: nothing is wrong there.
        assert all(row[f"all_{name}"] == row[name] for name in ("false_hit", "false_miss"))
    names = [row["technique"] for row in record.results]
    assert names == [*TECHNIQUES, "embree", "embree"]


def test_each_point_is_timed_beside_embree_in_every_round(measured):
    for record in measured.values():
        keys = [(s["technique"], s["point"], s["round"]) for s in record.samples]
        assert len(set(keys)) == len(keys) == 2 * len(record.results)
        assert all(s["embree"] > 0 and s["hybrid"] > 0 for s in record.samples)
        row, samples = record.results[0], record.samples
        mine = [s for s in samples if s["technique"] == row["technique"]]
        ratios = [s["embree"] / s["hybrid"] for s in mine]
        assert row["speedup"] == pytest.approx(np.median(ratios))


def test_any_hit_answers_claim_no_distance(measured):
    assert all(np.isnan(row["error_t_p50"]) for row in measured["shadow_point"].results)
    paper = next(r for r in measured["mirror"].results if r["technique"] == "paper")
    assert 0 <= paper["error_t_p50"] <= paper["error_t_p99"] <= paper["error_t_max"]


def test_the_picture_shows_the_errors_that_were_counted(measured):
    record = measured["mirror"]
    for row in record.results:
        key = f"classes_{row['technique']}"
        if key in record.picture:
            classes = record.picture[key]
            for name in ("false_hit", "false_miss", "wrong_primitive"):
                shown = np.count_nonzero(classes == error_cell.MAP_CLASSES[name])
                assert shown == row[f"all_{name}"]
    assert measured["shadow_point"].picture is None


def test_an_image_is_no_distance_from_itself_and_some_from_another():
    rng = np.random.default_rng(3)
    image = rng.random((32, 48, 3), np.float32)
    assert image_error.columns(image, image) == {"flip": 0.0, "rmse": 0.0}
    other = image.copy()
    other[:16] = 1 - other[:16]
    found = image_error.columns(image, other)
    assert found["rmse"] == pytest.approx(float(np.sqrt(np.mean((image - other) ** 2.0))))
    assert 0.05 < found["flip"] < 1


def test_the_reflection_changes_with_what_is_met_and_where(cornell):
    scene = cornell.load()
    view = View(scene, cornell.camera(next(iter(cornell.cameras)), 48, 36), 1)
    rays = hrt.mirror_rays(view.gbuffer)
    hits = hrt.EmbreeTracer(scene, threads=1).intersect(rays)
    image = shade.reflection(view.gbuffer, rays, hits)
    assert (image.min() >= 0) & (image.max() <= 1)
    moved = hrt.Hits(hits.t * np.float32(0.9), hits.prim_id, hits.u, hits.v, hits.n_g)
    missed = hrt.Hits.empty(len(rays))
    met = np.zeros(image.shape[:2], bool)
    met[rays.pixel[:, 1], rays.pixel[:, 0]] = hits.prim_id >= 0
    for other in (moved, missed):
        changed = (shade.reflection(view.gbuffer, rays, other) != image).any(axis=2)
        assert (changed <= met).all()
        assert changed.sum() > 0.9 * met.sum()
