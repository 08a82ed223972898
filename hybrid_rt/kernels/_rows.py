"""From columns to rows."""

from __future__ import annotations

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined


@inlined
def transposed(a, b, c, d, e, f, g, h):
    """Return eight vectors of eight lanes as one of 64, lane 0 of all of them first."""
    return simd.interleave(
        simd.interleave(simd.interleave(a, e), simd.interleave(c, g)),
        simd.interleave(simd.interleave(b, f), simd.interleave(d, h)),
    )
