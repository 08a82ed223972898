"""Measure how fast this machine reads: gathers by lanes and contiguous loads, size by size.

A table of growing size goes from the nearest cache to memory. Gathers that do not wait for each
other give a rate (numbers a second), a chain in which each gather names the places of the next one
gives a latency, and loads of neighbours give a bandwidth. Every rate is the best of several
repeats: what disturbs one only ever makes it longer.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from hybrid_rt.kernels.simd import WIDTH
from hybrid_rt_bench.kinds.roofline import kernels

KINDS: dict[str, Any] = {
    "gather": kernels.gather_all,  # independent of each other
    "chain": kernels.chain_all,  # each waits for the last
    "load": kernels.load_all,  # of neighbours
}
"""What is measured, with the kernel that does it."""

ELEMENT = 4
"""Bytes of a float32."""
FEWEST = 2048
"""Half of the fewest vectors that a thread reads."""

F32 = np.float32


def cycle(bits: int) -> NDArray[np.float32]:
    """Return a table of 2**bits numbers that are, as int32, one cycle through all its places."""
    place = np.arange(1 << bits, dtype=np.uint32)
    place *= np.uint32(kernels.FACTOR)  # modulo 2**32, so modulo 2**bits
    place += np.uint32(kernels.TERM)
    place &= np.uint32((1 << bits) - 1)
    return place.view(np.float32)


def measure(
    sizes: Sequence[int],
    threads: Sequence[int],
    repeats: int,
    seconds: float,
    *,
    clock: Callable[[], float] = time.perf_counter,
    on_size: Callable[[], None] = lambda: None,
) -> list[dict[str, Any]]:
    """Return a row for each size, number of threads and kind.

    Parameters
    ----------
    sizes : sequence of int
        Bytes of the table, powers of two, each at least 4 vectors.
    threads : sequence of int
    repeats : int
        Of which the fastest counts.
    seconds : float
        A repeat on one thread takes at least this long.
    on_size : callable
        Called whenever a size is done.

    Returns
    -------
    list of dict
        ``bytes``, ``threads``, ``kind`` (of `KINDS`), ``ns_element``: wall time over what all
        threads read, and ``ns_vector``: of one of the vectors that each thread reads.
    """
    rows: list[dict[str, Any]] = []
    before = int(numba.get_num_threads())
    try:
        for size in sizes:
            bits = (size // ELEMENT).bit_length() - 1
            plain = np.ones(1 << bits, F32)
            tables = {"gather": plain, "chain": cycle(bits), "load": plain}
            numba.set_num_threads(1)
            enough = {
                kind: _enough(KINDS[kind], table, bits, seconds, clock)
                for kind, table in tables.items()
            }
            for workers in threads:
                numba.set_num_threads(workers)
                for kind, table in tables.items():
                    times = []
                    for _ in range(repeats):
                        start = clock()
                        KINDS[kind](table, bits, enough[kind], np.zeros(workers, F32))
                        times.append(clock() - start)
                    ns = 1e9 * min(times) / enough[kind]
                    rows.append(
                        {
                            "bytes": size,
                            "threads": workers,
                            "kind": kind,
                            "ns_element": ns / (workers * WIDTH),
                            "ns_vector": ns,
                        }
                    )
            on_size()
    finally:
        numba.set_num_threads(before)
    return rows


def _enough(
    run: Any, table: NDArray[np.float32], bits: int, seconds: float, clock: Callable[[], float]
) -> int:
    """Return how many vectors one thread reads in `seconds` at least."""
    sums = np.zeros(1, F32)
    vectors, took = FEWEST, 0.0
    while took < seconds:
        vectors *= 2
        start = clock()
        run(table, bits, vectors, sums)
        took = clock() - start
    return vectors


def caches() -> list[dict[str, Any]]:
    """Return ``name`` and ``bytes`` of the first core's caches for data; none where not told."""
    found = []
    for folder in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        try:
            kind, level, size = (
                (folder / name).read_text().strip() for name in ("type", "level", "size")
            )
        except OSError:
            continue
        if kind != "Instruction" and size.endswith("K"):
            found.append({"name": f"L{level}", "bytes": 1024 * int(size[:-1])})
    return found
