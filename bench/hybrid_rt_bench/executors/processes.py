"""A process of its own for what must not share one: asked from here, answering there.

What is to be measured is a `Server`: made in the process from something plain, it then answers as
often as it is asked. A crash, or the system when memory runs out, costs only that process.
"""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any, Protocol

import hybrid_rt as hrt
from hybrid_rt_bench.measure import memory
from hybrid_rt_bench.measure.errors import reason_of

_PR_SET_PDEATHSIG = 1  # prctl(2)


class WorkerError(hrt.HybridRTError):
    """What the process was to do failed, or the process ended."""


class Server(Protocol):
    """What answers in a process.

    Attributes
    ----------
    details : dict
        What is known of it once it is ready.
    """

    details: dict[str, Any]

    def answer(self, *asked: Any) -> Any:
        """Return the answer to a question."""
        ...


class Worker:
    """A server in a process of its own.

    Parameters
    ----------
    make : callable
        Of a module, so that it can be sent by name; makes the server in the process.
    task : object
        What it is given; plain enough to be sent.

    Raises
    ------
    WorkerError
        By every method: what went wrong in the process, or how it ended.
    """

    def __init__(self, make: Callable[[Any], Server], task: Any) -> None:
        # Not by fork: threads of Numba and of the console do not survive one.
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(theirs, make, task), daemon=True)
        with _deaf():
            self.process.start()
        theirs.close()

    def ready(self) -> dict[str, Any]:
        """Wait until the server is ready and return what is known of it."""
        return dict(self._answer())

    def ask(self, *asked: Any) -> Any:
        """Return the answer to a question."""
        try:
            self._connection.send(asked)
        except OSError:
            raise WorkerError(self._end()) from None
        return self._answer()

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


def serve(connection: Connection, make: Callable[[Any], Server], task: Any) -> None:
    """Make a server ready and have it answer until nothing more is asked.

    Sent are ("ready", details), then for each question that comes ("answer", what it says); or
    ("failed", reason) once, and nothing after it. None that comes is the end.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started this one
    memory.first_to_go()
    _end_with_parent()
    with contextlib.suppress(EOFError, BrokenPipeError):
        try:
            server = make(task)
            connection.send(("ready", server.details))
            while (asked := connection.recv()) is not None:
                connection.send(("answer", server.answer(*asked)))
        except (EOFError, BrokenPipeError):
            raise
        except Exception as error:  # the cell is lost, and says why
            connection.send(("failed", reason_of(error)))


def _end_with_parent() -> None:
    """Have the system end this process when the one that started it ends, however that comes.

    Linux; elsewhere it ends after the question that it is at.
    """
    if sys.platform.startswith("linux"):
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


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
