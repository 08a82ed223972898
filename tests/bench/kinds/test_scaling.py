"""Scaling experiments: settings, exponents, the process of a cell, results and their report."""

import dataclasses
import math
import os
import signal

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.executors.processes import Worker, WorkerError
from hybrid_rt_bench.experiments import load_experiment, parse_experiment
from hybrid_rt_bench.kinds.scaling import figures as scaling_figures
from hybrid_rt_bench.kinds.scaling import tables as scaling
from hybrid_rt_bench.kinds.scaling.cell import (
    Cell,
    Stages,
    Task,
    Visit,
)
from hybrid_rt_bench.kinds.scaling.columns import SCHEMA
from hybrid_rt_bench.kinds.scaling.run import (
    Measured,
    PlannedCell,
    _thread_counts,
    plan_series,
)
from hybrid_rt_bench.kinds.scaling.spec import Series, parse_counts
from hybrid_rt_bench.kinds.scaling.stages import STAGES
from hybrid_rt_bench.measure import memory, strongest
from hybrid_rt_bench.measure.errors import NothingToRunError
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.report.style import STYLE
from hybrid_rt_bench.results import exponents
from hybrid_rt_bench.results import folder as results
from hybrid_rt_bench.runs import compare_runs, read_run, render_run
from support.bench_rows import ENVIRONMENT
from support.geometry import check

GOOD = """
schema = 1
kind = "scaling"
name = "x"
title = "X"
techniques = ["paper"]
rounds = 2
[[series]]
name = "size"
axis = "triangles"
scene = "street"
triangles = ["2^10..2^12", 5000]
resolutions = ["64x48"]
[[series]]
name = "picture"
axis = "pixels"
scene = "cornell"
resolutions = ["64x48", "128x96"]
[[series]]
name = "cores"
axis = "threads"
scene = "cornell"
resolutions = ["64x48"]
"""

TINY = Task("cornell", "front", None, 64, 48, 1, ("paper", "certified"), 1024, True)


def good(**changes):
    text = GOOD
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return parse_experiment(text, source="x.toml")


# Settings


@pytest.mark.parametrize(
    ("values", "counts"),
    [
        (["2^10..2^13"], [1024, 2048, 4096, 8192]),
        ([4096], [4096]),
        (["4096", "2^10", 5000, 4096], [1024, 4096, 5000]),
        ([], []),
    ],
)
def test_numbers_of_triangles_are_read(values, counts):
    assert parse_counts("triangles", values) == counts


@pytest.mark.parametrize(
    "value", ["2^", "0", "-4", "2^12..2^10", "1000..2000", "many", "1.5", True]
)
def test_other_numbers_of_triangles_are_refused(value):
    with pytest.raises(hrt.ArgumentError, match=r"2\^10\.\.2\^23"):
        parse_counts("triangles", [value])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('axis = "pixels"', 'axis = "pixel"', "axis"),
        ('name = "picture"', 'name = "size"', "'size' twice"),
        ('"64x48", "128x96"', '"64by48"', "WIDTHxHEIGHT"),
        ('axis = "threads"', 'axis = "threads"\nthreads = [0]', "integers >= 1"),
        ('axis = "pixels"', 'axis = "pixels"\nthreads = [1]', "at most 0 of them on axis 'pixels'"),
        ('axis = "pixels"', 'axis = "threads"', "at most 1 of them on axis 'threads'"),
        ('triangles = ["2^10..2^12", 5000]', "", "at least one number on axis 'triangles'"),
        ('scene = "street"', 'scene = "street"\nbuilds = true', "did you mean 'build'"),
        (
            'scene = "street"',
            'scene = "street"\nbrute_force = { ray = 64 }',
            "did you mean 'rays'",
        ),
    ],
)
def test_settings_that_make_no_sense_are_refused(old, new, said):
    with pytest.raises(hrt.HybridRTError, match=said.replace("^", r"\^")):
        good(**{old: new})


def test_series_are_picked_by_name_or_axis():
    experiment = good()
    assert [s.name for s in experiment.picked(["cores", "pixels"], None).series] == [
        "picture",
        "cores",
    ]
    assert experiment.picked(None, ["2^14"]).series[0].triangles == [2**14]
    assert experiment.picked(None, ["2^14"]).series[1:] == experiment.series[1:]
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'cores'"):
        experiment.picked(["core"], None)
    with pytest.raises(hrt.ArgumentError, match="--triangles"):
        experiment.picked(None, ["lots"])


