"""Pieces of kernels, which only compiled code calls, as functions for tests to call."""

from hybrid_rt.kernels._jit import kernel


def from_python(piece):
    """Return a function that Python can call and that computes what a piece does."""
    return kernel(piece.py_func)
