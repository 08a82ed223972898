"""Try the project with the oldest dependencies that pyproject.toml allows.

Run ``python tests/oldest/oldest.py [--quick] [FOLDER]`` from the root: a virtual environment with
exactly the lower bounds is made in FOLDER (default: a temporary one), the project is installed
into it, and ``smoke.py`` runs there. ``--quick`` leaves out what compiles kernels.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BOUND = re.compile(r"([A-Za-z0-9_.-]+)>=([0-9][0-9A-Za-z.]*)")


def lower_bounds(text):
    """Return "name==version" for each dependency of a pyproject.toml, which must all be bounded."""
    pins = []
    for wanted in tomllib.loads(text)["project"]["dependencies"]:
        match = BOUND.fullmatch(wanted)
        if match is None:
            raise SystemExit(f"pyproject.toml: expected a lower bound alone, got {wanted!r}")
        pins.append("==".join(match.groups()))
    return pins


def install(folder):
    """Make an environment of lower bounds with the project in it; return its python."""
    venv.create(folder, with_pip=True, clear=True)
    python = folder / "bin" / "python"
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    pins = lower_bounds((ROOT / "pyproject.toml").read_text())
    subprocess.run([*pip, "--only-binary", ":all:", *pins], check=True)
    subprocess.run([*pip, "--no-deps", str(ROOT)], check=True)
    return python


def main():
    """Install and run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="nothing that compiles kernels")
    parser.add_argument("folder", nargs="?", type=Path, help="where the environment goes")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        python = install(chosen.folder or Path(scratch) / "venv")
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        environment["NUMBA_CACHE_DIR"] = str(Path(scratch) / "compiled")
        smoke = Path(__file__).with_name("smoke.py")
        words = [str(python), str(smoke), *(["--quick"] if chosen.quick else [])]
        sys.exit(subprocess.run(words, cwd=scratch, env=environment, check=False).returncode)


if __name__ == "__main__":
    main()