def test_resolutions_of_the_command_line_are_those_of_the_axis_pixels():
    sizes = [Resolution.parse("r", text) for text in ("320x240", "640x480")]
    changed = good().overridden(sizes, 7)
    assert changed.rounds == 7
    assert changed.series[1].resolutions == sizes
    assert [str(r) for r in changed.series[0].resolutions] == ["64x48"]


def test_the_experiment_of_the_package_covers_what_it_is_for():
    full = load_experiment("scaling")
    by_name = {series.name: series for series in full.series}
    assert by_name["triangles"].triangles == [2**k for k in range(10, 24)]
    assert str(by_name["triangles"].resolutions[0]) == "1920x1080"
    for scene in ("atrium", "sponza", "bistro"):
        pixels = by_name[f"pixels-{scene}"].resolutions
        assert (str(pixels[0]), str(pixels[-1])) == ("640x360", "7680x4320")
    assert by_name["threads"].threads is None
    for series in load_experiment("scaling", quick=True).series:
        assert series.scene in ("street", "atrium")


# Planning


def test_cells_ascend_and_differ_in_one_thing():
    planned, notes = plan_series(good(), 2)
    assert not notes
    cells = {p.series.name: p.cells for p in planned}
    assert [c.x for c in cells["size"]] == [1024, 2048, 4096, 5000]
    assert [c.label for c in cells["size"]] == ["2^10", "2^11", "2^12", "5000"]
    assert {c.task.threads for c in cells["size"]} == {2}
    assert [c.x for c in cells["picture"]] == [64 * 48, 128 * 96]
    assert [c.task.threads for c in cells["cores"]] == [1, 2]
    for name, changing in (("size", "size"), ("cores", "threads")):
        fixed = {dataclasses.replace(c.task, **{changing: 1}) for c in cells[name]}
        assert len(fixed) == 1


def test_threads_beyond_the_machine_are_left_out_and_named():
    experiment = good(**{'axis = "threads"': 'axis = "threads"\nthreads = [1, 2, 64]'})
    planned, notes = plan_series(experiment, 2)
    assert [c.x for c in planned[-1].cells] == [1, 2]
    assert "goes without 64 threads" in notes[0]


@pytest.mark.parametrize(
    ("most", "counts"),
    [
        (1, [1]),
        (6, [1, 2, 3, 4, 5, 6]),
        (16, [1, 2, 3, 4, 5, 6, 7, 8, 10, 13, 16]),
        (20, [1, 2, 3, 4, 5, 6, 7, 8, 10, 13, 16, 20]),
    ],
)
def test_many_threads_are_thinned_out(most, counts):
    assert _thread_counts(most) == counts


def test_an_absent_scene_costs_its_series_alone(monkeypatch, tmp_path):
    monkeypatch.setenv("HYBRID_RT_DATA", str(tmp_path))
    absent = good(**{'axis = "pixels"\nscene = "cornell"': 'axis = "pixels"\nscene = "sponza"'})
    planned, notes = plan_series(absent, 1)
    assert [p.series.name for p in planned] == ["size", "cores"]
    assert "series 'picture' is left out: scene 'sponza' needs" in notes[0]
    with pytest.raises(NothingToRunError, match="left out"):
        plan_series(absent.picked(["picture"], None), 1)


def test_a_scene_of_one_size_has_no_axis_of_triangles():
    experiment = good(**{'scene = "street"': 'scene = "cornell"'})
    with pytest.raises(hrt.ArgumentError, match="series 'size': scene: expected one whose number"):
        plan_series(experiment, 1)


def test_an_unknown_camera_is_refused_before_measuring():
    experiment = good(**{'scene = "street"': 'scene = "street"\ncamera = "alon"'})
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'along'"):
        plan_series(experiment, 1)


# Exponents


@pytest.mark.parametrize("power", [-1.0, 0.0, 0.5, 1.0, 2.0])
def test_a_power_law_gives_its_exponent_back(power):
    n = 2.0 ** np.arange(10, 18)
    found = exponents.fit(n, 3e-3 * n**power)
    assert found.value == pytest.approx(power, abs=1e-12)
    assert found.high - found.low < 1e-10
    assert found.points == 8


