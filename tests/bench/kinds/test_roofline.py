"""The roofline of the certified march: rates of the machine, what is reckoned with them, a run."""

import dataclasses
import json
import sys

import numba
import numpy as np
import pandas as pd
import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels.simd import WIDTH
from hybrid_rt.kernels.techniques.certified import slots
from hybrid_rt_bench import cli
from hybrid_rt_bench.cli import terminal
from hybrid_rt_bench.experiments import load_experiment, parse_experiment
from hybrid_rt_bench.kinds.roofline import cell as roofline_cell
from hybrid_rt_bench.kinds.roofline import kernels, rates
from hybrid_rt_bench.kinds.roofline import reckon as roofline
from hybrid_rt_bench.kinds.roofline import tables as report
from hybrid_rt_bench.kinds.roofline.columns import SCHEMA
from hybrid_rt_bench.measure.loaded import prepare
from hybrid_rt_bench.results import folder as results
from hybrid_rt_bench.runs import read_run, render_run
from hybrid_rt_scenes import get_scene
from support.bench_rows import ENVIRONMENT

TEXT = """
schema = 1
kind = "roofline"
name = "tiny"
title = "A tiny roofline"
resolutions = ["48x36"]
lists = 4
rounds = 2
cameras = 1
selection_rays = 1024
table_kib = [16, 64]
repeats = 2
repeat_seconds = 1e-5
[[scenes]]
name = "cornell"
[quick]
rounds = 1
"""

RATES = [
    {"bytes": size, "threads": threads, "kind": kind, "ns_element": ns / threads, "ns_vector": ns}
    for size, ns in ((1024, 1.0), (4096, 2.0), (16384, 8.0))
    for threads in (1, 2)
    for kind in ("gather", "chain", "load")
]
"""A machine of which every thread reads as fast as one alone."""


def run(monkeypatch, tmp_path, *arguments):
    """Run the experiment by the command line; return its code and its folder."""
    path = tmp_path / "tiny.toml"
    path.write_text(TEXT)
    out = tmp_path / "out"
    words = ["hybrid-rt", "run", str(path), "--out", str(out), *arguments]
    monkeypatch.setattr(sys, "argv", words)
    code = 0
    try:
        cli.main()
    except SystemExit as stopped:
        code = stopped.code
    (folder,) = out.iterdir()
    return code, folder


def cells_of(table, first):
    return next(dict(zip(table.columns, row, strict=True)) for row in table.rows if row[0] == first)


@pytest.mark.parametrize("quick", [False, True])
def test_the_experiment_of_the_package(quick):
    experiment = load_experiment("roofline", quick=quick)
    assert experiment.lists == 8
    assert experiment.table_kib[0] == 16
    assert experiment.table_kib[-1] >= 65536


@pytest.mark.parametrize("sizes", ["[16, 48]", "[64, 16]", "[16, 16]", "[]", "[0]"])
def test_tables_of_odd_sizes_are_refused(sizes):
    with pytest.raises(hrt.ArgumentError, match="table_kib"):
        parse_experiment(TEXT.replace("[16, 64]", sizes), source="x.toml")


def test_the_kernels_read_all_that_they_are_asked_for():
    table = np.ones(2**12, np.float32)
    assert kernels.gather_some(table, 12, 4096, 1) == 4096 * WIDTH
    assert kernels.load_some(table, 12, 4096, 3) == 4096 * WIDTH
    sums = np.zeros(numba.get_num_threads(), np.float32)
    kernels.gather_all(table, 12, 1024, sums)
    assert (sums == 1024 * WIDTH).all()


def test_gathers_go_everywhere():
    """A table of which one place is not 1: the sum says how often that one was read."""
    counts = []
    for place in (0, 1, 1000, 2**12 - 1):
        table = np.ones(2**12, np.float32)
        table[place] = 2
        read = 2**14
        counts.append((kernels.gather_some(table, 12, read, 1) - read * WIDTH) / (read * WIDTH))
    assert np.allclose(counts, 2.0**-12, rtol=0.5)


