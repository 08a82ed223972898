"""The threads that a kernel runs on, each with a share of the work.

They are threads of Python that wait for jobs without using the processor. A kernel holds no
interpreter lock, so they run at once; several callers may ask at a time, and a process that was
forked gets threads of its own. A call costs some microseconds more than a plain one.
"""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray


class Share(NamedTuple):
    """What a kernel gets first: its thread's number, of how many, the address of a counter."""

    worker: int
    workers: int
    counter: int


class _Job:
    """A share of a call, for whichever thread comes to it first.

    `counter` is what the share's address leads to: an interrupted caller may be gone before.
    """

    def __init__(self, work: Callable[[], object], counter: NDArray[np.int64]) -> None:
        self._work, self._counter = work, counter
        self._taken = threading.Lock()
        self._done = threading.Lock()
        self._done.acquire()
        self._error: BaseException | None = None

    def run(self) -> None:
        """Do the work unless another thread has begun to; `wait` raises what goes wrong."""
        if not self._taken.acquire(blocking=False):
            return
        try:
            self._work()
        except BaseException as error:  # whoever waits for it raises it
            self._error = error
        finally:
            self._done.release()

    def wait(self) -> None:
        """Wait for the thread that has taken this job to be done with it."""
        self._done.acquire()
        if self._error is not None:
            raise self._error


class _Team:
    """Threads that wait for jobs; they are started when they are first needed."""

    def __init__(self) -> None:
        self._jobs: SimpleQueue[_Job] = SimpleQueue()
        self._lock = threading.Lock()
        self._threads = 0

    def give(self, jobs: list[_Job]) -> None:
        """Have other threads run jobs, at least as many as there are of these."""
        with self._lock:
            while self._threads < len(jobs):
                self._threads += 1
                threading.Thread(
                    target=self._work, name=f"hybrid_rt {self._threads}", daemon=True
                ).start()
        for job in jobs:
            self._jobs.put(job)

    def _work(self) -> None:
        while True:
            self._jobs.get().run()


_team = _Team()


def _found_new_team() -> None:
    global _team
    _team = _Team()


if hasattr(os, "register_at_fork"):
    # Threads do not live on in a forked process, and a lock of the old team may be held for ever.
    os.register_at_fork(after_in_child=_found_new_team)


def on_all_threads(kernel: Any) -> Any:
    """Return a function that runs a kernel on as many threads as `numba.get_num_threads` says.

    Its attribute `kernel` is that kernel, which takes a `Share` before the arguments of the
    function and returns nothing.
    """

    @functools.wraps(kernel.py_func)
    def run(*arguments: Any) -> None:
        workers = numba.get_num_threads()
        counter = np.zeros(1, np.int64)
        address = counter.ctypes.data
        jobs = [
            _Job(functools.partial(kernel, Share(worker, workers, address), *arguments), counter)
            for worker in range(1, workers)
        ]
        _team.give(jobs)
        try:
            kernel(Share(0, workers, address), *arguments)
            # On a busy machine a thread may wake up late: a share that waits for it is done here.
            for job in jobs:
                job.run()
        finally:
            # The counter and the arrays are in use until the last thread is done.
            for job in jobs:
                job.wait()

    run.kernel = kernel  # type: ignore[attr-defined]
    return run