def test_the_interval_holds_the_true_exponent_as_often_as_it_says():
    rng = np.random.default_rng(7)
    n = 2.0 ** np.arange(10, 18)
    held, widths, trials = 0, [], 4000
    for _ in range(trials):
        found = exponents.fit(n, n**0.5 * np.exp(rng.normal(0, 0.1, len(n))))
        held += found.low <= 0.5 <= found.high
        widths.append(found.high - found.low)
    # 0.95 with a standard error of 0.0034
    assert 0.938 < held / trials < 0.962
    assert np.median(widths) < 0.15


def test_a_curve_that_bends_has_a_wide_interval_and_a_steeper_upper_half():
    n = 2.0 ** np.arange(10, 24)
    time = 1.0 + n / 2**17  # a fixed cost, then in proportion
    whole = exponents.fit(n, time)
    above = exponents.upper_half(n)
    upper = exponents.fit(n[above], time[above])
    assert above.sum() == 7
    assert 0.2 < whole.value < 0.6
    assert whole.high - whole.low > 0.1
    assert upper.value > 0.7


def test_agrees_with_scipy():
    from scipy.stats import linregress, t

    rng = np.random.default_rng(3)
    n, time = np.array([1.0, 3, 4, 9, 20]), rng.uniform(1, 2, 5)
    other = linregress(np.log(n), np.log(time))
    half = t.ppf(0.975, 3) * other.stderr
    found = exponents.fit(n, time)
    assert found.value == pytest.approx(other.slope)
    assert (found.low, found.high) == pytest.approx((other.slope - half, other.slope + half))


def test_too_few_sizes_have_no_interval():
    assert exponents.fit([1, 2], [1, 2]) == exponents.Exponent(1.0, -math.inf, math.inf, 2)
    alone = exponents.fit([5], [1])
    assert math.isnan(alone.value)
    assert (alone.low, alone.high) == (-math.inf, math.inf)


@pytest.mark.parametrize(
    ("sizes", "times"), [([1, 2], [1]), ([1, 0], [1, 1]), ([1, 2], [1, math.nan])]
)
def test_sizes_and_times_that_have_no_logarithm_are_refused(sizes, times):
    with pytest.raises(ValueError, match="expected"):
        exponents.fit(sizes, times)


def test_the_upper_half_has_three_sizes_at_least():
    assert list(exponents.upper_half([1, 2, 3, 1000])) == [False, True, True, True]
    assert list(exponents.upper_half([1, 2])) == [True, True]


# A cell


def test_a_cell_times_every_stage_of_its_techniques():
    cell = Cell(dataclasses.replace(TINY, brute_rays=64, brute_seconds=60.0))
    visit = cell.answer(0, 1)
    shared = {"build", "raster", "rays", "embree", "brute_force"}
    own = {"prepare", "march", "compaction", "fallback", "merge"}
    wanted = {("", s) for s in shared} | {(t, s) for t in ("paper", "certified") for s in own}
    for phase in ("warmup", "measured"):
        rows = [row for row in visit.rows if row["phase"] == phase]
        assert len(rows) == len(wanted)
        assert {(row["technique"], row["stage"]) for row in rows} == wanted
        assert all(row["seconds"] > 0 for row in rows)
    assert 0 < visit.alpha["paper"] < visit.alpha["certified"] <= 1
    assert cell.details["rays"] > 1000


def test_a_stage_that_was_not_asked_for_is_not_run():
    cell = Cell(dataclasses.replace(TINY, techniques=("slope",), build=False))
    stages = {row["stage"] for row in cell.answer(0, 0).rows if row["technique"] == ""}
    assert stages == {"raster", "rays", "embree"}


@pytest.mark.skipif(hrt.embree_problem() is not None, reason="Embree's packets are not reached")
@pytest.mark.parametrize(("path", "renewed"), [("packet", True), ("run", False)])
def test_the_same_build_is_timed_whichever_path_is_the_strongest(monkeypatch, path, renewed):
    made = []
    cell = Cell(TINY)
    stages = cell.stages
    strongest_one = hrt.EmbreeTracer(stages.scene, path=path, width=4)
    stages = Stages(stages.scene, stages.camera, strongest_one, TINY)
    make = stages.make_tracer

    def watched(options):
        made.append(make(options))
        return made[-1]

    monkeypatch.setattr(stages, "make_tracer", watched)
    assert ("", "build") in stages.run(trace_first=True)
    assert [tracer.path for tracer in made] == ["packet"]
    assert (stages.tracer is made[0]) is renewed
    assert (stages.tracer.path, stages.tracer.width) == (path, 4)


