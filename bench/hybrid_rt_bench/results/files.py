"""Write files so that each is there whole or as it was before, whatever ends the program.

A file is written beside its place, flushed to the disk, and then given its name; the folder is
flushed after that. What a killed program leaves is one hidden file, ``.NAME.part``, which `sweep`
takes away once nobody writes the folder any more.

Files that are only right together are written by `write_together`: all of them beside their places
first. Then one renaming, of the last one to ``.NAME.next``, decides that they count; if the program
dies after it and before all have their places, `sweep` brings them there.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hybrid_rt.errors import HybridRTError

try:
    import fcntl
except ImportError:  # not on Windows, where nothing is swept
    fcntl = None  # type: ignore[assignment]


class ReportsError(HybridRTError):
    """The folder of a run cannot be made, written or read."""


def write_atomic(path: Path, write: Callable[[Any], Any]) -> None:
    """Let `write` fill a binary file that then takes the place of `path`.

    Raises
    ------
    ReportsError
        The disk is full, or the folder cannot be written to.
    """
    part = _part(path.parent, path.name)
    with disk_errors(path):
        try:
            with open(part, "wb") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(part)
            raise
        sync_folder(path.parent)


def write_bytes(path: Path, content: bytes) -> None:
    """Write `content` as `write_atomic` does."""
    write_atomic(path, lambda file: file.write(content))


def write_together(folder: Path, writes: Mapping[str, Callable[[Any], Any]]) -> None:
    """Let several binary files of a folder take their places, all of them or none.

    Parameters
    ----------
    folder : Path
    writes : mapping of str to callable
        What fills each file, by its name. The last one decides: whoever reads the folder after
        `sweep` finds the others as they were when it was written.

    Raises
    ------
    ReportsError
        The disk is full, or the folder cannot be written to.
    """
    *others, last = writes
    with disk_errors(folder / last):
        _land(folder, others, last)  # what an earlier call could not bring to its place
        try:
            for name, write in writes.items():
                with open(_part(folder, name), "wb") as file:
                    write(file)
                    file.flush()
                    os.fsync(file.fileno())
            sync_folder(folder)
            os.replace(_part(folder, last), _next(folder, last))
        except BaseException:
            for name in writes:
                with contextlib.suppress(OSError):
                    os.unlink(_part(folder, name))
            raise
        sync_folder(folder)
        _land(folder, others, last)


def _land(folder: Path, others: Iterable[str], last: str) -> None:
    """Bring files to their places that are decided upon; without ``.LAST.next`` there are none."""
    if not _next(folder, last).exists():
        return
    for name in others:
        if _part(folder, name).exists():
            os.replace(_part(folder, name), folder / name)
    sync_folder(folder)
    os.replace(_next(folder, last), folder / last)
    sync_folder(folder)


def _part(folder: Path, name: str) -> Path:
    return folder / f".{name}.part"


def _next(folder: Path, name: str) -> Path:
    return folder / f".{name}.next"


def sync_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk, where the system can."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        with contextlib.suppress(OSError):  # some file systems refuse it for folders
            os.fsync(handle)
    finally:
        os.close(handle)


def hold(folder: Path) -> int | None:
    """Hold a folder until `release` or the end of the process; None where that cannot be."""
    if fcntl is None:
        return None
    handle = None
    try:
        handle = os.open(folder, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        if handle is not None:
            os.close(handle)
        return None
    return handle


def release(handle: int | None) -> None:
    """Let go of what `hold` returned."""
    if handle is not None:
        os.close(handle)


def sweep(folder: Path, together: Sequence[str]) -> None:
    """Bring to its place, or take away, what killed writers left, unless somebody holds the folder.

    Parameters
    ----------
    folder : Path
    together : sequence of str
        Names of the files that `write_together` writes, the last one last.
    """
    handle = hold(folder)
    if handle is None:
        return
    try:
        with contextlib.suppress(OSError):  # a folder that can only be read
            _land(folder, together[:-1], together[-1])
        for part in [*folder.glob(".*.part"), *folder.glob("*/.*.part")]:
            with contextlib.suppress(OSError):
                part.unlink()
    finally:
        release(handle)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold back Ctrl-C and the request to end until what is inside is whole."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before: dict[int, Any] = {}
    for asked in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(asked) is not signal.SIG_IGN:
            before[asked] = signal.signal(asked, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    for number in came[:1]:
        signal.raise_signal(number)


@contextlib.contextmanager
def disk_errors(path: Path) -> Iterator[None]:
    """Raise what the system says of `path` as a ReportsError."""
    try:
        yield
    except OSError as error:
        raise ReportsError(f"{path}: cannot be written ({reason(error)})") from error


def reason(error: BaseException) -> str:
    """Return what an exception says, without its number."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    return str(error)
