"""How many threads the kernels of one call use."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numba

from hybrid_rt import _check


def available() -> int:
    """Return how many threads a call can use: the cores, or NUMBA_NUM_THREADS if that is set."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


@contextmanager
def limited(threads: int | None) -> Iterator[int]:
    """Run the kernels of a ``with`` block on `threads` threads (None: as Numba is set).

    Raises
    ------
    ArgumentError
        Fewer than one thread, or more than there are.
    """
    before = int(numba.get_num_threads())
    if threads is None:
        yield before
        return
    numba.set_num_threads(_check.integer("threads", threads, least=1, most=available()))
    try:
        yield threads
    finally:
        numba.set_num_threads(before)
