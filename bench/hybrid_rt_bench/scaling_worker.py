"""The process of a cell of kind "scaling", seen from the process that asks it."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Iterator
from typing import Any

import hybrid_rt as hrt
from hybrid_rt_bench.scaling_cell import Task, Visit, serve


class WorkerError(hrt.HybridRTError):
    """A cell could not be made ready or measured, or its process ended."""


class Worker:
    """A cell in a process of its own.

    Parameters
    ----------
    task : Task
        What the cell is.

    Raises
    ------
    WorkerError
        By every method: what went wrong in the process, or how it ended.
    """

    def __init__(self, task: Task) -> None:
        # Not by fork: threads of Numba and of the console do not survive one.
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(theirs, task), daemon=True)
        with _deaf():
            self.process.start()
        theirs.close()

    def ready(self) -> dict[str, Any]:
        """Wait until the cell is ready and return what is known of it."""
        return dict(self._answer())

    def visit(self, number: int, warmup: int) -> Visit:
        """Return what a round takes."""
        try:
            self._connection.send((number, warmup))
        except OSError:
            raise WorkerError(self._end()) from None
        visit = self._answer()
        assert isinstance(visit, Visit)
        return visit

    def stop(self) -> None:
        """End the process, whatever it does."""
        if self.process.is_alive():
            self.process.kill()
        self.process.join()
        self._connection.close()

    def _answer(self) -> Any:
        try:
            kind, what = self._connection.recv()
        except (EOFError, OSError):
            raise WorkerError(self._end()) from None
        if kind == "failed":
            raise WorkerError(str(what))
        return what

    def _end(self) -> str:
        """Return how the process ended."""
        self.process.join(10)
        code = self.process.exitcode
        if code is not None and code < 0:
            name = signal.Signals(-code).name
            more = ", as the system does when memory runs out" if name == "SIGKILL" else ""
            return f"the process of the cell was ended by {name}{more}"
        return f"the process of the cell ended with code {code}"


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """Start processes that do not hear Ctrl-C, from their first moment on."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
