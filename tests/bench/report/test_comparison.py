"""Runs of known times, compared: what is reported, listed, warned of and refused."""

import dataclasses
import json
import math

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.cli.compare import ManyRuns
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.paper.columns import SCHEMA
from hybrid_rt_bench.report.comparison import shown
from hybrid_rt_bench.report.comparison.verdict import verdict
from hybrid_rt_bench.results.files import ReportsError
from hybrid_rt_bench.results.folder import create_run
from hybrid_rt_bench.results.schema import HYBRID_STAGES
from hybrid_rt_bench.runs import compare_runs, read_run
from support.bench_rows import ENVIRONMENT, whole

ROUNDS = 9
MILLISECONDS = {
    "raster": 8, "rays": 5, "embree_primary": 10, "embree": 100,
    "pyramid": 3, "march": 30, "compaction": 3, "fallback": 55, "merge": 4,
}  # fmt: skip
SHARED = ("raster", "rays", "embree_primary", "embree")


def made(out, seed=0, slower=(), techniques=("paper", "hiz"), cameras=("left", "right", "top"),
         alpha=0.4, load=1.0, warnings=(), environment=()):  # fmt: skip
    """Return a run whose times scatter, with `slower` factors by (technique, stage)."""
    rng = np.random.default_rng(seed)
    meta = {
        "kind": "paper", "command": [], "notes": [], "warnings": list(warnings),
        "spec": {"title": "a title", "rounds": ROUNDS}, "scenes": [],
        "environment": {**ENVIRONMENT, **dict(environment)},
    }  # fmt: skip
    with create_run(out, "paper", SCHEMA, meta) as writer:
        for camera in cameras:
            _add(writer, rng, camera, dict(slower), techniques, alpha, load)
        writer.finish()
    return read_run(writer.folder)


def _add(writer, rng, camera, slower, techniques, alpha, load):
    samples, results = [], []
    # What all of a round has in common cancels, what each stage has by itself does not.
    machine = load * np.exp(rng.normal(0, 0.1, ROUNDS))

    def seconds(technique, stage):
        factor = slower.get((technique, stage), 1.0) * math.exp(rng.normal(0, 0.01))
        return MILLISECONDS[stage] / 1e3 * factor * machine * np.exp(rng.normal(0, 0.01, ROUNDS))

    shared = {stage: seconds("", stage) for stage in SHARED}
    timed = {"": shared}
    for technique in techniques:
        mine = {s: seconds(technique, s) for s in ("pyramid", *HYBRID_STAGES)}
        timed[technique] = mine
        row = {"technique": technique, "rays": 1000, "resolved": int(1000 * alpha), "alpha": alpha}
        row |= summary.timing_columns(shared | mine, alpha)
        row |= {"embree_path": "run", "embree_primary_path": "run"}
        results.append(whole(SCHEMA, "results", row))
    for technique, stages in timed.items():
        for stage, values in stages.items():
            for k, value in [(-1, 9.0), *enumerate(values)]:
                phase = "warmup" if k < 0 else "measured"
                row = {"technique": technique, "stage": stage, "round": k, "phase": phase}
                samples.append({**row, "seconds": float(value)})
    verdicts = [
        {"technique": t, "status": "HIT", "verdict": "CORRECT", "count": int(1000 * alpha)}
        for t in techniques
    ]
    cell = {"scene": "hall", "camera": camera, "width": 640, "height": 360}
    writer.add_cell(cell, samples, results, verdicts)


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    out = tmp_path_factory.mktemp("before")
    return [made(out, seed) for seed in range(3)]


@pytest.fixture(scope="module")
def after(tmp_path_factory):
    out = tmp_path_factory.mktemp("after")
    return [made(out, seed, {("paper", "march"): 1.1}.items()) for seed in range(10, 13)]


