"""What is handed out: the wheel has all that it needs, and one version everywhere."""

import re
import subprocess
import sys
import zipfile

import pytest

import hybrid_rt as hrt
from support import ROOT

PACKAGES = {"hybrid_rt": "", "hybrid_rt_bench": "bench", "hybrid_rt_scenes": "scenes"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        yield archive


@pytest.mark.parametrize("package", PACKAGES)
def test_the_wheel_holds_all_of_a_package_and_says_that_it_is_typed(wheel, package):
    held = set(wheel.namelist())
    assert f"{package}/py.typed" in held
    source = ROOT / PACKAGES[package]
    for suffix in ("*.py", "*.pyi", "*.toml"):
        for path in (source / package).rglob(suffix):
            assert path.relative_to(source).as_posix() in held, path


def test_the_wheel_holds_nothing_else(wheel):
    allowed = {*PACKAGES, f"hybrid_rt-{hrt.__version__}.dist-info"}
    assert {name.split("/")[0] for name in wheel.namelist()} == allowed
    assert not [name for name in wheel.namelist() if name.endswith((".pyc", ".nbi", ".nbc"))]


def test_there_is_one_version(wheel):
    (metadata,) = (name for name in wheel.namelist() if name.endswith("METADATA"))
    assert f"\nVersion: {hrt.__version__}\n" in wheel.read(metadata).decode()
    citation = (ROOT / "CITATION.cff").read_text()
    assert re.search(r"^version: (.*)$", citation, flags=re.MULTILINE)[1] == hrt.__version__
    assert re.search(r"^cff-version: 1\.2\.0$", citation, flags=re.MULTILINE)
    changelog = (ROOT / "CHANGELOG.md").read_text()
    named = re.findall(r"^## \[?([^\]\s]+)\]?", changelog, flags=re.MULTILINE)
    assert named[0] == "Unreleased"
    assert named[1:2] == [hrt.__version__]
