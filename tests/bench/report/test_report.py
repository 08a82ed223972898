"""Results, tables, figures and comparison, on a run made of synthetic rows."""

import errno
import json
import os

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.experiments import load_experiment
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.paper.columns import SCHEMA
from hybrid_rt_bench.kinds.paper.tables import tables as all_tables
from hybrid_rt_bench.report.table import Table, number
from hybrid_rt_bench.results import files
from hybrid_rt_bench.results import folder as results
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.files import ReportsError
from hybrid_rt_bench.results.schema import HYBRID_STAGES
from hybrid_rt_bench.runs import read_run, render_run
from support.bench_rows import ENVIRONMENT, whole

ALPHA, ROUNDS = 0.4, 5
MILLISECONDS = {
    "raster": 8, "pyramid": 2, "rays": 5, "embree_primary": 10, "embree": 100, "march": 20,
    "compaction": 3, "fallback": 55, "merge": 2,
}  # fmt: skip
RATES = ("wrong", "tie", "false_hit", "false_miss", "wrong_primitive", "reference_wrong")


def write_run(out, slower=1.0, cameras=("left", "right"), finish=True, builtin=False):
    """Write a run of known figures: round r takes 1 + r / 100 times as long as round 0."""
    writer = results.create_run(
        out,
        "paper",
        SCHEMA,
        {
            "command": [],
            "spec": load_experiment("paper").model_dump(mode="json", by_alias=True),
            "notes": ["a note"],
            "warnings": [],
            "scenes": [
                {"name": "atrium", "row": "Sponza", "builtin": builtin, "triangles": 262144},
            ],
        },
    )
    writer.meta["environment"] = ENVIRONMENT
    for camera in cameras:
        for width, height in ((640, 360), (1280, 720)):
            pixels = width * height / (640 * 360)
            timed = {
                stage: np.array([slower * pixels * ms * (1 + r / 100) / 1e3 for r in range(ROUNDS)])
                for stage, ms in MILLISECONDS.items()
            }
            samples = [
                {
                    "technique": "paper" if stage in HYBRID_STAGES else "",
                    "stage": stage,
                    "round": r,
                    "seconds": seconds,
                    "phase": phase,
                }
                for stage, values in timed.items()
                for r, seconds, phase in [
                    (-1, 1e3, "warmup"),
                    *((r, s, "measured") for r, s in enumerate(values)),
                ]
            ]
            row = {
                "technique": "paper",
                "rays": 1000,
                "resolved": 400,
                "alpha": ALPHA,
                "steps_per_ray": 20.0,
                **summary.timing_columns(timed, ALPHA),
                "embree_path": "packet 8, robust",
                "embree_primary_path": "packet 16, robust, coherent",
                "error_px_p50": 0.2,
                "error_px_p99": 2.0,
            }
            for name in (*RATES, "pixel_error"):
                zero = name == "false_miss"
                count, rate, low, high = (0, 0.0, 0.0, 0.0075) if zero else (4, 0.01, 0.003, 0.03)
                row |= {f"{name}_count": count, f"{name}_rate": rate}
                row |= {f"{name}_low": low, f"{name}_high": high}
            verdicts = [
                {"technique": "paper", "status": "HIT", "verdict": "CORRECT", "count": 396},
                {"technique": "paper", "status": "HIT", "verdict": "FALSE_HIT", "count": 4},
                {"technique": "paper", "status": "HIDDEN", "verdict": "UNRESOLVED", "count": 600},
            ]
            picture = None
            if width == 640:
                classes = (np.arange(360 * 640) % 4).reshape(360, 640).astype(np.uint8)
                picture = {
                    "shaded": np.full((360, 640, 3), 128, np.uint8),
                    "grey_paper": np.full((360, 640), 99, np.uint8),
                    "classes_paper": classes,
                }
            cell = {"scene": "atrium", "camera": camera, "width": width, "height": height}
            writer.add_cell(cell, samples, [whole(SCHEMA, "results", row)], verdicts, picture)
    if finish:
        writer.finish()
    return writer.folder


@pytest.fixture
def run(tmp_path):
    return read_run(write_run(tmp_path))


def cells_of(table, first):
    return next(row[1:] for row in table.rows if row[0] == first)


def test_a_written_run_is_read_again(run):
    assert run.meta["schema_version"] == results.SCHEMA_VERSION
    assert run.meta["finished"]
    assert len(run.results) == 4
    assert len(run.samples) == 4 * len(MILLISECONDS) * (ROUNDS + 1)
    assert (run.samples.phase == "warmup").sum() == 4 * len(MILLISECONDS)
    assert (run.folder / "results.csv").read_text().startswith("scene,camera,width,height,")


def test_a_run_without_end_is_readable_cell_by_cell(tmp_path):
    run = read_run(write_run(tmp_path, finish=False))
    assert not run.meta["finished"]
    assert len(run.results) == 4


def test_medians_leave_the_warm_up_out(run):
    row = run.results.iloc[0]
    assert row.march_ms == pytest.approx(20 * 1.02)
    assert row.hybrid_ms == pytest.approx(80 * 1.02)
    assert (row.march_ms_low, row.march_ms_high) == pytest.approx((20, 20.8))


