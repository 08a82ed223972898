"""The scripts of examples/ run as they are, need nothing but the library, and show something."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from support import PYTHONPATH, ROOT

SCRIPTS = {path.stem: path for path in sorted((ROOT / "examples").glob("*.py"))}


def run(name, folder, *words):
    """Run an example in an empty folder, without any real scene, and return what it printed."""
    nowhere = folder / "no scenes"
    done = subprocess.run(
        [sys.executable, SCRIPTS[name], *words],
        cwd=folder, env=os.environ | {"PYTHONPATH": PYTHONPATH, "HYBRID_RT_DATA": str(nowhere)},
        capture_output=True, text=True, check=False, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def assert_picture(path, colours=500):
    """A picture with so many colours at least, and contrast."""
    pixels = np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)
    assert len(np.unique(pixels, axis=0)) >= colours
    assert pixels.std() > 15


@pytest.mark.parametrize("name", sorted(SCRIPTS))
def test_it_is_short_and_listed(name):
    text = SCRIPTS[name].read_text()
    assert len(text.splitlines()) < 60
    assert f"{name}.py" in (ROOT / "examples" / "README.md").read_text()


@pytest.mark.slow
def test_own_mesh(tmp_path):
    said = run("own_mesh", tmp_path)
    assert re.search(r"answers [45-7]\d% of \d+ mirror rays", said)
    assert_picture(tmp_path / "own_mesh.png")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    run("own_mesh", tmp_path, "a.png", "a.obj")
    assert_picture(tmp_path / "a.png", colours=2)


@pytest.mark.slow
def test_own_depth_buffer(tmp_path):
    said = run("own_depth_buffer", tmp_path)
    shares = dict(re.findall(r"^(\w+) +answers ([\d.]+)%", said, flags=re.MULTILINE))
    assert sorted(shares) == ["linear", "paper", "slope"]
    assert all(25 < float(share) < 50 for share in shares.values())
    assert_picture(tmp_path / "own_depth_buffer.png", colours=300)


@pytest.mark.slow
def test_own_technique(tmp_path):
    rows = {
        line.split()[0]: [float(word.rstrip("%")) for word in line.split()[1:]]
        for line in run("own_technique", tmp_path).splitlines()[1:]
    }
    assert sorted(rows) == ["careful", "certified", "linear", "paper"]
    assert rows["certified"][1] == 0
    assert rows["careful"][1] < rows["paper"][1] / 10
    assert rows["paper"][0] * 0.8 < rows["careful"][0] < rows["paper"][0]


@pytest.mark.slow
def test_shadow_rays(tmp_path):
    said = run("shadow_rays", tmp_path)
    for title in ("Shares of the shadow rays", "How their marches ended", "most in shadow"):
        assert title in said
    sun = re.search(r"^sun +([\d.]+)% +([\d.]+)%", said, flags=re.MULTILINE)
    assert 50 < float(sun[1]) < 100
    assert 5 < float(sun[2]) < 60
    assert_picture(tmp_path / "shadow_rays.png")
