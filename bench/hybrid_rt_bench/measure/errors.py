"""What can go wrong with a run, and how it is told."""

from __future__ import annotations

import traceback
from pathlib import Path

from hybrid_rt.errors import HybridRTError


class NothingToRunError(HybridRTError):
    """None of the scenes asked for can be had."""


class CellError(HybridRTError):
    """A cell that cannot be measured."""


def reason_of(error: BaseException) -> str:
    """Return what an exception says, on one line, with its place if it was not made on purpose."""
    if isinstance(error, HybridRTError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"not enough memory ({error})" if str(error) else "not enough memory"
    frames = traceback.extract_tb(error.__traceback__)
    where = f" (in {frames[-1].name}, {Path(frames[-1].filename).name})" if frames else ""
    return f"{type(error).__name__}: {error}{where}"
