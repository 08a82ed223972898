"""Freed memory stays with the process, so that a timed stage does not pay for it again."""

import subprocess
import sys

import pytest

from support import ROOT

FAULTS = """
import resource, sys
import numpy as np
sys.path[:0] = {path!r}
from hybrid_rt_bench.measure import memory
print(memory.keep_freed() if {keep} else "left")
def use():
    np.empty(1 << 25, np.uint8).fill(1)
use()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    use()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(keep):
    code = FAULTS.format(path=[str(ROOT), str(ROOT / "bench")], keep=keep)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    said, count = done.stdout.split()
    return said, int(count)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="mallopt is glibc's")
def test_freed_memory_is_used_again():
    said, kept = faults(keep=True)
    if said == "False":
        pytest.skip("the C library of this machine has no mallopt")
    _, left = faults(keep=False)
    assert kept < 20 < left
