"""The report of an error experiment, on a run made of known figures."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import hybrid_rt as hrt
from hybrid_rt_bench.judged import figures as pareto
from hybrid_rt_bench.judged import maps as error_maps
from hybrid_rt_bench.judged import tables as error_tables
from hybrid_rt_bench.judged.cell import _timing_columns
from hybrid_rt_bench.judged.columns import MAP_CLASSES, PREPARED, SCHEMA, VERDICTS
from hybrid_rt_bench.kinds.error.tables import tables as kind_tables
from hybrid_rt_bench.report import looks
from hybrid_rt_bench.results import folder as results
from hybrid_rt_bench.runs import compare_runs, read_run, render_run
from support.bench_rows import ENVIRONMENT

RAYS, ROUNDS = 10_000, 3
# technique, point, default, answers, false hits, false misses, seconds of the hybrid
POINTS = (
    ("thick", "thickness 1 %", True, 6000, 300, 0, 0.5),
    ("thick", "thickness 2 %", False, 8000, 900, 0, 0.4),
    ("paper", "default", True, 4000, 40, 4, 2.0),
    ("certified", "lists 8", True, 5000, 0, 0, 0.8),
)
EMBREE_SECONDS = 1.0


def result_row(technique, point, default, answers, hits, misses, *, timed=True):
    counts = {"false_hit": hits, "false_miss": misses, "wrong_primitive": hits // 2}
    counts |= {"tie": 1, "reference_wrong": 0}
    row = {
        "technique": technique, "point": point, "default": default, "rays": RAYS,
        "resolved": answers, "alpha": answers / RAYS, **counts,
        **{f"all_{name}": counts[name] for name in VERDICTS}, "steps": 20.0 * RAYS,
        "lists_mib": 8.0 if technique == "certified" else 0.0, "tests": 4.0 * RAYS,
        "prepare_ms": 3.0, "prepare_mib": 9.0, "wrong_rate": (hits + misses) / answers,
        "wrong_low": 0.0, "wrong_high": 1.0, "error_t_p50": 1e-5, "error_t_p99": 1e-3,
        "error_t_max": 0.5,
    }  # fmt: skip
    samples = []
    if timed:
        seconds = {t: s for t, p, *_, s in POINTS if p == point}[technique]
        for number in range(ROUNDS):
            slow = 1 + number / 100  # of both, so that it cancels
            stages = {"march": 0.5, "compaction": 0.1, "fallback": 0.3, "merge": 0.1}
            sample = {stage: slow * share * seconds for stage, share in stages.items()}
            sample |= {"hybrid": slow * seconds, "embree": slow * EMBREE_SECONDS}
            samples.append({"technique": technique, "point": point, "round": number, **sample})
    return {**row, **_timing_columns(row, samples)}, samples


def embree_row(mode, wrong, seconds):
    row, _ = result_row("embree", mode, mode == "robust", RAYS, wrong, 0, timed=False)
    names = {"technique": "embree", "point": mode}
    samples = [
        {**names, "round": k, "hybrid": seconds, "embree": EMBREE_SECONDS} for k in range(ROUNDS)
    ]
    row |= {"steps": np.nan} | dict.fromkeys(PREPARED, 0.0)
    return {**row, **_timing_columns(row, samples)}, samples


def write_run(out, *, scenes=("atrium", "street"), finish=True):
    meta = {
        "kind": "error", "command": [], "notes": [], "warnings": [], "scenes": [],
        "spec": {"title": "Speed against error"},
    }  # fmt: skip
    writer = results.create_run(out, "error", SCHEMA, meta)
    writer.meta["environment"] = ENVIRONMENT
    for scene in scenes:
        for workload, size in (("mirror", 64), ("diffuse", 64), ("mirror", 128)):
            timed = size == 64
            rows, samples, verdicts = [], [], []
            for *names, _ in POINTS:
                technique, point, default, answers, hits, misses = names
                if (workload == "mirror" and timed) or default:
                    row, taken = result_row(*names, timed=timed)
                    if workload == "mirror" and default and timed:
                        row |= {"flip": hits / 1e4, "rmse": hits / 1e5}
                    rows.append(row)
                    samples += taken
                    for status, verdict, count in (
                        ("HIT", "CORRECT", answers - hits - misses),
                        ("HIT", "FALSE_HIT", hits),
                        ("MISS", "FALSE_MISS", misses),
                        ("HIDDEN", "UNRESOLVED", RAYS - answers),
                    ):
                        row = {"status": status, "verdict": verdict, "count": count}
                        if count:
                            verdicts.append({"technique": technique, "point": point, **row})
            for mode, wrong, seconds in (("default", 3, 1.0), ("robust", 0, 1.1)):
                if timed:
                    row, taken = embree_row(mode, wrong, seconds)
                    rows.append(row)
                    samples += taken
            picture = None
            if workload == "mirror" and timed:
                classes = (np.arange(64 * 36) % len(MAP_CLASSES)).reshape(36, 64).astype(np.uint8)
                picture = {"grey": np.full((36, 64), 99, np.uint8)}
                picture |= {f"classes_{name}": classes for name in ("thick", "paper", "certified")}
            cell = {"scene": scene, "camera": "front", "width": size, "height": size}
            cell |= {"workload": workload, "seed": 0, "rays": RAYS, "timed": timed}
            writer.add_cell(cell, samples, rows, verdicts, picture)
    if finish:
        writer.finish()
    return writer.folder


@pytest.fixture
def run(tmp_path):
    return read_run(write_run(tmp_path))


def row_of(table, first):
    return dict(zip(table.columns, next(row for row in table.rows if row[0] == first), strict=True))


def test_main_table_pools_the_cells_that_every_point_shares(run):
    table = error_tables.table_main(run)
    names = [row[0] for row in table.rows]
    assert names == [
        "thick, thickness 1 % (default)", "thick, thickness 2 %", "paper, default",
        "certified, lists 8 (default)", "embree, default", "embree, robust",
    ]  # fmt: skip
    paper = row_of(table, "paper, default")
    assert paper["alpha"] == "0.400"
    assert paper["wrong, % of resolved rays"].startswith("1.10 [")  # 88 of 8000
    assert paper["wrong, % of all rays"].startswith("0.440 [")  # 88 of 20000
    assert paper["steps per ray"] == "20.0"
    assert paper["march, Mrays/s"] == "0.00990"  # 20000 rays in 2 x 1.01 s
    assert paper["speed-up, measured"] == "0.500 [0.500, 0.500]"
    assert "2 cells: atrium, street; mirror rays; 64x64" in table.notes[0]


def test_zero_is_shown_as_zero_with_its_upper_bound(run):
    certified = row_of(error_tables.table_main(run), "certified, lists 8 (default)")
    assert certified["wrong, % of resolved rays"] == "0 [at most 0.030]"  # 3 of 10000
    assert certified["wrong, % of all rays"] == "0 [at most 0.015]"  # 3 of 20000
    assert row_of(error_tables.table_main(run), "embree, robust")["alpha"] == "1.000"


def test_counts_are_of_every_cell_timed_or_counted(run):
    table = error_tables.table_counts(run)
    certified, paper = (row_of(table, name) for name in ("certified", "paper"))
    assert (certified["rays"], certified["resolved rays"]) == ("60,000", "30,000")
    assert [certified[c] for c in ("false hit", "false miss", "wrong primitive")] == ["0"] * 3
    assert table.rows[-1][-2:] == [
        "0 [at most 1.0e-04]", "0 [at most 5.0e-05]",  # 3 / 30000, 3 / 60000
    ]  # fmt: skip
    assert paper["false hit"] == "240"
    assert [row[0] for row in table.rows] == ["thick", "paper", "certified"]


def test_list_lengths_stand_beside_each_other(run):
    assert error_tables.table_lists(run) == []  # one length alone says nothing
    rows = run.results
    long = rows[rows["technique"] == "certified"].assign(point="lists 16", alpha=0.75)
    both = dataclasses.replace(run, results=pd.concat([rows, long], ignore_index=True))
    (table,) = error_tables.table_lists(both)
    assert [row[0] for row in table.rows if len(row) == 1] == ["atrium", "street"]
    short, long = (row_of(table, f"certified, lists {k}") for k in (8, 16))
    alpha = "alpha, mean of cameras"
    assert (short[alpha], long[alpha]) == ("0.500", "0.750")
    assert (short["exact tests per ray"], short["lists, MiB per view"]) == ("4.00", "8.00")


def test_alpha_of_every_camera_at_its_largest_size(run):
    table = error_tables.table_cameras(run)
    assert table.columns == ["", "thick", "paper", "certified"]
    assert table.rows[:3] == [
        ["atrium"], ["front", "0.600", "0.400", "0.500"],
        ["mean", "0.600", "0.400", "0.500"],
    ]  # fmt: skip


def test_it_pays_where_the_interval_lies_above_one(run):
    table = error_tables.table_workloads(run)
    by_name = [row for row in table.rows if len(row) > 1]
    pays = table.columns.index("pays")
    assert {(row[0], row[pays]) for row in by_name} == {
        ("thick", "yes"), ("paper", "no"), ("certified", "yes"),
    }  # fmt: skip
    assert [row[0] for row in table.rows if len(row) == 1] == ["mirror rays", "diffuse rays"]


def test_every_ending_has_its_share_and_its_errors(run):
    table = error_tables.table_status(run)
    rows = {row[0]: row[1:] for row in table.rows[-2:]}
    assert rows["hit"] == ["50.0", "100", "0 [at most 0.030]"]
    assert rows["hidden"] == ["50.0", "0", "–"]


def test_report_writes_every_figure_from_the_files_alone(run):
    before = {p: p.read_bytes() for p in run.folder.iterdir() if p.is_file()}
    tables, written = render_run(run)
    text = (run.folder / "tables.md").read_text()
    assert all(f"### {table.title}" in text for table in tables)
    names = {p.name for p in written}
    for name in ("speed-against-error", "march-rate-against-error", "speed-against-error-by-scene",
                 "alpha-by-workload", "speedup-by-workload", "errors-atrium-front"):  # fmt: skip
        assert {f"{name}.png", f"{name}.svg"} <= names
    maps = sorted(p.name for p in (run.folder / "figures" / "maps" / "street-front").iterdir())
    assert maps == ["certified.png", "paper.png", "thick.png"]
    assert all(p.read_bytes() == content for p, content in before.items())


def test_an_unfinished_run_is_shown_as_far_as_it_went(tmp_path):
    run = read_run(write_run(tmp_path, scenes=("atrium",), finish=False))
    tables = kind_tables(run)
    assert len(tables) == 8
    assert all(table.rows for table in tables)


def test_zero_has_a_place_of_its_own_on_the_axis(run):
    figure = pareto.speed_against_error(run)
    ax = figure.axes[0]
    assert ax.get_xscale() == "symlog"
    left, right = ax.get_xlim()
    assert left < 0 < right
    assert ax.get_xticklabels()[0].get_text() == "none\nseen"
    named = [text.get_text() for text in ax.texts]
    assert any(name.startswith("certified\n0 of 20 k (< 1.5e-02 %)") for name in named)
    places = ax.transData.transform([(0, 1), (0.1, 1), (1, 1), (10, 1)])
    assert (np.diff(places[:, 0]) > 20).all()


def test_a_run_without_any_error_is_drawn(tmp_path):
    rate = hrt.Rate.of(0, 1000)
    dots = [pareto.Dot("certified", "lists 8", True, rate, 1.2, 1.1, 1.3)]
    figure = Figure()
    pareto._draw(figure.add_subplot(), dots, ["certified"], break_even=True)
    figure.savefig(tmp_path / "x.png")
    assert (tmp_path / "x.png").stat().st_size > 1000


def test_map_colours_errors_and_keeps_them_when_reduced():
    grey = np.full((4, 2 * error_maps.PANEL), 100, np.uint8)
    classes = np.full(grey.shape, MAP_CLASSES["right"], np.uint8)
    classes[3, 5] = MAP_CLASSES["false_hit"]
    classes[0, 0:2] = MAP_CLASSES["wrong_primitive"]
    full = error_maps.error_map(grey, classes)
    assert tuple(full[3, 5]) == looks.rgb(looks.VERDICTS["false_hit"])
    small = error_maps.fitted(grey, classes)
    assert small.shape == (2, error_maps.PANEL, 3)
    assert tuple(small[1, 2]) == looks.rgb(looks.VERDICTS["false_hit"])
    assert tuple(small[0, 0]) == looks.rgb(looks.VERDICTS["wrong_primitive"])
    assert len({tuple(pixel) for pixel in small.reshape(-1, 3)}) == 3


def test_a_run_is_the_same_as_itself(run):
    found = compare_runs([run], [run])
    assert not found.changed
    assert found.counted == len(run.results)
    assert {str(change.names["technique"]) for change in found.cells} <= set(run.results.technique)