@pytest.mark.parametrize("bits", [6, 12])
def test_a_chain_is_one_cycle_through_all_places(bits):
    table = rates.cycle(bits)
    follow = table.view(np.int32)
    at, seen = 0, set()
    for _ in range(1 << bits):
        at = int(follow[at])
        seen.add(at)
    assert len(seen) == 1 << bits
    assert at == 0
    start = (np.arange(WIDTH, dtype=np.int32) * np.int32(kernels.FACTOR) + 1) & ((1 << bits) - 1)
    for _ in range(5):
        start = follow[start]
    assert kernels.chain_some(table, bits, 5, 1) == start.sum()


def test_the_fastest_repeat_counts():
    """By this clock the search for enough vectors takes 1 ms, and the repeats 2, 0.5 and 4 ms."""
    lasts = {kind: [2e-3, 5e-4, 4e-3] for kind in rates.KINDS}
    durations = iter([1e-3] * len(lasts) + [last for kind in lasts.values() for last in kind])
    now = [0.0, False]

    def clock():
        now[1] = not now[1]
        if not now[1]:
            now[0] += next(durations)
        return now[0]

    rows = rates.measure([16384], [1], 3, 1e-4, clock=clock)
    assert [row["kind"] for row in rows] == list(rates.KINDS)
    vectors = 2 * rates.FEWEST
    for row in rows:
        assert row["ns_vector"] == pytest.approx(5e5 / vectors)
        assert row["ns_element"] == pytest.approx(5e5 / vectors / WIDTH)


def test_a_row_for_each_size_number_of_threads_and_kind():
    sizes = []
    rows = rates.measure([16384, 65536], [1], 1, 1e-6, on_size=lambda: sizes.append(1))
    assert len(rows) == 2 * len(rates.KINDS)
    assert len(sizes) == 2
    assert all(row["ns_element"] > 0 for row in rows)
    assert all(cache["bytes"] > 0 for cache in rates.caches())


@pytest.mark.parametrize(("size", "ns"), [(0, 1), (1024, 1), (1025, 2), (9999, 8), (10**9, 8)])
def test_a_number_takes_what_the_smallest_table_that_holds_its_structure_says(size, ns):
    assert roofline.ns_element(RATES, size, 1) == ns
    assert roofline.ns_element(RATES, size, 2) == ns / 2


def test_what_gathers_alone_would_take():
    row = {"threads": 1, "rays": 10}
    for name in roofline.STRUCTURES:
        row |= {f"{name}_bytes": 512, f"{name}_places": 0, f"{name}_gathered": 0}
    row |= {"planes_bytes": 4096, "planes_places": 5, "planes_gathered": 30}
    row |= {"slots_places": 10, "slots_gathered": 10}
    row |= {"lists_bytes": 2**20, "lists_places": 7, "lists_gathered": 7}
    planes = (5 * 2.0 + 25 * 1.0) / 10  # the first number of a plane waits, the others are near
    assert roofline.far_ns(RATES, row, "planes") == pytest.approx(planes)
    slots = 10 * 1.0 / 10
    assert roofline.far_gathers_ns(RATES, row) == pytest.approx(planes + 7 * 8.0 / 10 + slots)
    assert roofline.near_gathers_ns(RATES, row) == pytest.approx(37 / 10)  # but the slots
    assert roofline.near_gathers_ns(RATES, {**row, "threads": 2}) == pytest.approx(37 / 20)


def test_the_budget_is_what_embree_leaves():
    seconds = {"embree": 9.0, "compaction": 1.0, "fallback": 4.0, "merge": 2.0, "march": 7.0}
    assert roofline.budget({k: np.array([v]) for k, v in seconds.items()}) == [2.0]


