"""Machines for which another process compiles."""

import os
import platform

import llvmlite.binding
import pytest

AVX2 = "+64bit,+avx,+avx2,+bmi,+bmi2,+cx8,+fma,+lzcnt,+popcnt,+sse,+sse2,+sse3,+sse4.1,+sse4.2"
MACHINES = {  # name, features, width
    "generic": ("generic", None, 4),
    "avx2": ("haswell", AVX2, 8),
}


def machine(name):
    """Return the environment of a process that compiles for another machine, and its width."""
    cpu, features, width = MACHINES[name]
    if platform.machine() != "x86_64":
        pytest.skip(f"{name} is a machine of the x86_64 family, not {platform.machine()}")
    if name == "avx2" and not llvmlite.binding.get_host_cpu_features().get("avx2"):
        pytest.skip("this machine has no AVX2")
    env = {k: v for k, v in os.environ.items() if k != "NUMBA_CPU_FEATURES"}
    env |= {"NUMBA_CPU_NAME": cpu, "HYBRID_RT_TEST_WIDTH": str(width)}
    if features is not None:
        env["NUMBA_CPU_FEATURES"] = features
    return env, width
