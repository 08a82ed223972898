"""How many threads the kernels of one call use."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numba

from hybrid_rt import _check


def available() -> int:
    """Return how many threads a call can use: the cores, or NUMBA_NUM_THREADS if that is set."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


def count(threads: int | None) -> int:
    """Return how many threads `threads` stands for; None is as many as Numba is set to.

    Raises
    ------
    ArgumentError
        Fewer than one thread, or more than there are.
    """
    if threads is None:
        return int(numba.get_num_threads())
    return _check.integer("threads", threads, least=1, most=available())


@contextmanager
def limited(threads: int | None) -> Iterator[int]:
    """Run the kernels of a ``with`` block on `threads` threads, as `count` reads it."""
    before = int(numba.get_num_threads())
    workers = count(threads)
    numba.set_num_threads(workers)
    try:
        yield workers
    finally:
        numba.set_num_threads(before)
