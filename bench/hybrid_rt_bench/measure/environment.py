"""Describe the machine and the software of a run, and the problems that would spoil its figures."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path
from typing import Any

import numba
import psutil

import hybrid_rt as hrt

PACKAGES = ("numba", "llvmlite", "numpy", "scipy", "pandas", "pyarrow", "trimesh", "embreex")
BUSY = 0.25
"""A load average above this share of the cores is called busy."""


def describe(threads: int) -> dict[str, Any]:
    """Return the environment as plain data."""
    return {
        "hybrid_rt": hrt.__version__,
        "python": platform.python_version(),
        "packages": {name: importlib.metadata.version(name) for name in PACKAGES},
        "os": platform.platform(),
        "cpu": _cpu_model(),
        "cores": psutil.cpu_count(logical=False) or psutil.cpu_count() or 1,
        "logical_cores": usable_cores(),
        "memory_bytes": psutil.virtual_memory().total,
        "threads": threads,
        "embree": hrt.embree_info(),
        "packet_path": hrt.embree_problem() or "available",
        "git": git_commit(),
        "load_average": load_average(),
    }


def problems(environment: dict[str, Any]) -> list[str]:
    """Return one sentence, with advice, for everything that would spoil timings."""
    found = []
    load, cores = environment["load_average"], environment["logical_cores"]
    if load is not None and load > BUSY * cores:
        found.append(
            f"the machine is busy: load average {load:.1f} on {cores} cores; close other programs, "
            "or trust only ratios of stages measured side by side"
        )
    if environment["packet_path"] != "available":
        found.append(
            f"Embree's packet calls cannot be reached ({environment['packet_path']}); only the "
            "path 'run' competes for the strongest Embree"
        )
    if environment["threads"] > cores:
        found.append(f"{environment['threads']} threads on {cores} usable cores")
    governor = _read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
    if governor == "powersave":
        found.append("the CPU's frequency governor is 'powersave'; set it to 'performance'")
    battery = getattr(psutil, "sensors_battery", lambda: None)()
    if battery is not None and not battery.power_plugged:
        found.append("the machine runs on its battery")
    return found


def usable_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def most_threads() -> int:
    """Return how many threads Numba was started with: the most that can be asked for."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


def checked_threads(threads: int | None) -> int:
    """Return the number of threads asked for, by default all.

    Raises
    ------
    ArgumentError
        Fewer than one, or more than Numba was started with.
    """
    most = most_threads()
    threads = most if threads is None else threads
    if not 1 <= threads <= most:
        raise hrt.ArgumentError("threads", f"1 to {most} (the cores of this machine)", str(threads))
    return threads


def load_average() -> float | None:
    """Return the load of the last minute, None where the system does not say."""
    try:
        return round(os.getloadavg()[0], 2)
    except (AttributeError, OSError):
        return None


def git_commit() -> str | None:
    """Return the commit of the checkout that this package runs from, None outside of one."""
    folder = Path(__file__).resolve().parent

    def git(*arguments: str) -> str:
        return subprocess.run(
            ["git", *arguments], cwd=folder, capture_output=True, text=True, check=True, timeout=10
        ).stdout.strip()

    try:
        root = Path(git("rev-parse", "--show-toplevel"))
        if not (root / "bench" / "hybrid_rt_bench").is_dir():
            return None  # installed inside somebody else's repository
        dirty = " with changes" if git("status", "--porcelain", "--untracked-files=no") else ""
        return git("rev-parse", "HEAD") + dirty
    except (OSError, subprocess.SubprocessError):
        return None


def version_of(package: str) -> str:
    """Return the version of an installed distribution, or "not installed"."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _cpu_model() -> str:
    for line in (_read("/proc/cpuinfo") or "").splitlines():
        if line.startswith("model name"):
            return " ".join(line.split(":", 1)[1].split())
    return platform.processor() or platform.machine()


def _read(path: str) -> str | None:
    try:
        return Path(path).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError):
        return None
