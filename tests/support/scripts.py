"""Scripts in processes of their own: what an installation or a fork does to the library."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

PYRAMID = """
import numpy as np
import hybrid_rt as hrt
from hybrid_rt.kernels.raster import pyramid as kernels
from support.synthetic import gbuffer

BUFFER = gbuffer(np.random.default_rng(5).random((120, 160)).astype(np.float32))

def pyramid(threads=2):
    made = hrt.build_depth_pyramid(BUFFER, threads=threads)
    return b"".join(made.level(k).tobytes() for k in range(len(made)))

def right():
    level, wanted = BUFFER.depth, []
    while True:
        wanted.append(level.tobytes())
        if level.size == 1:
            return b"".join(wanted)
        even = np.pad(level, [(0, n % 2) for n in level.shape], mode="edge")
        level = even.reshape(even.shape[0] // 2, 2, -1, 2).max(axis=(1, 3))
"""
"""Defines `pyramid`, by the library, which compiles little, and `right`, by NumPy."""


def run(script, cache, *, package=ROOT, **environment):
    """Run a script to its end; return (exit code, output, errors).

    `cache` is the folder for compiled code, None for the library's own choice; `package` the folder
    that hybrid_rt is imported from.
    """
    paths = map(str, (package, ROOT / "tests"))
    settings = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "NUMBA_NUM_THREADS": "2"}
    settings.pop("NUMBA_CACHE_DIR", None)
    if cache is not None:
        settings["NUMBA_CACHE_DIR"] = str(cache)
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=settings | environment, cwd=package, capture_output=True, text=True, timeout=600,
        check=False,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr
