"""``hybrid-rt run scaling``, a very small one, from the command line to its report."""

import json
import os
import subprocess
import sys

import pandas as pd
import psutil
import pytest

from hybrid_rt_bench import cli
from hybrid_rt_bench.executors.processes import Worker, WorkerError
from hybrid_rt_bench.kinds.scaling import run as scaling_run
from support import PYTHONPATH

TINY = """
schema = 1
kind = "scaling"
name = "tiny"
title = "A tiny experiment"
techniques = ["paper", "certified"]
rounds = 2
selection_rays = 1024
[[series]]
name = "size"
axis = "triangles"
scene = "street"
camera = "along"
triangles = "2^10..2^12"
resolutions = ["64x48"]
brute_force = { rays = 64, seconds = 60.0 }
[[series]]
name = "picture"
axis = "pixels"
scene = "cornell"
resolutions = ["64x48", "96x64"]
build = false
[[series]]
name = "cores"
axis = "threads"
scene = "cornell"
threads = [1]
resolutions = ["64x48"]
"""


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", *map(str, arguments)])
    try:
        cli.main()
        code = 0
    except SystemExit as stopped:
        code = stopped.code
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.fixture
def experiment(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    return path


@pytest.mark.slow
def test_a_run_is_measured_kept_shown_again_and_compared(monkeypatch, capsys, tmp_path, experiment):
    code, out, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--out", tmp_path, "--json"
    )
    assert code == 0, err
    assert "size: round 2 of 2 done" in err
    assert "picture, 96x64: raster" in err
    summary = json.loads(out)
    assert (summary["measured"], summary["failed"]) == (6, 0)
    folder = tmp_path / summary["run"]
    results = pd.read_parquet(folder / "results.parquet")
    cells = results.drop_duplicates(["series", "x"])
    assert list(cells[cells.series == "size"].triangles) == [1024, 2048, 4096]
    assert list(cells[cells.series == "picture"].x) == [64 * 48, 96 * 64]
    assert set(results[results.series == "size"].stage) >= {"build", "brute_force", "prepare"}
    assert "build" not in set(results[results.series == "picture"].stage)
    assert (results.ms > 0).all()
    assert set(results.rounds) == {2}
    assert results.alpha.max() <= 1
    samples = pd.read_parquet(folder / "samples.parquet")
    counts = samples.groupby(["series", "x", "technique", "stage", "phase"]).size()
    assert set(counts) == {2}
    meta = json.loads((folder / "run.json").read_text())
    assert (meta["kind"], meta["finished"]) == ("scaling", True)
    assert set(meta["compile_seconds"]) == {"raster and Embree", "paper", "certified"}
    assert all(cell["compile_seconds"] >= 0 for cell in meta["cells"])
    text = (folder / "tables.md").read_text()
    for title in ("Growth from", "Exponents: time as a power of pixels", "Peak memory"):
        assert f"### {title}" in text
    assert {path.name for path in (folder / "figures").iterdir()} == {
        f"{name}.{ending}"
        for name in ("scaling-size", "scaling-picture", "scaling-cores", "memory")
        for ending in ("png", "svg")
    }

    (folder / "tables.md").unlink()
    code, out, _ = run(monkeypatch, capsys, "report", folder)
    assert code == 0
    assert "Exponents: time as a power of triangles" in out
    assert (folder / "tables.md").read_text() == text

    code, out, _ = run(monkeypatch, capsys, "compare", folder, folder)
    assert code == 0
    assert "No change" in out
    assert "stands on both sides" in out


@pytest.mark.slow
def test_what_is_measured_can_be_chosen(monkeypatch, capsys, tmp_path, experiment):
    code, out, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--series", "triangles",
        "--triangles", "2^10,3000", "--rounds", 1, "--out", tmp_path, "--json",
    )  # fmt: skip
    assert code == 0, err
    summary = json.loads(out)
    meta = json.loads((tmp_path / summary["run"] / "run.json").read_text())
    assert [(cell["series"], cell["x"]) for cell in meta["cells"]] == [
        ("size", 1024),
        ("size", 3000),
    ]
    assert meta["spec"]["series"][0]["triangles"] == [1024, 3000]


