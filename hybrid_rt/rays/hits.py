"""Nearest intersections in linear arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hybrid_rt._arrays import F32, I32


@dataclass(frozen=True, eq=False)
class Hits:
    """Nearest intersections, one for each ray.

    Attributes
    ----------
    t : (N,) float32
        Distance in units of the length of the ray's direction; infinity for a miss.
    prim_id : (N,) int32
        Index into ``scene.faces``; -1 for a miss.
    u, v : (N,) float32
        Barycentrics: the hit is at (1 - u - v) a + u b + v c; 0 for a miss.
    n_g : (N, 3) float32, world
        ``cross(b - a, c - a)`` of the triangle, not of unit length; 0 for a miss.
    """

    t: F32
    prim_id: I32
    u: F32
    v: F32
    n_g: F32

    @classmethod
    def empty(cls, n: int) -> Hits:
        """Return `n` misses, to be filled by a tracer."""
        return cls(
            np.full(n, np.inf, np.float32),
            np.full(n, -1, np.int32),
            np.zeros(n, np.float32),
            np.zeros(n, np.float32),
            np.zeros((n, 3), np.float32),
        )

    @classmethod
    def unfilled(cls, n: int) -> Hits:
        """Return room for `n` hits, with nothing in it yet, for code that writes every row."""
        return cls(
            np.empty(n, np.float32),
            np.empty(n, np.int32),
            np.empty(n, np.float32),
            np.empty(n, np.float32),
            np.empty((n, 3), np.float32),
        )

    @property
    def arrays(self) -> tuple[F32, I32, F32, F32, F32]:
        """All arrays, in the order of the attributes, as kernels take them."""
        return self.t, self.prim_id, self.u, self.v, self.n_g

    def put(self, index: Any, values: Hits) -> None:
        """Write `values` into the rows selected by an index or boolean array."""
        for mine, theirs in zip(self.arrays, values.arrays, strict=True):
            mine[index] = theirs

    def __len__(self) -> int:
        return len(self.t)
