"""``hybrid-rt run stability``, in this process."""

import json
import sys

import pandas as pd
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench import cli
from hybrid_rt_bench.kinds.stability import run as stability

CASES = "screen_axes,parallel_to_image,zero_area"


def invoke(monkeypatch, *arguments):
    """Return the exit code of a command line."""
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", *map(str, arguments)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    return stopped.value.code


@pytest.fixture
def only_paper(monkeypatch):
    """Let these be all techniques there are."""
    techniques = {"paper": hrt.Paper}
    monkeypatch.setattr(stability, "TECHNIQUES", techniques)
    return techniques


def test_other_techniques_may_fail(monkeypatch, tmp_path, capsys, only_paper):
    code = invoke(
        monkeypatch, "run", "stability", "--cases", CASES, "--threads", 1, "--out", tmp_path
    )
    printed = capsys.readouterr()
    assert code == 0, printed.err
    assert "FAIL 46/1200" in printed.out  # Embree's robust mode hits triangles without area
    (folder,) = tmp_path.iterdir()
    results = pd.read_parquet(folder / "results.parquet")
    assert set(results.technique) == {"paper", "embree default", "embree robust"}
    states = results.set_index(["case", "technique"]).state
    assert states["screen_axes", "paper"] == "fail"
    assert states["parallel_to_image", "paper"] == "pass"
    kinds = ["unresolved", "correct", "tie", "false_hit", "false_miss", "wrong_primitive"]
    assert (results.rays == results[[*kinds, "imprecise"]].sum(axis=1)).all()
    meta = json.loads((folder / "run.json").read_text())
    assert (meta["kind"], meta["finished"]) == ("stability", True)
    assert meta["environment"]["threads"] == 1
    assert (folder / "results.csv").is_file()

    (folder / "tables.md").unlink()
    assert invoke(monkeypatch, "report", folder) == 0
    text = (folder / "tables.md").read_text()
    assert "\n| zero_area " in text
    assert "- **zero_area**: Triangles without area" in text
    assert "**Verdict.** Of 3 entrants" in text
    assert "Of 3 entrants (techniques and tracers) on 3 hard cases" in " ".join(printed.out.split())
    assert (folder / "figures" / "stability.png").stat().st_size > 5000

    assert invoke(monkeypatch, "compare", folder, folder) == 0
    assert "No change: the counts of 9 rows are the same" in capsys.readouterr().out


def test_a_promise_that_certified_breaks_gives_code_3(monkeypatch, tmp_path, capsys, only_paper):
    """A march that proves nothing, under the name of the one that does."""

    class Unproven(hrt.Paper):
        name = "certified"

    only_paper["certified"] = Unproven
    code = invoke(monkeypatch, "run", "stability", "--cases", CASES, "--out", tmp_path, "--json")
    printed = capsys.readouterr()
    assert code == 3
    assert (
        "certified fails 3 of 3 hard cases: screen_axes, parallel_to_image, zero_area"
        in printed.err
    )
    summary = json.loads(printed.out)
    assert summary["broken"]
    assert summary["failed"] == 0
    exact = {row["technique"]: row["exact"] for row in summary["results"]}
    assert exact == {
        "paper": False, "certified": True, "embree default": True, "embree robust": True
    }  # fmt: skip


def test_a_technique_that_raises_fails_its_cases_only(monkeypatch, tmp_path, capsys, only_paper):
    class Broken(hrt.Paper):
        name = "broken"

        def _march(self, *_):
            raise ValueError("no samples today")

    only_paper["broken"] = Broken
    code = invoke(monkeypatch, "run", "stability", "--cases", "screen_axes", "--out", tmp_path)
    printed = capsys.readouterr()
    assert code == 0
    assert "broken raised an error on screen_axes: ValueError: no samples today" in printed.err
    (folder,) = tmp_path.iterdir()
    states = pd.read_parquet(folder / "results.parquet").set_index("technique").state
    assert states["broken"] == "error"
    assert states["paper"] == "fail"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["stability", "--cases", "silvers"], "did you mean 'slivers'"),
        (["stability", "--rounds", 3], "--rounds"),
        (["stability", "--scenes", "sphere"], "--scenes"),
        (["paper", "--cases", "slivers"], "--cases"),
    ],
)
def test_options_of_the_other_kind_and_unknown_cases_are_refused(
    monkeypatch, tmp_path, capsys, arguments, message
):
    assert invoke(monkeypatch, "run", *arguments, "--out", tmp_path) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
