"""``hybrid-rt run error``, a very small one, from the command line to its report."""

import json
import sys

import pandas as pd
import pytest

from hybrid_rt_bench import cli
from hybrid_rt_bench.judged import cell as error_cell

TINY = """
schema = 1
kind = "error"
name = "tiny"
title = "A tiny experiment"
techniques = ["paper", "hiz", "certified"]
counted = ["paper", "certified"]
resolutions = ["64x48", "80x60"]
timed = ["64x48"]
picture = "64x48"
rounds = 2
cameras = 1
selection_rays = 1024
[[workloads]]
name = "mirror"
[[workloads]]
name = "ambient_occlusion"
[[scenes]]
name = "cornell"
[[scenes]]
name = "sphere"
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
def test_a_run_is_measured_kept_and_shown_again(monkeypatch, capsys, tmp_path, experiment):
    code, out, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--out", tmp_path, "--json"
    )
    assert code == 0, err
    assert "100 % done" in err
    summary = json.loads(out)
    assert (summary["measured"], summary["failed"]) == (8, 0)
    folder = tmp_path / summary["run"]
    results = pd.read_parquet(folder / "results.parquet")
    timed = results[results.timed]
    assert set(timed.technique) == {"paper", "hiz", "certified", "embree"}
    assert set(results[~results.timed].technique) == {"paper", "certified"}
    assert set(timed.width) == {64}
    certified = results[results.technique == "certified"]
    wrong = ["false_hit", "false_miss", "wrong_primitive"]
    assert certified.resolved.sum() > 1000
    assert (certified[wrong].to_numpy() == 0).all()
    samples = pd.read_parquet(folder / "samples.parquet")
    assert len(samples) == 2 * len(timed)
    meta = json.loads((folder / "run.json").read_text())
    assert set(meta["compile_seconds"]) == {
        "raster", "paper", "hiz", "certified", "mirror rays", "ambient_occlusion rays"
    }  # fmt: skip
    assert {cell["timed"] for cell in meta["cells"]} == {True, False}
    text = (folder / "tables.md").read_text()
    assert "### Speed against error" in text
    assert (folder / "figures" / "errors-cornell-front.png").is_file()

    (folder / "tables.md").unlink()
    code, out, _ = run(monkeypatch, capsys, "report", folder)
    assert code == 0
    assert "Speed against error" in out
    assert (folder / "tables.md").read_text() == text


@pytest.mark.slow
def test_a_cell_that_raises_costs_only_itself(monkeypatch, capsys, tmp_path, experiment):
    measure_cell = error_cell.measure_cell

    def breaks(loaded, screens, cell, *rest):
        if len(loaded.scene) > 100 and screens.gbuffer.camera.width == 64 and cell.picture:
            raise RuntimeError("the lens fell off")
        return measure_cell(loaded, screens, cell, *rest)

    monkeypatch.setattr(error_cell, "measure_cell", breaks)
    code, out, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--rounds", 1,
        "--out", tmp_path, "--json",
    )  # fmt: skip
    assert code == 3
    assert "failed: sphere, front, 64x48, mirror: RuntimeError: the lens fell off" in err
    summary = json.loads(out)
    assert (summary["measured"], summary["failed"]) == (7, 1)


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_finished(monkeypatch, capsys, tmp_path, experiment):
    measure_cell, done = error_cell.measure_cell, []

    def stops(*arguments):
        if len(done) == 11:  # three techniques and two workloads, each twice, and one cell
            raise KeyboardInterrupt
        done.append(1)
        return measure_cell(*arguments)

    monkeypatch.setattr(error_cell, "measure_cell", stops)
    code, _, err = run(
        monkeypatch, capsys, "run", experiment, "--threads", 1, "--rounds", 1, "--out", tmp_path
    )
    assert code == 130
    assert "stopped: 1 finished cell kept" in err
    folder = next(path.parent for path in tmp_path.glob("*/run.json"))
    assert len(json.loads((folder / "run.json").read_text())["cells"]) == 1


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "mirror"', 'name = "miror"', "did you mean 'mirror'"),
        ('"hiz", ', '"hzi", ', "did you mean 'hiz'"),
        ('counted = ["paper", ', 'counted = ["slope", ', "counted: expected one of techniques"),
        ("rounds = 2", "rounds = 2\nround = 3", "did you mean 'rounds'"),
    ],
)
def test_wrong_settings_are_refused_before_measuring(
    monkeypatch, capsys, tmp_path, experiment, old, new, said
):
    experiment.write_text(TINY.replace(old, new))
    code, _, err = run(monkeypatch, capsys, "run", experiment, "--out", tmp_path / "out")
    assert code == 2
    assert said in err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "points", "title"),
    [
        ("ablation", "switches", "What each part of the certified march is worth"),
        ("hybrid", "cheapest", "Speed-up of the certified hybrid over the strongest Embree"),
    ],
)
def test_points_with_tables_of_their_own(monkeypatch, capsys, tmp_path, kind, points, title):
    """What `run ablation` and `run hybrid` do, on one small view at two sizes."""
    text = TINY.replace('"paper", "hiz", "certified"', '"certified", "paper"')
    text = text.replace('kind = "error"', f'kind = "{kind}"')
    text = text.replace('counted = ["paper", "certified"]', 'counted = ["certified"]')
    text = text.replace('timed = ["64x48"]', 'timed = ["64x48", "80x60"]\ncomplete = ["64x48"]')
    text = text.replace('picture = "64x48"\n', "").split("[[workloads]]")[0]
    text += f'[[workloads]]\nname = "mirror"\npoints = "{points}"\n[[scenes]]\nname = "cornell"\n'
    path = tmp_path / "tiny.toml"
    path.write_text(text)
    code, out, err = run(
        monkeypatch, capsys, "run", path, "--threads", 1, "--rounds", 1, "--out", tmp_path
    )
    assert code == 0, err
    assert "100 % done" in err
    assert title in out
    folder = next(path.parent for path in tmp_path.glob("*/run.json"))
    assert f"### {title}" in (folder / "tables.md").read_text()
    results = pd.read_parquet(folder / "results.parquet")
    by_size = {width: set(part.technique) for width, part in results.groupby("width")}
    assert by_size == {64: {"certified", "paper", "embree"}, 80: {"certified"}}
    certified = results[results.technique == "certified"]
    assert (certified[["false_hit", "false_miss", "wrong_primitive"]].to_numpy() == 0).all()
    assert certified.resolved.sum() > 1000
    assert "flip" not in results
    assert not (folder / "pictures").exists()