def test_a_slower_march_is_found_with_its_technique_and_its_size(three, after):
    found = compare_runs(three, after)
    changes = {(c.names["technique"], c.timing): c for c in found.changes if not c.cell}
    assert set(changes) == {("paper", "march")}
    change = changes["paper", "march"]
    assert change.verdict == "slower"
    assert change.effect.low < 1.1 < change.effect.high
    assert change.effect.cells == 3
    text = verdict(found)
    assert text.startswith("Changed: technique paper, march slower by ")
    assert "over 3 cells" in text
    assert "hiz" not in text


def test_runs_of_one_program_are_not_told_apart(three, tmp_path):
    again = [made(tmp_path, seed) for seed in range(20, 23)]
    busy = [made(tmp_path, seed, load=1.5) for seed in range(30, 33)]
    for other in (again, busy):
        found = compare_runs(three, other)
        assert not found.changed, verdict(found)
        assert verdict(found).startswith("No change: none of ")
    assert "Embree, mirror rays took 1.5 times as long after" in verdict(found)
    assert not compare_runs(three[:1], busy[:1]).changed


def test_with_one_run_a_side_it_is_said_what_is_not_known(three):
    found = compare_runs(three[:1], three[1:2])
    assert "One run a side" in verdict(found)
    assert "A1 A2 A3 --to B1 B2 B3" in verdict(found)
    assert all(math.isnan(change.p) for change in found.cells)
    assert "With 1 and 2 runs" in verdict(compare_runs(three[:1], three[1:]))


def test_a_stage_that_is_over_in_no_time_is_not_judged(three):
    run = three[0]
    short = run.samples.stage == "merge"
    factor = np.where(short, 0.1, 1.0)
    shrunk = run.samples.assign(seconds=run.samples.seconds * factor)
    before = dataclasses.replace(run, samples=shrunk)
    # Where the scheduler takes its core away in most rounds it only seems to be long.
    found = compare_runs([before], [run])
    merge = [change for change in found.groups if change.timing == "merge"]
    assert [change.judged for change in merge] == [False, False]
    assert all(change.effect.ratio > 5 for change in merge)
    assert not any(change.timing == "merge" for change in found.changes)


def test_counts_are_compared_exactly(three, tmp_path):
    found = compare_runs(three, [made(tmp_path, 5, alpha=0.401)])
    assert found.changed
    columns = {difference.column for difference in found.differences}
    assert columns == {"resolved", "alpha", "hit, correct"}
    assert "6 of 6 rows differ in what is counted" in verdict(found)
    (table,) = [t for t in shown.tables(found) if t.title.startswith("Counts")]
    assert ["hall, left, paper", "alpha", "0.4", "0.401"] in table.rows


def test_an_ending_that_only_one_run_has_is_a_difference(three):
    run = three[0]
    verdicts = run.verdicts.assign(status="MISS")
    found = compare_runs([run], [dataclasses.replace(run, verdicts=verdicts)])
    assert {d.column: (d.before, d.after) for d in found.differences} == {
        "hit, correct": ([400], [0]), "miss, correct": ([0], [400]),
    }  # fmt: skip


def test_rows_of_one_side_are_listed(three, tmp_path):
    other = made(tmp_path, 5, techniques=("paper", "slope"), cameras=("left", "front"))
    found = compare_runs(three[:1], [other])
    assert len(found.alone[0]) == 6 - 1 + 2 * 4  # and the four times that no technique has
    before, new = ({(r["camera"], r["technique"]) for r in side} for side in found.alone)
    assert ("left", "hiz") in before
    assert ("top", "paper") in before
    assert ("left", "slope") in new
    assert ("front", "paper") in new
    assert found.counted == 1
    (table,) = [t for t in shown.tables(found) if t.title.startswith("Rows")]
    assert ["hall, left, hiz", "before"] in table.rows


def test_a_time_that_one_side_has_alone_is_listed(three):
    run = three[0]
    samples = run.samples[run.samples.stage != "pyramid"]
    found = compare_runs([run], [dataclasses.replace(run, samples=samples)])
    assert {row["timing"] for row in found.alone[0]} == {"pyramid"}
    assert found.alone[1] == []