@pytest.fixture(scope="module")
def record():
    spec = get_scene("cornell")
    camera = spec.camera(next(iter(spec.cameras)), 48, 36)
    experiment = parse_experiment(TEXT, source="tiny.toml")
    done = []
    found = roofline_cell.measure_cell(
        prepare(spec.load(), 1), camera, "a view", experiment, 1, lambda: done.append(1)
    )
    assert len(done) == 2
    return spec.load(), camera, found


def test_a_view_has_its_work_and_its_sizes(record):
    scene, camera, found = record
    gbuffer = hrt.rasterize(scene, camera)
    screen = hrt.prepare(gbuffer, hrt.Certified(lists=4))
    marched = hrt.march(hrt.mirror_rays(gbuffer), screen, threads=1)
    (row,) = found.results
    assert {k: row[k] for k in dataclasses.asdict(marched.work)} == dataclasses.asdict(marched.work)
    assert row["alpha"] == marched.resolved.mean()
    assert row["pyramid_gathered"] == marched.steps.sum()
    assert row["corners_gathered"] == 9 * marched.tests
    assert row["planes_places"] == marched.work.planes
    assert row["planes_bytes"] + row["lists_bytes"] == screen.data.lists.nbytes
    assert row["corners_bytes"] == 36 * len(scene)
    assert row["slots_bytes"] == slots.STRIDE * 192
    assert row["pyramid_bytes"] < screen.data.pyramid.nbytes
    gathered = sum(row[f"{name}_gathered"] for name in roofline.STRUCTURES)
    assert row["touched_bytes"] == 4 * gathered + (32 + 26) * len(marched)


def test_times_are_medians_and_paired_ratios(record):
    found = record[2]
    (row,) = found.results
    assert [s["round"] for s in found.samples] == [0, 1]
    for stage in roofline.STAGES:
        each = [1e9 * s[stage] / row["rays"] for s in found.samples]
        assert row[f"{stage}_ns"] == pytest.approx(np.median(each))
    ratios = [s["scalar"] / s["march"] for s in found.samples]
    assert row["vectors_speedup"] == pytest.approx(np.median(ratios))
    for sample in found.samples:
        assert 0 < sum(sample[stage] for stage in roofline.RASTER) <= sample["raster"]
    for stage in (*roofline.RASTER, "raster", "primary"):
        assert row[f"{stage}_ms"] == pytest.approx(
            1e3 * np.median([s[stage] for s in found.samples])
        )
    ratios = [s["primary"] / s["raster"] for s in found.samples]
    assert row["raster_speedup"] == pytest.approx(np.median(ratios))


def test_a_view_of_nothing_is_refused(record):
    scene = record[0]
    away = hrt.Camera.look_at((50, 50, 50), (60, 60, 60), width=8, height=8)
    experiment = parse_experiment(TEXT, source="tiny.toml")
    with pytest.raises(hrt.HybridRTError, match="a view: the camera sees no surface"):
        roofline_cell.measure_cell(prepare(scene, 1), away, "a view", experiment, 1)


def test_a_run_is_kept_and_shown_again(monkeypatch, tmp_path, capsys):
    code, folder = run(monkeypatch, tmp_path, "--threads", "1", "--json")
    said = capsys.readouterr()
    assert code == 0, said.err
    assert "march" in said.err
    summary = json.loads(said.out)
    assert (summary["measured"], summary["failed"]) == (1, 0)
    found = pd.read_parquet(folder / "results.parquet")
    assert list(found.threads) == [1]
    meta = json.loads((folder / "run.json").read_text())
    assert {row["bytes"] for row in meta["rates"]} == {16384, 65536}
    assert set(meta["compile_seconds"]) == {
        "raster, march and Embree", "rates of the machine"
    }  # fmt: skip
    text = (folder / "tables.md").read_text()
    for figure in ("gather-rate", "march-budget"):
        assert (folder / "figures" / f"{figure}.png").stat().st_size > 5000
    (folder / "tables.md").unlink()
    render_run(read_run(folder))
    assert (folder / "tables.md").read_text() == text


