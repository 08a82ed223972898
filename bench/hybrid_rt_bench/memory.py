"""Keep freed memory in the process, so that timed stages reuse it.

Every call of the library returns fresh arrays. The C library hands large blocks back to the system
when they are freed, and the system gives zeroed pages again one fault at a time: at 3840x2160 that
took two thirds of the merge and a third of tracing. A renderer keeps its buffers from frame to
frame, so it is not a cost of any technique, and it would hide what is measured.
"""

from __future__ import annotations

import ctypes
import sys

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