def test_table_3_is_the_formula_of_the_paper_and_the_measured_ratio(run):
    table = next(t for t in all_tables(run) if t.title.startswith("Table 3"))
    estimated = 100 / (20 + 0.6 * 100)
    for label, value in (
        ("estimated, alpha as measured", estimated),
        ("estimated, the paper's alpha", 100 / (20 + 0.69 * 100)),
        ("measured", 100 / 80),
        ("measured, with the pyramid", 100 / 82),
    ):
        shown = number(value)
        assert cells_of(table, label) == [f"{shown} [{shown}, {shown}]"] * 2


def test_the_formula_gives_the_papers_own_numbers():
    samples = {"embree": np.array([2.76]), "march": np.array([0.212])}
    assert summary.estimated_speedup(samples, 0.31)[0] == pytest.approx(1.304, abs=5e-4)


def test_ours_stand_beside_the_papers(run):
    tables = {t.title[:7]: t for t in all_tables(run)}
    sponza = "the paper's Sponza, about 2^18 triangles"
    assert cells_of(tables["Table 1"], "the paper's, its own scenes") == ["–", "0.212"]
    assert cells_of(tables["Table 2"], sponza) == ["–", "2.76"]
    assert cells_of(tables["Table 3"], f"{sponza}, estimated, alpha 0.31") == ["–", "1.304"]


def test_a_stand_in_has_no_row_of_the_paper_beside_it(tmp_path):
    run = read_run(write_run(tmp_path, builtin=True))
    quoted = [row for t in all_tables(run) for row in t.rows if row[0].startswith("the paper's")]
    assert not quoted


def test_no_false_miss_is_shown_as_zero_with_its_bound(run):
    table = next(t for t in all_tables(run) if t.title.startswith("Errors"))
    column = table.columns.index("false miss, % of resolved rays")
    row = next(row for row in table.rows if row[0] == "left, 1280x720")
    assert row[column] == "0 [at most 0.75]"


def test_report_writes_tables_and_every_figure_and_nothing_else(run):
    before = {p: p.read_bytes() for p in run.folder.iterdir() if p.is_file()}
    tables, written = render_run(run)
    text = (run.folder / "tables.md").read_text()
    assert all(f"### {table.title}" in text for table in tables)
    names = {p.name for p in written}
    assert {"speedup-by-scene.png", "alpha-by-camera.png", "time-over-resolution.png"} <= names
    assert {"paper-atrium-left.png", "paper-atrium-right.png"} <= names
    assert all(p.stat().st_size > 1000 for p in written)
    assert all(p.read_bytes() == content for p, content in before.items())


def test_interrupted_run_says_so_in_its_tables(tmp_path):
    run = read_run(write_run(tmp_path, finish=False))
    render_run(run)
    assert "not finished" in (run.folder / "tables.md").read_text()


def test_unknown_run_is_answered_with_the_nearest(run):
    name = run.name[:-1] + "X"
    with pytest.raises(hrt.UnknownNameError, match=f"did you mean '{run.name}'"):
        read_run(name, run.folder.parent)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "not a readable run"),
        ("{}", "not a readable run"),
        (json.dumps({"schema_version": 99}), "schema version 99"),
        (json.dumps({"schema_version": results.SCHEMA_VERSION}), "no list of 'cells'"),
        (json.dumps({"schema_version": results.SCHEMA_VERSION, "cells": []}), "no cell was"),
        ("[]", "no object"),
    ],
)
def test_damaged_run_is_refused(tmp_path, content, said):
    (tmp_path / "run.json").write_text(content)
    with pytest.raises(ReportsError, match=said):
        read_run(tmp_path)


def test_full_disk_leaves_the_last_whole_file(tmp_path, monkeypatch):
    path = tmp_path / "x"
    files.write_bytes(path, b"whole")

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(ReportsError, match=r"x: cannot be written \(No space left"):
        files.write_bytes(path, b"broken")
    assert path.read_bytes() == b"whole"
    assert [p.name for p in tmp_path.iterdir()] == ["x"]


def test_two_runs_of_one_second_get_two_folders(tmp_path):
    folders = {results.create_run(tmp_path, "paper", SCHEMA, {}).folder for _ in range(3)}
    assert len(folders) == 3


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (1.2345, "1.23"), (123.45, "123"), (12345.0, "12300"), (0.00012345, "0.000123"),
        (0.9996, "1.000"), (float("nan"), "–"),
    ],
)  # fmt: skip
def test_numbers_have_three_digits_and_no_exponent(value, text):
    assert number(value) == text


def test_markdown_table_has_as_many_cells_in_every_row():
    table = Table("T", ["a", "b|c"], [["heading"], ["1", "2"]], ["a note"])
    lines = [line for line in table.markdown().splitlines() if line.startswith("|")]
    assert len({line.replace("\\|", "").count("|") for line in lines}) == 1


def test_a_heading_is_broken_where_its_column_is_narrower():
    table = Table("T", ["", "speed-up, measured", "a"], [["heading"], ["name", "1 [1, 1]", "2"]])
    headings = [str(column.header) for column in table.rich().columns]
    assert headings == ["", "speed-up,\nmeasured", "a"]
    assert table.markdown().count("speed-up, measured") == 1


def test_stats_of_a_report_do_not_depend_on_order():
    groups = [[1.0, 2.0, 3.0], [3.0, 2.0, 1.0]]
    assert stats.geometric_mean_of_medians(groups).value == pytest.approx(2.0)
