"""The one place that sets how kernels are compiled.

No fast-math at all: infinities and NaN mean something here (a background pixel, a ray without an
answer), and the oracles are compared bit for bit, which reassociation and contraction would break.
The error model is NumPy's, so that 1 / 0 is an infinity and not a branch. Compiled code is kept,
see `hybrid_rt.kernels._cache`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

from hybrid_rt.kernels._cache import KernelCache
from hybrid_rt.kernels._pieces import piece, without_literals
from hybrid_rt.kernels._team import on_all_threads

OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": False}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that is called from Python, or from other kernels, on one thread."""
    dispatcher = without_literals(njit(no_cfunc_wrapper=True, **OPTIONS)(function))
    dispatcher._cache = KernelCache(function)
    return dispatcher


def parallel_kernel(function: Callable[..., None]) -> Callable[..., None]:
    """Return a function that runs on all threads; outputs must not depend on how many.

    Its first parameter is the thread's `Share`, which callers leave out; see `kernels._queue`.
    """
    return on_all_threads(kernel(function))


called = piece(**OPTIONS)
"""A function called from kernels alone."""

inlined = piece(forceinline=True, **OPTIONS)
"""A named piece of a kernel body; LLVM puts it in place."""

inlined_by_value = piece(by_value=True, forceinline=True, **OPTIONS)
"""As `inlined`, for pieces that hand a number of lanes on: it has to be a constant."""
