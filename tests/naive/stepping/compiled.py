"""How the oracles are compiled: as the library's kernels, without fast-math."""

from numba import njit

inlined = njit(nogil=True, error_model="numpy", fastmath=False)
