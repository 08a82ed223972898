"""Have everything compiled before anything is timed, and say what is being compiled."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from hybrid_rt.compiling import Compiling, on_compile

OnStage = Callable[[str, int, int], None]
"""Told the name of a stage that begins, its number from 1, and how many there are."""

Stages = Mapping[str, Callable[[], Any]]
"""What is to be compiled, by name: calls on something tiny, in the order in which they depend."""


@contextlib.contextmanager
def told(to: Callable[[Compiling], Any]) -> Iterator[None]:
    """Have it told what the library compiles, function by function, in place of its own lines."""
    on_compile(to)
    try:
        yield
    finally:
        on_compile(None)


def first_calls(stages: Stages, on_stage: OnStage) -> dict[str, float]:
    """Return, by stage, how much longer its first call takes than its second, seconds.

    The first compiles, or loads from Numba's cache on disk what an earlier process compiled;
    afterwards every stage is ready to be timed.
    """
    seconds = {}
    for number, (name, call) in enumerate(stages.items(), start=1):
        on_stage(name, number, len(stages))
        took = []
        for _ in range(2):
            start = time.perf_counter()
            call()
            took.append(time.perf_counter() - start)
        seconds[name] = max(0.0, took[0] - took[1])
    return seconds
