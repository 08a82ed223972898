"""Scratch memory that vectors are at home in."""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels._jit import inlined


@inlined
def aligned(n):
    """Return n int64 that start at a multiple of 64 bytes, so that vectors stay in cache lines."""
    raw = np.empty(n + 8, np.int64)
    start = (-raw.ctypes.data % 64) // 8
    return raw[start : start + n]
