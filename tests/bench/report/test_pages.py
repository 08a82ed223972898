"""Documents of every kind, over long names, many techniques, and much that is missing."""

import dataclasses
import functools
import re

import pandas as pd
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.frame import columns as frame
from hybrid_rt_bench.registry import kinds
from hybrid_rt_bench.report.markdown import document
from hybrid_rt_bench.report.page import PAGE, paragraph, table_text
from hybrid_rt_bench.report.scenes import with_scene_notes
from hybrid_rt_bench.report.verdict import paragraph as verdict_paragraph
from hybrid_rt_bench.results import folder as results
from hybrid_rt_bench.runs import read_run
from support import made_runs
from support.bench_rows import whole

MANY = dataclasses.replace(
    made_runs.LAYOUTS["many scenes, many techniques"],
    cameras=("a camera with a long name",),
    sizes=((3840, 2160),),
)
LAYOUTS = {
    name: made_runs.LAYOUTS[name]
    for name in ("one scene, one technique", "one scene, two techniques",
                 "two scenes, one technique", "two scenes, three techniques")
} | {"many scenes, many techniques": MANY}  # fmt: skip
JUDGED = ("error", "ablation", "hybrid", "lists")


def frame_run(out, layout):
    """Return a run of kind "frame": two kinds of rays of a depth buffer, with its mesh."""
    about = {"file": "depth.npz", "dtype": "float32", "reading": {"kind": "reversed"},
             "covered": 0.9, "mesh": "hall.glb", "unmatched": 7, "uncertain": False,
             "uncertainty": 0.0}  # fmt: skip
    meta = {
        "kind": "frame", "command": [], "notes": [], "warnings": [], "frame": about,
        "environment": made_runs.MACHINE, "spec": {"title": "Made up"},
        "scenes": [{"name": layout.scenes[0], "triangles": 10, **made_runs.ENTRIES}],
    }  # fmt: skip
    writer = results.create_run(out, "frame", frame.SCHEMA, meta)
    for workload in ("mirror", "ambient_occlusion"):
        rows = [
            whole(frame.SCHEMA, "results", {
                "technique": name, "judged": True, "rays": 1000, "resolved": 400 + k, "hits": 300,
                "alpha": 0.4 + k / 1000, "false_hit": k, "steps": 9000.0,
            })
            for k, name in enumerate(layout.techniques)
        ]  # fmt: skip
        verdicts = [
            {"technique": name, "status": "HIT", "verdict": "CORRECT", "count": 1000}
            for name in layout.techniques
        ]
        cell = {"scene": layout.scenes[0], "camera": "own", "width": 640, "height": 360}
        writer.add_cell({**cell, "workload": workload}, [], rows, verdicts)
    writer.finish()
    writer.__exit__(None, None, None)
    return read_run(writer.folder)


MADE = {
    "frame": frame_run,
    "paper": made_runs.paper_run,
    **{kind: functools.partial(made_runs.judged_run, kind=kind) for kind in JUDGED},
    "peers": made_runs.peers_run,
    "roofline": made_runs.roofline_run,
    "scaling": made_runs.scaling_run,
    "stability": made_runs.stability_run,
}
OLD_WORDS = re.compile(
    r"\b(?:ns|ms|steps|times?|tests|MiB|numbers|vectors|work,) a (?:ray|view|step|number)\b"
    r"|\bmay (?:cost|take)\b|\bnumbers gathered\b|\bthe rest\b|\bleaves? open\b|\bmodes?\b"
)


