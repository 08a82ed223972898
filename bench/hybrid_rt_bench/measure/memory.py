"""Keep freed memory in the process, so that timed stages reuse it; say how much it has.

Every call of the library returns fresh arrays. The C library hands large blocks back to the system
when they are freed, and the system gives zeroed pages again one fault at a time: for large pictures
that is much of the merge, and no small part of tracing. A renderer keeps its buffers from frame to
frame, so it is not a cost of any technique, and it would hide what is measured.
"""

from __future__ import annotations

import contextlib
import ctypes
import re
import sys
from pathlib import Path

import psutil

_TRIM_THRESHOLD, _MMAP_MAX = -1, -4  # mallopt(3), glibc


def keep_freed() -> bool:
    """Tell the allocator to keep what is freed; return whether it is one that can (glibc)."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return False
    return bool(mallopt(_MMAP_MAX, 0) and mallopt(_TRIM_THRESHOLD, 2**31 - 1))


def trim() -> None:
    """Give the system back what is freed and kept (glibc; nothing elsewhere)."""
    if sys.platform.startswith("linux"):
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).malloc_trim(0)


def resident() -> int:
    """Return the bytes of memory that the process has."""
    return int(psutil.Process().memory_info().rss)


def peak() -> int | None:
    """Return the most bytes that the process had since it began, or since `reset_peak`.

    None where the system does not say.
    """
    kilobytes = re.search(r"^VmHWM:\s*(\d+) kB$", _status(), re.MULTILINE)
    if kilobytes:
        return 1024 * int(kilobytes[1])
    # Not ru_maxrss, which on Linux begins with what the parent had before exec.
    windows = getattr(psutil.Process().memory_info(), "peak_wset", None)
    if windows is not None:
        return int(windows)
    if sys.platform == "darwin":
        import resource

        return int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return None


def reset_peak() -> bool:
    """Let `peak` begin again from what the process has now; return whether the system can."""
    before = peak()
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return False
    after = peak()
    return before is not None and after is not None and after <= before


def first_to_go() -> None:
    """Have the system end this process, and not another, when memory runs out (Linux)."""
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")


def _status() -> str:
    try:
        return Path("/proc/self/status").read_text()
    except OSError:
        return ""
