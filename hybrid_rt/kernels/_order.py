"""Put what is drawn into a tile roughly nearest first.

No result depends on the order, but what is near hides what comes later.
"""

from __future__ import annotations

from hybrid_rt.kernels._jit import inlined

BUCKETS = 256
"""Depths that are told apart, eight to each halving."""


@inlined
def bucket(bits):
    """Return a number that is smaller for nearer depths, given as the bits of a float32."""
    return min(max(0x3F8 - (bits >> 20), 0), BUCKETS - 1)


@inlined
def near_first(bins, start, end, depth_bits, records, order, heads):
    """Put bins start..end-1 into `order`, roughly nearest first and equals as they come.

    ``depth_bits(records, record)`` is a record's nearest depth, as the bits of a float32 in int64;
    heads (BUCKETS + 1,) int32 is scratch.
    """
    heads[:] = 0
    for at in range(start, end):
        heads[bucket(depth_bits(records, bins[at])) + 1] += 1
    for b in range(BUCKETS):
        heads[b + 1] += heads[b]
    for at in range(start, end):
        record = bins[at]
        b = bucket(depth_bits(records, record))
        order[heads[b]] = record
        heads[b] += 1
