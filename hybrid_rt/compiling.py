"""Compilation: what the first use on a machine waits for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels import _progress
from hybrid_rt.kernels._progress import Compiling

__all__ = ["Compiling", "on_compile"]


def on_compile(callback: Callable[[Compiling], Any] | None) -> None:
    """Have `callback` called whenever a function is about to be compiled; None: the library's own.

    The library's own writes a line to the standard error when a stage begins that takes more than a
    second, unless the environment variable HYBRID_RT_COMPILE_NOTES is 0.

    Raises
    ------
    ArgumentError
        `callback` is neither None nor callable.
    """
    if callback is not None and not callable(callback):
        raise ArgumentError("callback", "a function, or None", _check.describe(callback))
    _progress.on_compile(callback)
