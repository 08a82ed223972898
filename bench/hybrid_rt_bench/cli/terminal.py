"""What is written to the terminal, and what comes from it: streams, signals, exit codes.

Nothing that happens to a stream ends a run: one that can no longer be written to is left alone, and
the exit code says so in the end.
"""

from __future__ import annotations

import codecs
import contextlib
import errno
import os
import signal
import sys
from collections.abc import Iterator
from typing import IO, Any

from rich.console import Console

USAGE, FAILED, INTERRUPTED = 2, 3, 130

PLAIN = {"–": "-", "×": "x", "…": "...", "°": " degrees", "µ": "u", "\u2212": "-"}
"""What is written where a terminal's encoding has no such sign."""


class Stream:
    """A text stream that outlives its reader, and signs that its encoding does not have.

    Parameters
    ----------
    stream : file
        Is never closed here.

    Attributes
    ----------
    lost : OSError or None
        What the system said when it could first not be written to; nothing is written after that.
    """

    def __init__(self, stream: IO[str]) -> None:
        self._stream = stream
        self.lost: OSError | None = None

    def write(self, text: str) -> int:
        """Write text, unless the stream is lost."""
        if self.lost is None:
            try:
                self._stream.write(text)
            except OSError as error:
                self._lose(error)
        return len(text)

    def flush(self) -> None:
        """Write what is held back, unless the stream is lost."""
        if self.lost is None:
            try:
                self._stream.flush()
            except OSError as error:
                self._lose(error)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def _lose(self, error: OSError) -> None:
        self.lost = error
        # What the stream still holds goes nowhere, so that the interpreter can end in peace.
        with contextlib.suppress(OSError, ValueError, AttributeError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)


class Signals:
    """What asked the program to stop, if anything did."""

    came: int | None = None


signals = Signals()


WIDE = 160
"""Signs in a line of stdout where it is no terminal and nobody says how many there are."""

NARROWEST = 20
"""Fewer signs in a line than this are not taken for a width."""


def out() -> Console:
    """Return the console of stdout: as wide as COLUMNS says, else as its terminal, else wide."""
    width = asked_width()
    if width is None and not sys.stdout.isatty():
        width = WIDE
    return Console(width=width, markup=False, emoji=False, _environ=_others())


def err() -> Console:
    """Return the console of stderr, as wide as COLUMNS says, else as its terminal."""
    return Console(
        width=asked_width(), stderr=True, markup=False, emoji=False, highlight=False,
        _environ=_others(),
    )  # fmt: skip


def _others() -> dict[str, str]:
    """Return the environment without COLUMNS, of which Rich takes what is no width."""
    return {name: value for name, value in os.environ.items() if name != "COLUMNS"}


def asked_width() -> int | None:
    """Return the width that the environment variable COLUMNS says; None for nothing usable."""
    text = os.environ.get("COLUMNS", "").strip()
    if not (text.isascii() and text.isdigit()) or len(text) > 6:
        return None
    return int(text) if int(text) >= NARROWEST else None


@contextlib.contextmanager
def guarded() -> Iterator[None]:
    """Guard the streams, and have signals end the program in order, as Ctrl-C does.

    A signal that is ignored, as Ctrl-C is for what a shell runs in its background, stays ignored.
    """
    _open_standard()
    codecs.register_error("hybrid-rt", _plain)
    streams = sys.stdout, sys.stderr
    for stream in streams:
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="hybrid-rt")
    guards = Stream(sys.stdout), Stream(sys.stderr)
    sys.stdout, sys.stderr = guards
    signals.came = None
    before: dict[int, Any] = {}
    with contextlib.suppress(ValueError):  # not in the main thread
        for asked in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(asked) is not signal.SIG_IGN:
                before[asked] = signal.signal(asked, _stop)
    try:
        yield
    finally:
        for guard in guards:
            guard.flush()
        sys.stdout, sys.stderr = streams
        for number, handler in before.items():
            signal.signal(number, handler)


def end_code(code: int) -> int:
    """Return the exit code, which also says that output was lost; say so where it can be said."""
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    lost = getattr(sys.stdout, "lost", None)
    if lost is None or code:
        return code
    if lost.errno == errno.EPIPE:
        return 128 + getattr(signal, "SIGPIPE", 13)  # as what does not catch it ends
    complain(f"stdout cannot be written to ({lost.strerror})")
    return FAILED


def stop_code() -> int:
    """Return the exit code of a program that was stopped."""
    return INTERRUPTED if signals.came is None else 128 + signals.came


def complain(text: object) -> None:
    """Say on stderr what is wrong."""
    err().print(f"error: {text}", style="bold red", soft_wrap=True)


def _stop(number: int, frame: Any) -> None:
    signals.came = number
    raise KeyboardInterrupt


def _open_standard() -> None:
    """Give standard streams that were closed somewhere to go, so that no file takes their place."""
    with contextlib.suppress(OSError):
        while (handle := os.open(os.devnull, os.O_RDWR)) <= 2:
            pass
        os.close(handle)
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            mode = "r" if name == "stdin" else "w"
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def _plain(error: UnicodeError) -> tuple[str | bytes, int]:
    """Return plain signs for those that an encoding does not have."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    signs = error.object[error.start : error.end]
    return "".join(PLAIN.get(sign, "?") for sign in signs), error.end
