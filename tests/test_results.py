"""docs/results and the findings in README are what `make results` makes of the committed runs."""

import json
import os
import re
import shutil
import subprocess
import sys

import pandas as pd
import pytest

import docs_results
import reference_runs
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.registry import kinds
from hybrid_rt_bench.runs import read_run, render_run
from hybrid_rt_scenes import get_scene
from support import PYTHONPATH, ROOT

COMMITTED = docs_results.committed()
SMALL = 600_000
"""Bytes that no committed file of a run exceeds."""


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """Return runs of a tiny picture, kept as the reference runs are."""
    folder = tmp_path_factory.mktemp("results")
    for name in ("error", "hybrid"):
        words = (
            "run", name, "--quick", "--scenes", "sphere", "--cameras", "front,low",
            "--resolutions", "64x36", "--rounds", "2", "--threads", "1", "--out", folder, "--json",
        )  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-m", "hybrid_rt_bench", *map(str, words)],
            env=os.environ | {"PYTHONPATH": PYTHONPATH},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        kept = folder / "docs" / name
        kept.mkdir(parents=True)
        (kept / "old.txt").write_text("of the run before")
        reference_runs.keep(folder / json.loads(done.stdout)["run"], kept)
    return docs_results.committed(folder / "docs")


@pytest.mark.slow
def test_what_is_kept_of_a_run_is_small_and_renders_the_same_each_time(tiny, tmp_path):
    for name, run in tiny.items():
        held = {path.name for path in run.folder.iterdir()}
        assert held == set(reference_runs.KEPT), name
        first, _ = render_run(run)
        text = (run.folder / "tables.md").read_bytes()
        shutil.copytree(run.folder, tmp_path / name, ignore=shutil.ignore_patterns("tables.md"))
        again, _ = render_run(read_run(tmp_path / name))
        assert (tmp_path / name / "tables.md").read_bytes() == text
        assert [table.title for table in first] == [table.title for table in again]


@pytest.mark.slow
def test_findings_are_the_sums_of_the_rows(tiny):
    said = docs_results.findings(tiny, "docs/")
    rows = pd.read_parquet(tiny["error"].folder / "results.parquet")
    certified = rows[(rows.technique == "certified") & rows.default]
    answers = int(certified.resolved.sum())
    assert certified.false_hit.sum() == 0
    assert f"None of {answers:,} certified answers to 3 kinds of rays" in said
    assert f"at most {3 / answers:.1e} of them at 95 %" in said
    paper = rows[(rows.technique == "paper") & rows.default & (rows.workload == "mirror")]
    wrong = 100 * (paper.false_hit.sum() + paper.false_miss.sum()) / paper.rays.sum()
    assert f"the paper's march {wrong:.2g} %" in said
    assert f"Of {paper.rays.sum():,} mirror rays in 2 views of sphere" in said
    hybrid = pd.read_parquet(tiny["hybrid"].folder / "results.parquet")
    default = hybrid[(hybrid.technique == "certified") & hybrid.default].speedup
    mean = default.prod() ** (1 / len(default))
    assert f"sphere {mean:.2f} by default" in said


@pytest.mark.slow
def test_the_folder_of_a_run_is_read_as_the_guide_says(tiny, capsys):
    guide = (ROOT / "docs" / "howto.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```py\n(.*?)```", guide, flags=re.DOTALL)
    (path,) = re.findall(r'^folder = "(.*)"$', block, flags=re.MULTILINE)
    exec(compile(block.replace(path, str(tiny["error"].folder)), "howto.md", "exec"), {})
    assert re.search(r"^sphere +0\.\d+$", capsys.readouterr().out, flags=re.MULTILINE)


@pytest.mark.slow
def test_findings_go_between_their_marks(tiny):
    text = f"# Head\n{docs_results.BEGIN}old figures\n{docs_results.END}tail\n"
    made = docs_results.with_findings(text, tiny)
    assert made.startswith("# Head\n")
    assert made.endswith("tail\n")
    assert "old figures" not in made
    assert "certified answers" in made
    assert docs_results.with_findings(made, tiny) == made


def test_readme_and_index_are_those_of_the_committed_runs():
    text = docs_results.README.read_text(encoding="utf-8")
    assert docs_results.with_findings(text, COMMITTED) == text, "run `make results`"
    index = (docs_results.RESULTS / "README.md").read_text(encoding="utf-8")
    assert docs_results.index(COMMITTED) == index, "run `make results`"


@pytest.mark.parametrize("name", reference_runs.RUNS)
def test_a_committed_run_is_rendered_as_it_is_now(name, tmp_path):
    if name not in COMMITTED:
        pytest.skip(f"no run {name!r} is committed in docs/results yet")
    folder = COMMITTED[name].folder
    assert all(path.stat().st_size < SMALL for path in folder.rglob("*.*")), "too large to commit"
    shutil.copytree(folder, tmp_path / name, ignore=shutil.ignore_patterns("tables.md", "figures"))
    render_run(read_run(tmp_path / name))
    text = (folder / "tables.md").read_bytes()
    assert (tmp_path / name / "tables.md").read_bytes() == text, "run `make results`"
    figures = [
        {path.relative_to(root).as_posix() for path in root.rglob("figures/**/*.*")}
        for root in (folder, tmp_path / name)
    ]
    assert figures[0] == figures[1], "run `make results`"


@pytest.mark.parametrize("name", reference_runs.RUNS)
def test_the_commands_of_the_reference_runs_can_be_run(name):
    """Their options are those of their kinds, their scenes and cameras exist."""
    command, experiment, *words = reference_runs.RUNS[name].split()
    assert (command, experiment) == ("run", name)
    known = {f"--{option.name}" for option in kinds[name].options}
    options = dict(zip(words[::2], words[1::2], strict=True))
    assert set(options) <= known
    for size in filter(None, options.get("--resolutions", "").split(",")):
        Resolution.parse("--resolutions", size)
    scenes = options.get("--scenes", "nori_sphere,sponza,bistro").split(",")
    cameras = {camera for scene in scenes for camera in get_scene(scene).cameras}
    assert set(filter(None, options.get("--cameras", "").split(","))) <= cameras


def test_no_other_figures_are_in_readme():
    """Outside of the findings, code and links README cites no measured number."""
    text = docs_results.README.read_text(encoding="utf-8")
    text = text.split(docs_results.BEGIN)[0] + text.split(docs_results.END)[1]
    text = re.sub(r"```.*?```|`[^`]*`|\(http[^)]*\)|\]\([^)]*\)", "", text, flags=re.DOTALL)
    for unit in (r"%", r"ms\b", r"ns\b", r"times as"):
        assert not re.search(rf"\d\s*{unit}", text), unit


def test_readme_is_short():
    assert len(docs_results.README.read_text(encoding="utf-8").splitlines()) < 120