def test_what_both_runs_warn_of_is_repeated(three, tmp_path):
    noisy = made(tmp_path, 5, warnings=["the machine is busy"], environment={
        "git": "0123456789abcdef with changes", "packages": {"numba": "1"}, "cpu": "another CPU",
    }.items())  # fmt: skip
    found = compare_runs(three[:1], [noisy])
    said = " ".join(shown.warnings(found))
    assert f"{noisy.name}: the machine is busy" in said
    assert "differ in commit: unknown before, 0123456789ab after" in said
    assert "checkout with changes" in said
    assert "differ in numba: 0 before, 1 after" in said
    assert "differ in processor: a CPU before, another CPU after" in said
    assert "machines are not the same" in verdict(found)
    swapped = compare_runs([noisy], three[:1])
    assert f"{noisy.name}: the machine is busy" in " ".join(swapped.warnings)


def test_other_settings_of_the_experiment_are_warned_of(three):
    run = three[0]
    meta = {**run.meta, "spec": {**run.meta["spec"], "derivatives": "quad"}, "finished": False}
    found = compare_runs([run], [dataclasses.replace(run, meta=meta)])
    said = " ".join(found.warnings)
    assert "'derivatives' of the experiment: unknown before, quad after" in said
    assert "not finished" in said
    assert "stands on both sides" in said


def test_what_cannot_be_compared_is_refused(three):
    run = three[0]
    with pytest.raises(hrt.ArgumentError, match="twice"):
        compare_runs([run, run], three[1:])
    with pytest.raises(hrt.ArgumentError, match="at least one run"):
        compare_runs([], three)
    other = dataclasses.replace(run, meta={**run.meta, "kind": "error"})
    with pytest.raises(hrt.ArgumentError, match=r"of one kind .*'paper'.*'error'"):
        compare_runs([run], [other])
    broken = dataclasses.replace(run, samples=run.samples.assign(seconds=-1.0))
    with pytest.raises(ReportsError, match="not positive"):
        compare_runs([run], [broken])
    moved = dataclasses.replace(run, results=run.results.assign(scene="elsewhere"))
    with pytest.raises(hrt.ArgumentError, match="none in common"):
        compare_runs([run], [moved])


def test_runs_without_samples_are_compared_by_their_counts(three):
    bare = [dataclasses.replace(run, samples=run.samples.iloc[:0]) for run in three[:2]]
    found = compare_runs(bare[:1], bare[1:])
    assert not found.changed
    assert "no times were compared" in verdict(found)


def test_a_comparison_is_also_a_document_and_plain_data(three, after):
    found = compare_runs(three, after)
    said = json.loads(json.dumps(shown.data(found), allow_nan=False))
    assert said["changed"] is True
    assert said["verdict"] == verdict(found)
    assert [c["timing"] for c in said["changes"]][:1] == ["march"]
    text = shown.document(found)
    assert text.count("hall, top") == text.count("hall, left") >= 2 * 6
    assert all(len(row) == 6 for row in shown.tables(found, every=True)[1].rows)


def command(*words):
    import typer

    from hybrid_rt_bench.cli import compare as module

    seen = {}

    def spy(runs: list[str], to: list[str] = typer.Option(None, "--to")):  # noqa: B008
        seen["sides"] = module._sides(runs, to)

    app = typer.Typer()
    app.command(cls=ManyRuns)(spy)
    app(list(words), standalone_mode=False)
    return seen["sides"]


def test_both_sides_may_have_several_runs():
    assert command("a", "b") == (["a"], ["b"])
    assert command("a", "b", "c", "--to", "d", "e") == (["a", "b", "c"], ["d", "e"])
    assert command("a", "--to", "d", "--to", "e") == (["a"], ["d", "e"])
    assert command("a", "--to=d", "e") == (["a"], ["d", "e"])
    with pytest.raises(hrt.ArgumentError, match="3 and no --to"):
        command("a", "b", "c")
