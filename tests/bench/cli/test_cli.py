"""The command line, end to end in a subprocess and, for what ends at once, in process."""

import errno
import json
import os
import signal
import subprocess
import sys
import time

import pandas as pd
import pytest
from PIL import Image

from hybrid_rt_bench import cli
from hybrid_rt_bench.kinds.paper import cell as measure
from hybrid_rt_bench.kinds.paper.columns import STAGES
from hybrid_rt_bench.results.schema import HYBRID_STAGES

TINY = ("--resolutions", "96x54", "--threads", "1")


def command(*arguments):
    return [sys.executable, "-m", "hybrid_rt_bench", *map(str, arguments)]


def environment():
    paths = [p for p in sys.path if p]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "COLUMNS": "100"}


def shell(*arguments):
    return subprocess.run(
        command(*arguments), capture_output=True, text=True, env=environment(), timeout=300
    )


@pytest.fixture
def usage_error(monkeypatch, capsys):
    """Run a command line that must be refused before anything is measured."""

    def refuse(*arguments, code=2):
        monkeypatch.setattr(sys, "argv", ["hybrid-rt", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        captured = capsys.readouterr()
        assert stopped.value.code == code, captured.err
        assert "Traceback" not in captured.err
        assert captured.out == ""
        return captured.err

    return refuse


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Run one good scene and one that breaks, with JSON on stdout."""
    folder = tmp_path_factory.mktemp("reports")
    broken = folder / "broken.obj"
    broken.write_text("v 0 0 0\nf 1 2 3\n")
    done = shell(
        "run", "paper", *TINY, "--scenes", f"{broken},sphere", "--cameras", "front,low",
        "--rounds", 2, "--out", folder / "out", "--json",
    )  # fmt: skip
    return done, folder / "out"


def test_a_failing_scene_gives_code_3_and_costs_only_itself(finished):
    done, out = finished
    assert done.returncode == 3, done.stderr
    assert "failed: broken" in done.stderr
    assert "Traceback" not in done.stderr
    summary = json.loads(done.stdout)
    assert (summary["measured"], summary["failed"]) == (2, 1)
    meta = json.loads((out / summary["run"] / "run.json").read_text())
    assert [cell["state"] for cell in meta["cells"]] == ["failed", "measured", "measured"]
    assert "broken" in meta["cells"][0]["error"]
    assert meta["finished"]
    assert meta["environment"]["threads"] == 1
    assert meta["compile_seconds"]


def test_every_stage_of_every_round_is_kept(finished):
    done, out = finished
    folder = out / json.loads(done.stdout)["run"]
    samples = pd.read_parquet(folder / "samples.parquet")
    counts = samples.groupby(["camera", "stage", "phase"]).size().unstack()
    assert set(samples.stage) == set(STAGES)
    assert (counts["measured"] == 2).all()
    assert (counts["warmup"] == 2).all()
    assert (samples.seconds > 0).all()
    mine = samples.technique == "paper"
    assert set(samples[mine].stage) == {"pyramid", *HYBRID_STAGES}


def test_results_agree_with_the_verdicts(finished):
    done, out = finished
    summary = json.loads(done.stdout)
    verdicts = pd.read_parquet(out / summary["run"] / "verdicts.parquet")
    for row in summary["results"]:
        mine = verdicts[verdicts.camera == row["camera"]].set_index(["status", "verdict"])["count"]
        assert mine.sum() == row["rays"]
        unresolved = mine.xs("UNRESOLVED", level="verdict").sum()
        assert row["alpha"] == pytest.approx(1 - unresolved / row["rays"])
        assert row["resolved"] == row["rays"] - unresolved
        assert 0 < row["alpha"] < 1
        hybrid = sum(row[f"{stage}_ms"] for stage in HYBRID_STAGES)
        assert row["hybrid_ms"] == pytest.approx(hybrid, rel=0.5)


def test_tables_and_figures_are_written(finished):
    done, out = finished
    folder = out / json.loads(done.stdout)["run"]
    text = (folder / "tables.md").read_text()
    for title in ("Table 1.", "Table 2.", "Table 3.", "Alpha", "Errors", "Raster against"):
        assert f"### {title}" in text
    flat = " ".join(text.split())
    assert f"**Verdict.** {json.loads(done.stdout)['verdict']} Run `" in flat
    figures = {p.name for p in (folder / "figures").iterdir()}
    for name in ("paper-sphere-front", "paper-sphere-low", "alpha-by-camera"):
        assert {f"{name}.png", f"{name}.svg"} <= figures


def test_report_renders_an_old_run_and_compare_compares_it(finished, monkeypatch, capsys):
    done, out = finished
    name = json.loads(done.stdout)["run"]
    (out / name / "tables.md").unlink()
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", "report", name, "--out", str(out)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 0
    printed = capsys.readouterr().out
    assert "Table 3" in printed
    last = printed.strip().split("\n\n")[-1]  # what a reader takes home comes last
    assert " ".join(last.split()) == json.loads(done.stdout)["verdict"]
    assert (out / name / "tables.md").is_file()
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", "compare", name, name, "--out", str(out)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 0
    assert "No change" in capsys.readouterr().out


@pytest.mark.slow
def test_ctrl_c_keeps_finished_cells(tmp_path):
    process = subprocess.Popen(
        command(
            "run", "paper", "--threads", "1", "--scenes", "sphere", "--cameras", "front,low",
            "--resolutions", "96x54,1280x720", "--rounds", 60, "--out", tmp_path,
        ),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(),
    )  # fmt: skip
    for line in process.stderr:
        if line.startswith("sphere, front, 96x54"):
            break
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=120)
    assert process.returncode == 130, rest
    assert "stopped: 1 finished cell" in rest
    assert "Traceback" not in rest
    folder = next(p.parent for p in tmp_path.glob("*/run.json"))
    meta = json.loads((folder / "run.json").read_text())
    assert meta["interrupted"]
    assert not meta["finished"]
    assert len(pd.read_parquet(folder / "results.parquet")) == 1
    assert "not finished" in (folder / "tables.md").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("what", ["status", "depth", "normals", "all"])
def test_render_writes_a_picture(tmp_path, what):
    path = tmp_path / "x.png"
    done = shell(
        "render", "sphere", "--camera", "front", "--size", "320x180", "--what", what, "-o", path
    )
    assert done.returncode == 0, done.stderr
    image = Image.open(path)
    assert image.width == (652 if what == "all" else 320)
    assert image.height > (180 if what != "all" else 360)  # a legend or a scale stands below
    assert len(set(image.convert("RGB").get_flattened_data())) > 100


def test_list_and_info_tell_what_is_there():
    listed, told = shell("list"), shell("info")
    assert (listed.returncode, told.returncode) == (0, 0)
    for word in (
        "sphere",
        "sponza",
        "front",
        "built in",
        "paper",
        "slope",
        "thickness 0.5 %",
        "shadow_area",
    ):
        assert word in listed.stdout
    assert "with a stage: the sphere alone is the paper's" in " ".join(listed.stdout.split())
    for word in ("embree", "numba", "cpu", "scenes"):
        assert word in told.stdout


@pytest.mark.parametrize(
    "arguments", [(), ("run",), ("report",), ("compare",), ("list",), ("info",), ("render",)]
)
def test_help_teaches(arguments, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", *arguments, "--help"])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 0
    text = capsys.readouterr().out
    assert "Usage" in text
    if arguments and arguments[0] not in ("list", "info"):
        assert f"hybrid-rt {arguments[0]} " in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("run", "papre"), "did you mean 'paper'"),
        (("run", "paper", "--scenes", "sponzza"), "did you mean 'sponza'"),
        (("run", "paper", "--scenes", "sphere", "--cameras", "frnt"), "did you mean 'front'"),
        (("run", "paper", "--scenes", "no/such.obj"), "no such file"),
        (("run", "paper", "--resolutions", "big"), "WIDTHxHEIGHT"),
        (("run", "paper", "--rounds", "0"), "--rounds"),
        (("run", "paper", "--scenes", "sphere", "--threads", "0"), "threads: expected 1 to"),
        (("run", "paper", "--scenes", ","), "--scenes"),
        (("run", "paper", "--quik"), "--quick"),
        (("render", "sphere", "-o", "x.gif"), ".png"),
        (("render", "sphere", "-o", "no/such/x.png"), "existing folder"),
        (("render", "sphere", "--camera", "frnt", "-o", "x.png"), "did you mean 'front'"),
        (("render", "spher", "-o", "x.png"), "did you mean 'sphere'"),
        (("render", "sphere", "--eye", "0,1", "--target", "0,0,0", "-o", "x.png"), "--eye: exp"),
        (("render", "sphere", "--eye", "0,1,2", "-o", "x.png"), "--target: expected X,Y,Z"),
        (
            ("render", "sphere", "--eye", "0,1,2", "--target", "0,1,2", "-o", "x.png"),
            "--target: expected a point other than eye",
        ),
        (
            (
                "render",
                "sphere",
                "--eye",
                "0,1,2",
                "--target",
                "0,0,0",
                "--fov",
                "180",
                "-o",
                "x.png",
            ),
            "--fov: expected a finite number",
        ),
        (
            (
                "render",
                "sphere",
                "--camera",
                "front",
                "--eye",
                "0,1,2",
                "--target",
                "0,0,0",
                "-o",
                "x.png",
            ),
            "--camera: expected none beside --eye",
        ),
        (("report", "no-such-run"), "unknown run"),
    ],
)
def test_wrong_usage_gives_code_2_and_says_what_was_meant(usage_error, arguments, said):
    assert said in usage_error(*arguments)


def test_a_directory_that_cannot_be_written_is_refused_before_measuring(usage_error, tmp_path):
    (tmp_path / "file").write_text("")
    said = usage_error("run", "paper", "--scenes", "sphere", "--out", tmp_path / "file" / "out")
    assert "out: expected a directory that can be written to" in said


def test_nothing_left_to_run_gives_code_3(usage_error, monkeypatch, tmp_path):
    monkeypatch.setenv("HYBRID_RT_DATA", str(tmp_path))
    said = usage_error("run", "paper", "--scenes", "sponza", "--out", tmp_path, code=3)
    assert "nothing left to run" in said
    assert "HYBRID_RT_DATA" in said
    assert usage_error("render", "sponza", "-o", tmp_path / "x.png", code=3)


@pytest.mark.slow
def test_a_cell_that_raises_costs_only_itself(monkeypatch, capsys, tmp_path):
    measure_cell = measure.measure_cell

    def breaks(loaded, camera, name, *rest):
        if name.startswith("sphere, low"):
            raise RuntimeError("the lens fell off")
        return measure_cell(loaded, camera, name, *rest)

    monkeypatch.setattr(measure, "measure_cell", breaks)
    arguments = ["run", "paper", *TINY, "--scenes", "sphere", "--cameras", "front,low,above"]
    monkeypatch.setattr(
        sys, "argv", ["hybrid-rt", *arguments, "--rounds", "1", "--out", str(tmp_path), "--json"]
    )
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    captured = capsys.readouterr()
    assert stopped.value.code == 3
    assert "failed: sphere, low, 96x54: RuntimeError: the lens fell off" in captured.err
    summary = json.loads(captured.out)
    assert [row["camera"] for row in summary["results"]] == ["front", "above"]


@pytest.mark.slow
def test_a_disk_that_fills_up_keeps_what_was_written(monkeypatch, capsys, tmp_path):
    replace, renamed = os.replace, []

    def full(source, target):
        renamed.append(target)
        if len(renamed) > 12:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        replace(source, target)

    monkeypatch.setattr(os, "replace", full)
    arguments = ["run", "paper", *TINY, "--scenes", "sphere", "--rounds", "1"]
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", *arguments, "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 3
    assert "No space left on device" in capsys.readouterr().err
    folder = next(p.parent for p in tmp_path.glob("*/run.json"))
    assert len(pd.read_parquet(folder / "results.parquet")) >= 1
    assert json.loads((folder / "run.json").read_text())["cells"]