def test_brute_force_is_left_out_where_it_takes_too_long():
    cell = Cell(dataclasses.replace(TINY, brute_rays=1024, brute_seconds=1e-9))
    assert cell.details["brute_force_seconds"] > 1e-9
    assert "brute_force" not in {row["stage"] for row in cell.answer(0, 0).rows}


def test_a_sample_of_rays_is_spread_over_all():
    camera = hrt.Camera.look_at((0, 1, 3), (0, 0, 0), width=64, height=64)
    floor = hrt.Scene.from_arrays(
        np.array([(-9, 0, -9), (0, 0, 9), (9, 0, -9)], np.float32), np.array([(0, 1, 2)], np.int32)
    )
    rays = hrt.mirror_rays(hrt.rasterize(floor, camera))
    few = strongest.sample_of(rays, 64)
    assert len(few) == 64
    assert np.ptp(few.pixel[:, 1]) > 0.7 * np.ptp(rays.pixel[:, 1])


# Its process


@pytest.mark.slow
def test_a_process_answers_visits_and_counts_memory():
    worker = Worker(Cell, TINY)
    try:
        details = worker.ready()
        visits = [worker.ask(number, 0) for number in range(2)]
    finally:
        worker.stop()
    assert details["triangles"] > 0
    assert [visit.rows[0]["round"] for visit in visits] == [0, 1]
    assert details["program_bytes"] > 2**24
    if visits[0].peak is not None:
        assert visits[0].peak > details["program_bytes"] / 2
    assert not worker.process.is_alive()


def test_a_task_that_cannot_be_done_says_why():
    worker = Worker(Cell, dataclasses.replace(TINY, scene="street", camera="along", size=7))
    try:
        with pytest.raises(WorkerError, match="size: expected"):
            worker.ready()
    finally:
        worker.stop()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="processes are ended by signals on POSIX only")
def test_a_process_that_is_ended_says_how():
    worker = Worker(Cell, TINY)
    try:
        worker.ready()
        os.kill(worker.process.pid, signal.SIGKILL)
        with pytest.raises(WorkerError, match="ended by SIGKILL, as the system does when memory"):
            worker.ask(0, 0)
    finally:
        worker.stop()


def test_a_peak_begins_again_and_holds_what_was_freed():
    if not memory.reset_peak():
        pytest.skip("this system cannot count a peak of memory from a given moment on")
    before = memory.peak()
    block = np.ones(2**26, np.uint8)
    del block
    assert memory.peak() > before + 2**25
    memory.trim()
    assert memory.reset_peak()
    assert memory.peak() < before + 2**25


# Results and report

SECONDS = {
    ("", "build"): lambda n: 1e-6 * n,
    ("", "raster"): lambda n: 8e-3,
    ("", "rays"): lambda n: 4e-3,
    ("", "embree"): lambda n: 1e-2 * math.log2(n),
    ("certified", "prepare"): lambda n: 2e-2,
    ("certified", "march"): lambda n: 0.1 * (n / 2**14) ** 0.05,
    ("certified", "compaction"): lambda n: 1e-3,
    ("certified", "fallback"): lambda n: 2e-2,
    ("certified", "merge"): lambda n: 1e-3,
}


