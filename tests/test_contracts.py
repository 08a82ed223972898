"""The import contracts hold, and each notices what it is there for."""

import shutil
import subprocess
import sys

import pytest

from support import ROOT

BREACHES = {
    "imports upwards": ("hybrid_rt/raster/pyramid.py", "import hybrid_rt.hybrid\n"),
    "is not listed": ("hybrid_rt/newcomer.py", '"""A module nobody knows."""\n'),
    "kernel imports pandas": ("hybrid_rt/kernels/triangle.py", "import pandas\n"),
    "judge sees a tracer": (
        "hybrid_rt/judging/truth.py",
        "import hybrid_rt.trace.embree\n",
    ),
    "judge sees the raster": (
        "hybrid_rt/judging/bvh.py",
        "import hybrid_rt.raster.lists\n",
    ),
    "library sees the bench": ("hybrid_rt/rays/hits.py", "import hybrid_rt_bench\n"),
    "kernel sees the errors": ("hybrid_rt/kernels/_queue.py", "import hybrid_rt.errors\n"),
    "the bench has a newcomer": ("bench/hybrid_rt_bench/newcomer.py", '"""Nobody knows it."""\n'),
    "kind sees a kind": (
        "bench/hybrid_rt_bench/kinds/peers/tables.py",
        "import hybrid_rt_bench.kinds.paper.published\n",
    ),
    "report measures": (
        "bench/hybrid_rt_bench/report/table.py",
        "import hybrid_rt_bench.measure.memory\n",
    ),
    "table measures": (
        "bench/hybrid_rt_bench/kinds/scaling/tables.py",
        "import hybrid_rt_bench.measure.memory\n",
    ),
}


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """Return a copy of what the contracts are about."""
    folder = tmp_path_factory.mktemp("contracts")
    ignore = shutil.ignore_patterns("__pycache__")
    for name in ("hybrid_rt", "bench", "scenes", "tests/support"):
        shutil.copytree(ROOT / name, folder / name, ignore=ignore)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def check(folder):
    """Return the exit code of the contracts' check, and what it printed."""
    script = (
        "import sys; sys.path[:0] = ['.', 'bench', 'scenes']; sys.dont_write_bytecode = True\n"
        "from importlinter.cli import lint_imports_command; lint_imports_command(['--no-cache'])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


def test_the_contracts_hold(copy):
    code, printed = check(copy)
    assert code == 0, printed
    assert "0 broken" in printed


@pytest.mark.parametrize("breach", list(BREACHES))
def test_a_breach_is_noticed(copy, breach):
    name, text = BREACHES[breach]
    path = copy / name
    before = path.read_text() if path.exists() else None
    path.write_text((before or "") + text)
    try:
        code, printed = check(copy)
    finally:
        path.unlink() if before is None else path.write_text(before)
    assert code == 1, printed
    assert "BROKEN" in printed or "newcomer" in printed
