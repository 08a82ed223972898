"""Put what is drawn into a tile roughly nearest first.

No result depends on the order, but what is near hides what comes later.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels._jit import inlined

BUCKETS = 256
"""Depths that are told apart, eight to each halving."""


@inlined
def entry(depth_bits, record):
    """Return a bin's entry: the bits of a float32, the nearest depth, above a record's number."""
    return (np.int64(depth_bits) << 32) | np.int64(record)


@inlined
def bucket(entry):
    """Return a number that is smaller for nearer depths."""
    return min(max(0x3F8 - (entry >> 52), 0), BUCKETS - 1)


@inlined
def near_first(bins, start, end, order, heads):
    """Put entries start..end-1 of the bins into `order`, roughly nearest first.

    bins, order int64; heads (BUCKETS + 1,) int32 is scratch. Equals stay as they come.
    """
    heads[:] = 0
    for at in range(start, end):
        heads[bucket(bins[at]) + 1] += 1
    for b in range(BUCKETS):
        heads[b + 1] += heads[b]
    for at in range(start, end):
        b = bucket(bins[at])
        order[heads[b]] = bins[at]
        heads[b] += 1
