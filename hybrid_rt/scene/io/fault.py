"""What readers raise, and what they may spend."""

from __future__ import annotations

import os

from hybrid_rt import _check
from hybrid_rt.errors import MeshFileError

DEFAULT_LIMIT = 4 << 30
VARIABLE = "HYBRID_RT_MAX_MESH_BYTES"


class FormatError(Exception):
    """What is wrong with a file, and where in it; `read_mesh` adds the file's name."""


class Budget:
    """Bytes that one file may take unpacked.

    Parameters
    ----------
    max_bytes : int or None
        None stands for the environment variable HYBRID_RT_MAX_MESH_BYTES, or else 4 GiB.
    """

    def __init__(self, max_bytes: int | None) -> None:
        if max_bytes is None:
            text = os.environ.get(VARIABLE, str(DEFAULT_LIMIT))
            if not text.strip().isdecimal():
                raise MeshFileError(f"{VARIABLE}: expected a number of bytes, got {text!r}")
            max_bytes = int(text)
        self.limit = _check.integer("max_bytes", max_bytes, least=1)
        self.spent = 0

    def spend(self, size: int, what: str) -> None:
        """Raise a FormatError when `size` bytes more are over the limit."""
        self.spent += size
        if self.spent > self.limit:
            raise FormatError(
                f"{what}: {self.spent} bytes unpacked are over the limit of {self.limit}; "
                f"raise max_bytes or the environment variable {VARIABLE}"
            )
