"""The one place that sets how kernels are compiled.

No fast-math at all: infinities and NaN mean something here (a background pixel, a ray without an
answer), and the oracles are compared bit for bit, which reassociation and contraction would break.
The error model is NumPy's, so that 1 / 0 is an infinity and not a branch. Compiled code is cached
beside the sources.
"""

from __future__ import annotations

from numba import njit

OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": False}

kernel = njit(cache=True, **OPTIONS)
"""A function called from Python, or from other kernels, on one thread."""

parallel_kernel = njit(cache=True, parallel=True, **OPTIONS)
"""A function whose `prange` loops run on all threads; outputs must not depend on how many."""

inlined = njit(cache=True, forceinline=True, **OPTIONS)
"""A named piece of a kernel body; LLVM puts it in place."""
