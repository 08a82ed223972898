"""The technique of docs/techniques.md: installed beside the project, it is one like all others."""

import json
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

import hybrid_rt as hrt
from support import PYTHONPATH, ROOT, synthetic

SOURCE = ROOT / "docs" / "technique"


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Install the example with pip and return the environment of a process that sees it."""
    folder = tmp_path_factory.mktemp("technique")
    shutil.copytree(SOURCE, folder / "source", ignore=shutil.ignore_patterns("__pycache__"))
    done = subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation",
         "--no-index", "--target", folder / "target", folder / "source"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    paths = os.pathsep.join((str(folder / "target"), PYTHONPATH))
    return os.environ | {"PYTHONPATH": paths, "COLUMNS": "160"}


def command(environment, *words):
    done = subprocess.run(
        [sys.executable, "-m", "hybrid_rt_bench", *map(str, words)],
        capture_output=True, text=True, check=False, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_it_is_listed(installed):
    shown = command(installed, "list")
    assert re.search(r"\bdots\b", shown)
    assert "A few points of the ray" in shown


@pytest.mark.slow
def test_it_is_measured_and_plotted_beside_the_others(installed, tmp_path):
    told = command(
        installed, "run", "error", "--techniques", "dots,paper", "--scenes", "sphere",
        "--cameras", "front", "--resolutions", "96x54", "--rounds", "2", "--threads", "1",
        "--out", tmp_path, "--json",
    )  # fmt: skip
    folder = tmp_path / json.loads(told)["run"]
    tables = (folder / "tables.md").read_text()
    for label in ("8 points", "24 points", "96 points"):
        assert label in tables
    assert "paper" in tables
    assert any((folder / "figures").iterdir())


@pytest.fixture
def dots(monkeypatch):
    """The class itself, from its source."""
    monkeypatch.syspath_prepend(str(SOURCE))
    from hybrid_rt_dots import Dots

    return Dots


def test_it_answers_as_it_says(dots):
    depth = np.full((48, 64), 0.02)
    depth[:, 40:] = 0.05  # a wall nearer than the one behind
    buffer = synthetic.gbuffer(depth)
    start, end = hrt.unproject(buffer.camera, [[10.5, 24.5, 0.05], [60.5, 24.5, 0.04]])
    rays = hrt.Rays.from_arrays([start, start], [end - start, start - end])
    few, many = (
        hrt.march(rays, hrt.prepare(buffer, technique))
        for technique in (dots(samples=1), dots(samples=400, thickness=0.5))
    )
    assert not few.resolved.any()
    assert many.resolved.tolist() == [True, False]
    assert many.pixel[0, 0] >= 40
    assert many.prim_id[0] == buffer.prim_id[many.pixel[0, 1], many.pixel[0, 0]]
    assert 0 < many.t_free[0] < many.t[0] < 1


def test_the_page_shows_what_is_there():
    page = (ROOT / "docs" / "techniques.md").read_text()
    project = (SOURCE / "pyproject.toml").read_text()
    for block in re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL):
        assert block in project
    for link in re.findall(r"\]\((technique/[^)]*)\)", page):
        assert (ROOT / "docs" / link).exists()
    for name in re.findall(r"^\| `(\w+)", page, flags=re.MULTILINE):
        assert hasattr(hrt.Technique, name) or name in hrt.Technique.__annotations__, name