def write_run(out, sizes=(2**14, 2**17, 2**20, 2**23), axis="triangles", slower=1.0, rounds=5):
    experiment = load_experiment("scaling")
    writer = results.create_run(
        out,
        "scaling",
        SCHEMA,
        {
            "kind": "scaling",
            "spec": experiment.model_dump(mode="json", by_alias=True),
            "notes": [],
            "warnings": [],
        },
    )
    writer.meta["environment"] = ENVIRONMENT
    series = {"name": "a", "axis": axis, "scene": "street", "resolutions": ["64x48"]}
    series["triangles"] = list(sizes) if axis == "triangles" else []
    for x in sizes:
        label = f"2^{x.bit_length() - 1}" if axis == "triangles" else str(x)
        task = dataclasses.replace(TINY, scene="street", camera="along", threads=2)
        task = dataclasses.replace(task, techniques=("certified",))
        measured = Measured(
            Series(**series),
            PlannedCell(x, label, task),
            {
                "triangles": x, "rays": 2000, "program_bytes": 2**28, "scene_bytes": 2**20,
                "peak_is_of_rounds": True, "embree_path": "packet 8, robust",
                "compile_seconds": 1.5, "embree_ns_per_ray": {}, "brute_force_seconds": 9.0,
            },
        )  # fmt: skip
        for number in range(rounds):
            rows = [
                {"technique": t, "stage": s, "round": number, "phase": phase,
                 "seconds": slower * f(x) * (1 + 0.01 * number) * (99 if phase == "warmup" else 1)}
                for (t, s), f in SECONDS.items()
                for phase in ("warmup", "measured")
            ]  # fmt: skip
            measured.add(Visit(rows, {"certified": 0.5}, {"certified": 20.0}, 2**29 + number))
            writer.add_cell(*measured.record(), [])
    writer.finish()
    return read_run(writer.folder)


def row_of(table, first):
    return next(row[1:] for row in table.rows if row[0] == first)


def table_of(run, start):
    return next(table for table in scaling.tables(run) if table.title.startswith(start))


def test_a_cell_measured_further_takes_the_place_of_what_was_kept(tmp_path):
    run = write_run(tmp_path)
    assert len(run.meta["cells"]) == 4
    assert len(run.samples) == 4 * 5 * 2 * len(SECONDS)
    march = run.results[run.results.stage == "march"]
    assert list(march.x) == [2**14, 2**17, 2**20, 2**23]
    assert set(march.rounds) == {5}
    assert march.ms.iloc[0] == pytest.approx(100 * 1.02)
    assert march.ns_per_ray.iloc[0] == pytest.approx(100 * 1.02e6 / 2000)
    assert set(run.results.peak_bytes) == {2**29 + 4}
    assert pd.isna(run.results[run.results.stage == "raster"].ns_per_ray).all()


def test_sums_are_those_of_the_round(tmp_path):
    rows = write_run(tmp_path).results.set_index(["x", "stage"]).ms
    assert rows[2**14, "hybrid"] == pytest.approx(122 * 1.02)
    assert rows[2**14, "frame"] == pytest.approx((122 + 8 + 20) * 1.02)


def test_the_tables_give_the_exponents_back(tmp_path):
    table = table_of(write_run(tmp_path), "Exponents")
    assert row_of(table, "march (certified)")[0] == "0.05 [0.05, 0.05]"
    assert row_of(table, "Embree build")[0] == "1.00 [1.00, 1.00]"
    assert row_of(table, "raster")[0] == "0.00 [0.00, 0.00]"
    value, rest = row_of(table, "strongest Embree, every ray")[0].split(" ", 1)
    assert float(value) == pytest.approx(0.08, abs=0.01)
    assert rest != "[0.08, 0.08]"
    assert "O(log n) over this range looks like about 0.08" in table.notes[-1]


@pytest.mark.parametrize(("growth", "said"), [(1.3, "held"), (1.8, "missed")])
def test_the_goal_of_the_march_is_judged_from_2_14_to_2_23(tmp_path, monkeypatch, growth, said):
    power = math.log(growth) / math.log(2**9)
    monkeypatch.setitem(SECONDS, ("certified", "march"), lambda n: 0.1 * (n / 2**14) ** power)
    row = row_of(table_of(write_run(tmp_path), "Growth from 2^14 to 2^23"), "march (certified)")
    assert row[2].startswith(f"{growth:.2f} [")
    assert row[-1] == said


def test_a_goal_held_by_too_few_rounds_is_not_called_sure(tmp_path):
    for rounds, shown in ((1, "1.37 [–]"), (3, "1.37 [1.37, 1.37]")):
        table = table_of(write_run(tmp_path, rounds=rounds), "Growth")
        row = row_of(table, "march (certified)")
        assert row[2] == shown
        assert row[-1] == "held, by its median alone"


def test_a_run_that_ends_early_says_so_of_the_goal(tmp_path):
    table = table_of(write_run(tmp_path, sizes=(2**10, 2**14, 2**18)), "Growth from 2^14 to 2^18")
    assert row_of(table, "march (certified)")[-1] == "not said: 2^14 to 2^23 not measured"
    assert "which this run does not hold" in table.notes[-1]


