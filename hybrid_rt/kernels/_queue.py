"""How threads divide work: by a counter that they take from, or in equal parts.

A chunk of sky costs a fraction of one of foliage: what costs differently is taken from the counter.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from hybrid_rt.kernels._jit import inlined


@intrinsic
def fetch_add(typingctx, address, value):
    """Add `value` to the int64 at `address` in one atomic step and return what was there before."""

    def generate(context, builder, signature, arguments):
        pointer = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        return builder.atomic_rmw("add", pointer, arguments[1], "monotonic")

    return types.int64(types.int64, types.int64), generate


@inlined
def take(share, many):
    """Take the next `many` of the work; return the number of the first of them."""
    return fetch_add(share.counter, many)


@inlined
def part(share, n):
    """Return the range of 0..n-1 that is a thread's own, nearly as long as those of the others."""
    return range(n * share.worker // share.workers, n * (share.worker + 1) // share.workers)
