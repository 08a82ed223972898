"""Compilation: what the first use on a machine waits for."""

from hybrid_rt.kernels._progress import Compiling, on_compile

__all__ = ["Compiling", "on_compile"]
