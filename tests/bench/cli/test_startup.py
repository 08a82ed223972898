"""What is only asked for help loads no compiler and no tracer."""

import json
import os
import subprocess
import sys

import pytest

from support import PYTHONPATH

HEAVY = ("numba", "llvmlite", "embreex", "pandas", "pyarrow", "matplotlib", "scipy", "trimesh")


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["render", "--help"]])
def test_help_loads_nothing_heavy(words):
    script = (
        "import json, sys\n"
        f"sys.argv = ['hybrid-rt', *{words!r}]\n"
        "from hybrid_rt_bench.cli import main\n"
        "try:\n"
        "    main()\n"
        "finally:\n"
        f"    print(json.dumps([m for m in {HEAVY!r} if m in sys.modules]), file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True,
        env=os.environ | {"PYTHONPATH": PYTHONPATH},
    )  # fmt: skip
    assert "Usage" in done.stdout
    assert json.loads(done.stderr) == []
