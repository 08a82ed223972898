"""How many threads a call may use."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numba

from hybrid_rt import _check


@contextmanager
def limited(threads: int | None) -> Iterator[int]:
    """Run Numba's parallel loops on `threads` threads inside the block; None changes nothing.

    Yields
    ------
    int
        The number of threads in use.

    Raises
    ------
    ArgumentError
        `threads` is below 1 or above the number that Numba started with.
    """
    before = numba.get_num_threads()
    if threads is None:
        yield before
        return
    most = int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    numba.set_num_threads(_check.integer("threads", threads, least=1, most=most))
    try:
        yield threads
    finally:
        numba.set_num_threads(before)
