"""Experiments of kind "error": what they say, which cells they plan, how a cell is judged."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.experiments import load_experiment, parse_experiment
from hybrid_rt_bench.judged import cell as error_cell
from hybrid_rt_bench.judged import image_error
from hybrid_rt_bench.judged.columns import MAP_CLASSES, VERDICTS
from hybrid_rt_bench.judged.run import plan_cells
from hybrid_rt_bench.kinds.error.spec import ErrorExperiment
from hybrid_rt_bench.measure import shade
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.measure.loaded import prepare
from hybrid_rt_bench.measure.queries import AnyHit, NearestHit
from hybrid_rt_bench.measure.screens import Screens, points_of
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


TECHNIQUES = ("linear", "dda", "hiz", "paper", "slope", "certified")


def screens_of(scene, camera):
    return Screens(hrt.rasterize(scene, camera, threads=1), 1)


@pytest.fixture(scope="module")
def cornell():
    return get_scene("cornell")


@pytest.fixture(scope="module")
def measured(cornell):
    """Measure the mirror and the shadow rays of a small view, all techniques' default points."""
    loaded = prepare(cornell.load(), 1)
    screens = screens_of(loaded.scene, cornell.camera(next(iter(cornell.cameras)), 64, 48))
    points = [point for name in TECHNIQUES for point in points_of(hrt.TECHNIQUES[name], "default")]
    found = {}
    for name, query in (("mirror", NearestHit()), ("shadow_point", AnyHit())):
        rays = get_workload(name).make(cornell, screens.gbuffer, 0)
        cell = error_cell.Cell(query, rays, points, 2, name == "mirror", 1024)
        found[name] = error_cell.measure_cell(loaded, screens, cell)
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


def test_cells_are_timed_or_counted_as_the_settings_say():
    experiment = parse_experiment(TEXT, source="x.toml")
    techniques = {name: hrt.TECHNIQUES[name] for name in experiment.techniques}

    def planned(resolution, camera):
        cells = plan_cells(experiment, techniques, resolution, camera)
        return [(c.entry.name, c.seed, c.timed, {p.name for p in c.points}) for c in cells]

    small, large = experiment.resolutions
    both, one = {"paper", "hiz"}, {"paper"}
    assert planned(small, 0) == [
        ("mirror", 0, True, both), ("diffuse", 0, True, both), ("diffuse", 1, False, one),
    ]  # fmt: skip
    assert planned(small, 1)[1] == ("diffuse", 0, False, one)
    assert all(not timed and names == one for _, _, timed, names in planned(large, 0))
    grid = plan_cells(experiment, techniques, small, 0)[0]
    assert len(grid.points) == sum(len(t.points()) for t in techniques.values())
    assert grid.passes(2) == len(grid.points) + 2 * (len(grid.points) + 2)


def test_only_complete_cells_have_all_techniques_and_embrees_modes():
    text = TEXT.replace('timed = ["64x48"]', 'timed = ["64x48", "128x96"]\ncomplete = ["64x48"]')
    experiment = parse_experiment(text, source="x.toml")
    techniques = {name: hrt.TECHNIQUES[name] for name in experiment.techniques}
    small, large = (
        plan_cells(experiment, techniques, resolution, 0)[0]
        for resolution in experiment.resolutions
    )
    assert (small.timed, small.rivals, large.timed, large.rivals) == (True, True, True, False)
    assert {point.name for point in small.points} == {"paper", "hiz"}
    assert {point.name for point in large.points} == {"paper"}
    assert len(large.points) == 4  # of the whole grid
    assert large.passes(2) == 4 + 2 * 4
    other = Resolution(width=32, height=24)
    only_large = experiment.overridden([experiment.resolutions[1]], None)
    assert only_large.complete == only_large.timed == [experiment.resolutions[1]]
    assert experiment.overridden([other], None).complete == [other]
    assert parse_experiment(TEXT, source="x.toml").overridden([other], None).complete is None


def test_a_cell_without_rivals_times_its_points_alone(cornell):
    loaded = prepare(cornell.load(), 1)
    screens = screens_of(loaded.scene, cornell.camera(next(iter(cornell.cameras)), 64, 48))
    points = points_of(hrt.Certified, "cheapest")
    rays = hrt.mirror_rays(screens.gbuffer)
    cell = error_cell.Cell(NearestHit(), rays, points, 2, False, 1024, rivals=False)
    record = error_cell.measure_cell(loaded, screens, cell)
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
                shown = np.count_nonzero(classes == MAP_CLASSES[name])
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
    gbuffer = hrt.rasterize(scene, cornell.camera(next(iter(cornell.cameras)), 48, 36))
    rays = hrt.mirror_rays(gbuffer)
    hits = hrt.EmbreeTracer(scene, threads=1).intersect(rays)
    image = shade.reflection(gbuffer, rays, hits)
    assert (image.min() >= 0) & (image.max() <= 1)
    moved = hrt.Hits(hits.t * np.float32(0.9), hits.prim_id, hits.u, hits.v, hits.n_g)
    missed = hrt.Hits.empty(len(rays))
    met = np.zeros(image.shape[:2], bool)
    met[rays.pixel[:, 1], rays.pixel[:, 0]] = hits.prim_id >= 0
    for other in (moved, missed):
        changed = (shade.reflection(gbuffer, rays, other) != image).any(axis=2)
        assert (changed <= met).all()
        assert changed.sum() > 0.9 * met.sum()
