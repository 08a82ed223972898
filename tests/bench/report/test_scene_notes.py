"""What is to be said of a scene is said wherever it is reported, for any scene that has a note."""

import dataclasses
from pathlib import Path

import pandas as pd
import pytest

import docs_results
from hybrid_rt_bench.measure.lifecycle import described
from hybrid_rt_bench.report.scenes import scene_name, scene_notes, with_scene_notes
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_scenes import get_scene, scene_names
from support import made_runs

NOTE = "Scene hall (half): the roof is absent."


@pytest.fixture
def run():
    hall = {"name": "hall", "mark": "half", "note": "the roof is absent"}
    scenes = [hall, {"name": "yard", "mark": "", "note": ""}, {"name": "halls"}]
    return RunData(Path(), {"scenes": scenes}, *[pd.DataFrame()] * 3)


def test_a_mark_stands_behind_the_name(run):
    assert [scene_name(run, name) for name in ("hall", "yard", "halls", "unknown")] == [
        "hall (half)", "yard", "halls", "unknown",
    ]  # fmt: skip


def test_notes_are_of_the_scenes_asked_for(run):
    assert scene_notes(run) == [NOTE]
    assert scene_notes(run, ["yard", "hall", "hall"]) == [NOTE]
    assert scene_notes(run, ["yard"]) == []
    no_scenes = dataclasses.replace(run, meta={})
    assert scene_notes(no_scenes) == []


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (Table("T", [""], [["hall (half)"], ["x", "1"]]), True),
        (Table("Times in hall", [""], [["x", "1"]]), True),
        (Table("T", [""], [["x", "1"]], ["2 cells: hall, yard."]), True),
        (Table("T", [""], [["yard"], ["x", "1"]]), False),
        (Table("T", [""], [["halls"], ["x", "1"]]), False),
        (Table("All scenes together", [""], [["x", "1"]]), True),
    ],
)
def test_a_table_that_shows_the_scene_has_its_note(run, table, said):
    for _ in range(2):  # said once, however often the table is made ready
        (noted,) = with_scene_notes(run, [table])
    assert noted.notes.count(NOTE) == said


@pytest.mark.parametrize("name", scene_names())
def test_a_run_keeps_what_a_definition_says(name):
    spec = get_scene(name)
    kept = described(spec, name)
    assert (kept["mark"], kept["note"]) == (spec.mark, spec.note)
    assert bool(spec.mark) == (name in ("bistro", "nori_sphere"))


def test_bistro_says_what_part_of_the_model_it_is():
    spec = get_scene("bistro")
    assert spec.mark == "partial"
    for fact in ("1,434,817", "157,181", "ivy"):
        assert fact in spec.note


def test_findings_say_what_part_of_a_model_a_scene_is(tmp_path):
    layout = made_runs.LAYOUTS["one scene, two techniques"]
    made = made_runs.judged_run(tmp_path, layout, kind="hybrid")
    run = dataclasses.replace(made, results=made.results.assign(speedup=0.5))
    scenes = [{**entry, "mark": "half", "note": "no roof"} for entry in run.meta["scenes"]]
    marked = dataclasses.replace(run, meta={**run.meta, "scenes": scenes})
    assert "hall (half)" in docs_results.findings({"hybrid": marked}, "")
    assert "(half)" not in docs_results.findings({"hybrid": run}, "")