@pytest.mark.slow
def test_a_cell_that_fails_costs_only_itself(monkeypatch, capsys, tmp_path, experiment):
    experiment.write_text(TINY.replace('"2^10..2^12"', "[7, 1024]"))
    code, out, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--series", "size", "--rounds", 1,
        "--out", tmp_path, "--json",
    )  # fmt: skip
    assert code == 3
    assert "failed: size, 7: size: expected" in err
    summary = json.loads(out)
    assert (summary["measured"], summary["failed"]) == (1, 1)
    assert "- size, 7: size: expected" in (tmp_path / summary["run"] / "tables.md").read_text()


@pytest.mark.slow
def test_a_process_that_ends_keeps_its_rounds_and_costs_no_other(
    monkeypatch, capsys, tmp_path, experiment
):
    class Frail(Worker):
        def ask(self, number, warmup):
            if number == 1 and not Frail.lost:
                Frail.lost = True
                self.process.kill()
            return super().ask(number, warmup)

    Frail.lost = False
    monkeypatch.setattr(scaling_run, "Worker", Frail)
    code, out, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--series", "size",
        "--triangles", "2^10,2^12", "--out", tmp_path, "--json",
    )  # fmt: skip
    assert code == 3
    assert "failed: size, 2^12: in round 2 of 2: the process of the cell was ended by" in err
    folder = tmp_path / json.loads(out)["run"]
    rounds = pd.read_parquet(folder / "results.parquet").groupby("x").rounds.max()
    assert dict(rounds) == {1024: 2, 4096: 1}


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_measured_and_ends_the_processes(
    monkeypatch, capsys, tmp_path, experiment
):
    made = []

    class Stopped(Worker):
        def __init__(self, make, task):
            super().__init__(make, task)
            made.append(self)

        def ask(self, number, warmup):
            if number == 1:
                raise KeyboardInterrupt
            return super().ask(number, warmup)

    monkeypatch.setattr(scaling_run, "Worker", Stopped)
    code, _, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--series", "picture",
        "--out", tmp_path,
    )  # fmt: skip
    assert code == 130
    assert "stopped: 2 finished cells kept" in err
    assert len(made) == 2
    assert not any(worker.process.is_alive() for worker in made)
    folder = next(path.parent for path in tmp_path.glob("*/run.json"))
    assert json.loads((folder / "run.json").read_text())["interrupted"]
    assert set(pd.read_parquet(folder / "results.parquet").rounds) == {1}


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="prctl is Linux's")
def test_no_process_outlives_a_run_that_is_killed(tmp_path, experiment):
    experiment.write_text(TINY.replace("rounds = 2", "rounds = 100000"))
    started = subprocess.Popen(
        [sys.executable, "-m", "hybrid_rt_bench", "run", str(experiment), "--series", "cores",
         "--threads", "1", "--out", str(tmp_path)],
        env=os.environ | {"PYTHONPATH": PYTHONPATH}, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        for line in started.stderr:
            if "round 1 of" in line:
                break
        parent = psutil.Process(started.pid)
        cells = [child for child in parent.children() if "spawn_main" in " ".join(child.cmdline())]
        assert cells
    finally:
        started.kill()
        started.wait()
        started.stderr.close()
    _, alive = psutil.wait_procs(cells, timeout=20)
    assert not alive
    results = pd.read_parquet(next(tmp_path.glob("*/results.parquet")))
    assert results.rounds.min() >= 1


def test_a_run_of_which_nothing_was_measured_is_a_failure(
    monkeypatch, capsys, tmp_path, experiment
):
    class Dead(Worker):
        def ready(self):
            raise WorkerError("it was dead on arrival")

    monkeypatch.setattr(scaling_run, "Worker", Dead)
    code, _, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--series", "cores",
        "--out", tmp_path,
    )  # fmt: skip
    assert code == 3
    assert "failed: cores, 1: it was dead on arrival" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--series", "sizes"], "did you mean 'size'"),
        (["--triangles", "many"], "--triangles: expected numbers such as 4096"),
        (["--scenes", "sphere"], "--scenes"),
        (["--resolutions", "64"], "WIDTHxHEIGHT"),
    ],
)
def test_wrong_options_are_refused_before_measuring(
    monkeypatch, capsys, tmp_path, experiment, arguments, message
):
    code, _, err = run(
        monkeypatch, capsys, "run", experiment, *arguments, "--out", tmp_path / "out"
    )
    assert code == 2
    assert message in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("option", ["--series", "--triangles"])
def test_its_options_are_no_other_kinds(monkeypatch, capsys, tmp_path, option):
    code, _, err = run(monkeypatch, capsys, "run", "paper", option, "2^10", "--out", tmp_path)
    assert code == 2
    assert f"{option}: expected an option that kind 'paper' has" in err