def test_two_sizes_have_an_exponent_without_an_interval(tmp_path):
    table = table_of(write_run(tmp_path, sizes=(2**14, 2**16)), "Exponents")
    assert row_of(table, "Embree build")[0] == "1.00 [–]"


def test_threads_are_shown_as_a_speed_up(tmp_path, monkeypatch):
    monkeypatch.setitem(SECONDS, ("", "embree"), lambda n: 0.1 / n)
    monkeypatch.setitem(SECONDS, ("certified", "march"), lambda n: 0.1)
    run = write_run(tmp_path, sizes=(1, 2, 4), axis="threads")
    table = table_of(run, "Speed-up by threads")
    assert row_of(table, "strongest Embree, every ray")[-1] == "4.00 (100 %)"
    assert row_of(table, "march (certified)")[-1] == "1.00 (25 %)"


def test_a_report_is_rendered_from_the_files_alone(tmp_path):
    run = write_run(tmp_path)
    tables, written = render_run(run)
    assert {path.name for path in written} == {
        "tables.md", "scaling-a.png", "scaling-a.svg", "memory.png", "memory.svg"
    }  # fmt: skip
    assert all(path.stat().st_size > 1000 for path in written)
    text = (run.folder / "tables.md").read_text()
    for table in tables:
        assert f"### {table.title}" in text
        widths = {len(row) for row in table.rows if len(row) > 1}
        assert widths <= {len(table.columns), 2}
    peak = row_of(table_of(run, "Peak memory"), "2^20")
    assert peak[:4] == ["512", "256", "1", "255"]


@pytest.mark.parametrize(("axis", "sizes"), [("pixels", (3072,)), ("threads", (2, 4))])
def test_a_series_of_any_axis_and_of_one_cell_is_rendered(tmp_path, axis, sizes):
    _, written = render_run(write_run(tmp_path, sizes=sizes, axis=axis, rounds=1))
    assert "scaling-a.png" in {path.name for path in written}


@pytest.mark.parametrize(
    ("axis", "sizes"),
    [
        ("triangles", [2**k for k in range(10, 24)]),
        ("triangles", [2**14, 2**15]),
        ("pixels", [57600, 230400, 921600, 2073600, 8294400, 33177600]),
        ("threads", [2, 3, 4, 6, 8, 10, 13, 16]),
    ],
)
def test_no_two_texts_of_a_figure_overlap(tmp_path, axis, sizes):
    """Guides, ticks, titles and legends, each on its own ground."""
    run = write_run(tmp_path, sizes=sizes, axis=axis)
    if axis == "pixels":
        run.results["label"] = "3840x2160"  # as long as any
    with mpl.rc_context(STYLE):
        figures = [scaling_figures.time_over_axis(run, "a")]
        if axis != "threads":
            figures.append(scaling_figures.memory(run))
        for figure in figures:
            check(figure)


def test_runs_are_compared_whatever_their_series_are_called(tmp_path):
    a = write_run(tmp_path)
    b = write_run(tmp_path, sizes=(2**14, 2**20), slower=1.5)
    found = compare_runs([a], [b])
    # All stages are slower alike, the baseline too: nothing is, beside it.
    assert not found.changed
    march = next(change for change in found.groups if change.timing == "march")
    assert march.names == {"technique": "certified"}
    assert march.effect.ratio == pytest.approx(1)
    assert march.effect.cells == 2
    assert march.after_ms == pytest.approx(1.5 * march.before_ms)
    assert {row["triangles"] for row in found.alone[0]} == {2**17, 2**23}
    assert {change.timing for change in found.baselines} == {STAGES["embree"]}


def test_runs_without_a_common_cell_or_of_other_kinds_are_not_compared(tmp_path):
    a, b = write_run(tmp_path), write_run(tmp_path, sizes=(2**11,))
    with pytest.raises(hrt.ArgumentError, match="none in common"):
        compare_runs([a], [b])
    paper = dataclasses.replace(b, meta={**b.meta, "kind": "paper"})
    with pytest.raises(hrt.ArgumentError, match=r"of one kind .*'scaling'.* of kind 'paper'"):
        compare_runs([a], [paper])
