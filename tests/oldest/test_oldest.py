"""The project installs and starts with the oldest dependencies that pyproject.toml allows."""

import subprocess
import sys

import pytest

from support import ROOT

OLDEST = ROOT / "tests" / "oldest" / "oldest.py"


@pytest.mark.slow
def test_the_oldest_dependencies_do(tmp_path):
    """Meshes and the command line; ``make oldest`` also marches, traces and measures."""
    done = subprocess.run(
        [sys.executable, str(OLDEST), "--quick", str(tmp_path / "venv")],
        capture_output=True, text=True, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "the oldest dependencies do" in done.stdout