def test_a_view_that_fails_costs_only_itself(monkeypatch, tmp_path, capsys):
    real = roofline_cell.measure_cell

    def fails(base, camera, name, *others):
        if name != "compiling":
            raise RuntimeError("out of luck")
        return real(base, camera, name, *others)

    monkeypatch.setattr(roofline_cell, "measure_cell", fails)
    code, folder = run(monkeypatch, tmp_path, "--threads", "1", "--quick")
    assert code == terminal.FAILED
    assert "RuntimeError: out of luck" in capsys.readouterr().err
    (cell,) = json.loads((folder / "run.json").read_text())["cells"]
    assert cell["state"] == "failed"


def test_an_option_of_another_kind_is_refused(monkeypatch, tmp_path, capsys):
    path = tmp_path / "tiny.toml"
    path.write_text(TEXT)
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", "run", str(path), "--triangles", "64"])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == terminal.USAGE
    assert "--triangles" in capsys.readouterr().err


def write_run(out, record):
    """Write a run of two numbers of threads: with one it breaks even at 100 ns, with two never."""
    writer = results.create_run(
        out,
        "roofline",
        SCHEMA,
        {
            "kind": "roofline", "command": [], "notes": [], "warnings": [], "rates": RATES,
            "spec": {"title": "Roofline", "rounds": 2, "repeats": 2},
            "scenes": [{"name": "hall", "triangles": 32}],
            "caches": [{"name": "L1", "bytes": 32768}],
        },
    )  # fmt: skip
    writer.meta["environment"] = ENVIRONMENT
    (row,) = record[2].results
    one = {"march_ns": 300.0, "start_ns": 40.0, "embree_ns": 250.0, "budget_ns": 100.0}
    two = {**one, "budget_ns": -5.0}
    cell = {"scene": "hall", "camera": "front", "width": 48, "height": 36}
    rows = [{**row, "threads": 1, **one}, {**row, "threads": 2, **two}]
    writer.add_cell(cell, record[2].samples, rows, [])
    writer.finish()
    return read_run(writer.folder)


def test_the_report_is_made_of_the_files_alone(tmp_path, record):
    data = write_run(tmp_path, record)
    by_title = {table.title: table for table in report.tables(data)}
    table = by_title["The break-even march time, and what the march takes, ns per ray"]
    assert [row[0] for row in table.rows] == [
        "1 thread", "hall, front", "2 threads", "hall, front"
    ]  # fmt: skip
    first = cells_of(table, "hall, front")
    assert (first["march / break-even"], first["set-up / break-even"]) == ("3.00", "0.400")
    assert table.rows[3][7:11] == ["none"] * 4
    row = data.results.iloc[0]
    at_once = cells_of(by_title["The march's time"], "hall, front")
    assert at_once["march, ns per step"] == report.number(300 * row.rays / row.steps)
    assert cells_of(by_title["The march's work per ray"], "hall, front")["rays"] == f"{row.rays:,}"
    busy = cells_of(by_title[f"Lanes at work, % of {WIDTH}"], "hall, front")
    assert busy["step"] == report.number(100 * row.busy_step)
    drawn = cells_of(by_title["The raster's time, ms per view"], "hall, front")
    assert drawn["tiles"] == report.number(row.tiles_ms)
    assert len(by_title["Gathers"].rows) == 1 + len(roofline.STRUCTURES)
    fast = cells_of(by_title["How fast the machine reads"], "16")
    assert fast["gathers, G elements/s, 1 thread"] == "0.125"
    assert fast["gathers, G elements/s, 2 threads"] == "0.250"
    _, written = render_run(data)
    assert [path.name for path in written] == [
        "tables.md", "gather-rate.png", "gather-rate.svg", "march-budget.png", "march-budget.svg"
    ]  # fmt: skip