def test_every_kind_is_made_up_here():
    assert set(MADE) == set(kinds)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Return a function that makes a run of a kind and layout, once."""

    @functools.cache
    def make(kind, layout, **more):
        run = MADE[kind](tmp_path_factory.mktemp("runs"), LAYOUTS[layout], **more)
        if kind == "roofline":  # the made-up rates are those that figures show
            run.meta["rates"] = [{"ns_vector": 1.0, **rate} for rate in run.meta["rates"]]
            gathers = [rate for rate in run.meta["rates"] if rate["kind"] == "gather"]
            run.meta["rates"] += [{**rate, "kind": "load"} for rate in gathers]
        return run

    return make


def rendered_width(line):
    """Return the signs of a row of Markdown as they are shown, a broken cell by its widest line."""
    cells = re.split(r"(?<!\\)\|", line)[1:-1]
    shown = [max(len(part) for part in cell.strip().split("<br>")) for cell in cells]
    return sum(shown) + 3 * len(shown) + 1


def every_case():
    few = (
        "one scene, one technique",
        "two scenes, three techniques",
        "many scenes, many techniques",
    )
    return [(kind, layout) for kind in sorted(MADE) for layout in few]


@pytest.mark.parametrize(("kind", "layout"), every_case())
def test_no_table_is_wider_than_a_page_and_nothing_is_cut(runs, kind, layout):
    run = runs(kind, layout)
    tables = with_scene_notes(run, kinds[kind].table_maker()(run))
    text = document(run, tables, verdict_paragraph(run, kinds[kind].verdict_maker()))
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert rows
    for line in rows:
        assert rendered_width(line) <= PAGE, line
    for line in text.splitlines():
        assert line.startswith(("|", "#")) or len(line) <= PAGE, line
    flat = " ".join(text.replace("<br>", " ").split()).lower()
    for table in tables:
        for cell in (cell for row in [table.columns, *table.rows] for cell in row):
            assert " ".join(cell.lower().split()) in flat, (table.title, cell)


@pytest.mark.parametrize(("kind", "layout"), every_case())
def test_a_verdict_is_a_paragraph_with_numbers_and_no_gaps(runs, kind, layout):
    run = runs(kind, layout)
    said = verdict_paragraph(run, kinds[kind].verdict_maker())
    assert "\n" not in said
    assert said.endswith(".")
    assert re.search(r"\d", said)
    assert not re.search(r"\bnan\b|\binf\b|None|\(\)|  |\.\.| ,|–", said), said
    assert not OLD_WORDS.search(said), said
    assert len(said) < 2500


@pytest.mark.parametrize("kind", ["paper", *JUDGED])
def test_a_verdict_of_rays_that_nothing_resolves_is_no_crash(runs, kind):
    run = runs(kind, "one scene, two techniques", zeros=True)
    silent = run.results.assign(resolved=0, alpha=0.0)
    said = verdict_paragraph(dataclasses.replace(run, results=silent), kinds[kind].verdict_maker())
    assert not re.search(r"\bnan\b|\binf\b|None|–", said), said
    assert kinds[kind].table_maker()(dataclasses.replace(run, results=silent))


@pytest.mark.parametrize("kind", JUDGED)
def test_a_verdict_of_what_was_only_counted_says_so(runs, kind):
    run = runs(kind, "one scene, two techniques", timed=False)
    assert "was timed" in verdict_paragraph(run, kinds[kind].verdict_maker())
    assert kinds[kind].table_maker()(run)


@pytest.mark.parametrize("kind", sorted(MADE))
def test_a_verdict_tells_of_failed_cells_scenes_in_part_and_an_early_end(runs, kind):
    run = runs(kind, "two scenes, one technique")
    scenes = [{**entry, "mark": "half", "note": "no roof"} for entry in run.meta["scenes"][:1]]
    lost = [*run.meta["cells"], {"scene": "hall", "state": "failed", "error": "x"}]
    meta = {**run.meta, "scenes": scenes + run.meta["scenes"][1:], "cells": lost, "finished": False}
    said = verdict_paragraph(dataclasses.replace(run, meta=meta), kinds[kind].verdict_maker())
    assert f"1 of {len(lost)} cells failed" in said
    assert "did not finish" in said
    assert said.endswith("Scene hall (half): no roof.")


@pytest.mark.parametrize(
    "kind", ["paper", "error", "ablation", "peers", "scaling", "stability", "frame"]
)
def test_a_table_that_names_a_technique_names_them_all(runs, kind):
    layout = "two scenes, three techniques"
    run = runs(kind, layout)
    names = LAYOUTS[layout].techniques
    for table in kinds[kind].table_maker()(run):
        text = " ".join(" ".join(row) for row in [table.columns, *table.rows])
        named = [name for name in names if re.search(rf"(?<![\w-]){name}(?![\w-])", text)]
        assert named in ([], list(names)) or set(named) == set(names), (table.title, named)


def test_what_a_technique_lacks_is_said_where_others_have_it(runs):
    run = runs("error", "two scenes, three techniques")
    tables = {table.title: table for table in kinds["error"].table_maker()(run)}
    pay = tables["When does it pay"].rows
    diffuse = pay[pay.index(["diffuse rays"]) + 1 :]
    assert ["mine", *["not measured"] * 6] in diffuse
    cameras = tables["Alpha, camera by camera"]
    lacking = next(row for row in cameras.rows if "not measured" in row)
    assert lacking[cameras.columns.index("mine")] == "not measured"


def test_rows_are_pooled_over_the_cells_that_all_have(runs):
    run = runs("error", "two scenes, three techniques")
    from hybrid_rt_bench.judged.tables import shared

    rows = shared(run)
    cells = rows.groupby(["technique", "point"]).size()
    assert cells.nunique() == 1
    lost = made_runs.LAYOUTS["two scenes, three techniques"]
    assert not ((rows.scene == lost.scenes[-1]) & (rows.camera == lost.cameras[0])).any()


@pytest.mark.parametrize("kind", sorted(MADE))
def test_the_words_of_tables_are_those_of_the_glossary(runs, kind):
    run = runs(kind, "two scenes, three techniques")
    for table in kinds[kind].table_maker()(run):
        for text in (table.title, *table.columns, *table.notes):
            assert not OLD_WORDS.search(text), text
        for column in table.columns:
            if column.startswith("wrong") and column != "wrong primitive":  # a number of rays
                assert re.search(r"% of|resolved rays|goes wrong", column), column


@pytest.mark.parametrize("kind", sorted(MADE))
def test_every_column_has_a_meaning_a_unit_and_a_direction_that_agree(kind):
    units = {"_ms": "ms", "_ns": "ns", "seconds": "s", "_mib": "MiB", "_bytes": "bytes"}
    for table, columns in kinds[kind].columns().tables.items():
        for column in columns.values():
            where = f"{kind}, {table}: {column.name}"
            assert column.meaning, where
            assert column.meaning[0].isupper(), where
            assert not column.meaning.endswith("."), where
            assert not OLD_WORDS.search(column.meaning), where
            for end, unit in units.items():
                if re.search(rf"{end}(?:_low|_high)?$", column.name) and column.type is float:
                    assert column.unit == unit, where
            if column.name.endswith(("_low", "_high")):
                assert column.better == "", where
            if column.name in ("alpha", "resolved", "speedup"):
                assert column.better == "higher", where


def test_a_wide_table_is_dealt_out_evenly_and_names_its_rows_again():
    columns = ["", *(f"column number {k}" for k in range(12))]
    text = table_text(columns, [["heading"], ["a row", *["1.23 [1.22, 1.24]"] * 12]])
    parts = text.strip().split("\n\n")
    assert len(parts) == 3
    assert all(part.count("a row") == 1 and part.count("**heading**") == 1 for part in parts)
    assert len({part.splitlines()[0].count("|") for part in parts}) == 1
    for part in parts:
        assert len({line.count("|") for line in part.splitlines()}) == 1
        assert len({len(line) for line in part.splitlines() if "heading" not in line}) == 1


def test_a_name_longer_than_a_page_is_broken_and_kept():
    name = "-".join(["street"] * 40)
    text = table_text(["", "x"], [[name], [name, "1"]])
    assert all(rendered_width(line) <= PAGE for line in text.splitlines() if "--" not in line)
    assert text.replace("<br>", "").count(name) == 2


def test_pipes_and_line_ends_stay_inside_their_cell():
    text = table_text(["a|b", "c"], [["x\ny", "|"]])
    assert [len(re.split(r"(?<!\\)\|", line)) for line in text.splitlines()] == [4, 4, 4]
    assert "x y" in text


def test_a_line_of_a_paragraph_never_begins_a_list_or_a_heading():
    text = paragraph("- " + " ".join(["march + compaction - merge > 1 # 12. x"] * 30), "  ")
    for line in text.splitlines()[1:]:
        assert not re.match(r"\s*(?:[-+*>#=]|\d+[.)]) ", line), line
    assert " ".join(text.split()) == "- " + " ".join(
        ["march + compaction - merge > 1 # 12. x"] * 30
    )


def test_an_unknown_status_of_no_ray_has_no_share():
    assert kinds["paper"].table_maker()  # imported
    from hybrid_rt_bench.report.table import rate_text

    assert rate_text(hrt.Rate.of(0, 0)) == "–"
    assert rate_text(hrt.Rate.of(0, 1000)) == "0 [at most 0.30]"
    assert rate_text(hrt.Rate.of(1, 1)).startswith("100 [")
    assert pd.notna(hrt.Rate.of(1, 1).value)
