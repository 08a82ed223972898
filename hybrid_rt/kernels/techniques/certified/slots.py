"""The rows that the rays of a batch are kept in, slots, and how lanes read and write them."""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined

BATCH = 512
"""Slots; their rows stay in the L2 cache."""

W = simd.WIDTH
STRIDE = BATCH + W  # slots in a row: what is loaded past the last one is not used

# Rows of slots, float32: the ray on the screen, its end and the s up to which it is free, by how
# much its depth may be too low, its origin along the axes of the exact test.
X0, Y0, Z0, SX, SY, SZ, INV_X, INV_Y, END, S, Z_ERROR, OX, OY, OZ, F32_ROWS = range(15)
# int32: the ray, the axis kz of the exact test, how it ends if it meets nothing; then its state:
# the pixel, level (or PASSED), steps, place in the pixel's list, the primitive tested last, exact
# tests, best hit and its pixel, status or ARRIVED.
RAY, KZ, HOW, CX, CY, LEVEL, STEPS, ENTRY, PRIM, TESTS = range(10)
BEST, BEST_X, BEST_Y, CODE, I32_ROWS = range(10, 15)
# float64: what leads from s to t, limits, the shear of the exact test; bounds of the best hit's t.
SCALE, AT_W, GW, T_NEAR, T_FAR, SHEAR_X, SHEAR_Y, SHEAR_Z, LOW, HIGH, F64_ROWS = range(11)

# What a worker counts, int64: of each stage the vectors that it went through and the lanes of them
# that were at work. A step reads the pyramid; a pass leaves a pixel that has been looked at.
# REFILLS are lanes given a ray, RESTS lists gone through to their end. As the fields of MarchWork.
N_STEP_VECTORS, N_STEPS, N_PASSES, N_REFILLS, N_LOOK_VECTORS, N_LOOKS = range(6)
N_ENTRY_VECTORS, N_ENTRIES, N_RESTS, N_PLANE_VECTORS, N_PLANES = range(6, 11)
N_TEST_VECTORS, N_TESTS, COUNTERS = range(11, 14)

# What a busy lane gathers, for those who reckon what a march must read: numbers of the arrays of
# the view and the scene, and rows of slots (one of a test's is read by `look`, those of hits are
# left out). tests/unit/test_certified_simd.py counts them in the sources of the stages.
CELLS_A_STEP, ROWS_A_REFILL = 1, 14
NUMBERS_AN_ENTRY, NUMBERS_A_REST, NUMBERS_A_PLANE, ROWS_A_LOOK = 2, 1, 6, 16
NUMBERS_A_TEST, ROWS_A_TEST = 9, 13

PASSED = -1
"""Level of a ray that nothing in its pixel stops any more."""
ARRIVED = -1
"""Result of a ray that has come to its end, or to its hit."""

F32 = np.float32
I32 = np.int32
INFINITY = np.inf


@inlined
def put(rows, row, slot, v, m):
    """Write the lanes of m to a row, one slot after the other."""
    simd.store(rows, row * STRIDE + slot, simd.compress(v, m))


@inlined
def at(rows, row, slot, m):
    """Return a row at the slots of lanes m."""
    return simd.gather(rows, slot + I32(row * STRIDE), m, 0)


@inlined
def leave(rows, row, slot, v, m):
    """Write lanes m to their slots of a row."""
    simd.scatter(rows, slot + I32(row * STRIDE), v, m)


@inlined
def append(queue, many, slot, m):
    """Put the slots of lanes m at the end of a queue; return how many there are."""
    simd.store(queue, many, simd.compress(slot, m))
    return many + simd.count(m)


@inlined
def edge_at(cell, level, start, inv):
    """Return the s at which lanes reach an edge of a cell; infinity where they never do."""
    at = (simd.to_f32(cell << level) - start) * inv
    return simd.select(inv == F32(0.0), F32(INFINITY), at)
