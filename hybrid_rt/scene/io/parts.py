"""What every reader hands over."""

from __future__ import annotations

import dataclasses

import numpy as np

from hybrid_rt.scene.io.words import F64, I64


@dataclasses.dataclass
class Triangles:
    """Triangles as a file has them, before they are a `Mesh`.

    Attributes
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    object_id : (F,) int64 or None
    polygon_id : (F,) int64 or None
        None where every triangle is a polygon of its own.
    skipped : str
        What of the file is no triangles and was left out; empty for nothing.
    """

    vertices: F64
    faces: I64
    object_id: I64 | None = None
    polygon_id: I64 | None = None
    skipped: str = ""


def runs(change: I64) -> I64:
    """Return 0, 1, 2 ... for ascending numbers, one for each that occurs."""
    return np.cumsum(np.diff(change, prepend=change[:1]) != 0)


def strip(corners: I64) -> I64:
    """Return the triangles (F, 3) of a strip, all of the winding of the first."""
    first = np.arange(max(0, len(corners) - 2))
    odd = first % 2
    return corners[np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)]


def fan(corners: I64) -> I64:
    """Return the triangles (F, 3) of a fan, whose first corner they share, in glTF's order."""
    first = np.arange(1, max(1, len(corners) - 1))
    return corners[np.stack([first, first + 1, np.zeros_like(first)], axis=1)]
