"""Random numbers that are a function of a counter and a key, the same in any order of evaluation.

Philox4x32-10 of J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random numbers: as
easy as 1, 2, 3", SC 2011. Words are 32 bits in an int64; a product wraps modulo 2**64, which is all
that its halves need.
"""

from __future__ import annotations

from hybrid_rt.kernels._jit import inlined

WORD = 0xFFFFFFFF
MULTIPLIER_0, MULTIPLIER_1 = 0xD2511F53, 0xCD9E8D57
WEYL_0, WEYL_1 = 0x9E3779B9, 0xBB67AE85
ROUNDS = 10


@inlined
def philox(c0, c1, c2, c3, k0, k1):
    """Return the four words that belong to the counter c and the key k."""
    for _ in range(ROUNDS):
        p0 = MULTIPLIER_0 * c0
        p1 = MULTIPLIER_1 * c2
        c0 = ((p1 >> 32) & WORD) ^ c1 ^ k0
        c2 = ((p0 >> 32) & WORD) ^ c3 ^ k1
        c1 = p1 & WORD
        c3 = p0 & WORD
        k0 = (k0 + WEYL_0) & WORD
        k1 = (k1 + WEYL_1) & WORD
    return c0, c1, c2, c3


@inlined
def uniform_pair(x, y, seed):
    """Return two numbers in (0, 1) that belong to pixel (x, y) and a seed of 63 bits."""
    a, b, _, _ = philox(x, y, 0, 0, seed & WORD, seed >> 32)
    return (a + 0.5) * 2.0**-32, (b + 0.5) * 2.0**-32
