"""Nearest intersections in linear arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F32, I32, HitArrays

if TYPE_CHECKING:
    from pandas import DataFrame

LARGEST = 2**31 - 1
"""Rays in one call: kernels number them in int32."""


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
        n = _check.integer("n", n, least=0, most=LARGEST)
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
        n = _check.integer("n", n, least=0, most=LARGEST)
        return cls(
            np.empty(n, np.float32),
            np.empty(n, np.int32),
            np.empty(n, np.float32),
            np.empty(n, np.float32),
            np.empty((n, 3), np.float32),
        )

    @property
    def arrays(self) -> HitArrays:
        """All arrays, in the order of the attributes, as kernels take them."""
        return HitArrays(self.t, self.prim_id, self.u, self.v, self.n_g)

    def put(self, index: Any, values: Hits) -> None:
        """Write `values` into the rows selected by an index or boolean array."""
        _check.instance("values", values, Hits)
        try:
            for mine, theirs in zip(self.arrays, values.arrays, strict=True):
                mine[index] = theirs
        except Exception as error:  # an index of anything, arrays that are read-only
            expected = f"rows of {len(self)} writable hits, as many as there are values"
            raise ArgumentError("index", expected, f"{_check.describe(index)}: {error}") from error

    def to_pandas(self) -> DataFrame:
        """Return a table of its own with a row for each ray.

        Returns
        -------
        pandas.DataFrame
            Columns t, prim_id, u, v, n_g_x, n_g_y, n_g_z with the dtypes of the arrays.
        """
        from pandas import DataFrame  # half a second, for those who want it

        columns = {"t": self.t, "prim_id": self.prim_id, "u": self.u, "v": self.v}
        normals = {f"n_g_{axis}": self.n_g[:, k] for k, axis in enumerate("xyz")}
        return DataFrame({name: array.copy() for name, array in (columns | normals).items()})

    def __repr__(self) -> str:
        return f"<Hits of {len(self)} rays: {int((self.prim_id >= 0).sum())} hit>"

    def _checked(self, argument: str, n: int, faces: int) -> Hits:
        """Return these hits if they can be those of N rays in a scene of so many faces.

        Raises
        ------
        ArgumentError
            Arrays of another length, shape or dtype, a prim_id that the scene does not have, a hit
            whose t is not finite, a miss whose t is. `argument` is what they are called in it.
        """
        hits = Hits(
            *(
                _check.array(f"{argument}.{name}", getattr(self, name), shape, dtype)
                for name, shape, dtype in (
                    ("t", (n,), np.float32),
                    ("prim_id", (n,), np.int32),
                    ("u", (n,), np.float32),
                    ("v", (n,), np.float32),
                    ("n_g", (n, 3), np.float32),
                )
            )
        )
        _check.in_range(f"{argument}.prim_id", hits.prim_id, -1, faces - 1, f"{faces} triangles")
        odd = np.flatnonzero(np.isfinite(hits.t) != (hits.prim_id >= 0))
        if len(odd):
            expected = "a finite t where prim_id names a triangle, infinity where it is -1"
            got = f"t {hits.t[odd[0]]} and prim_id {hits.prim_id[odd[0]]} for ray {odd[0]}"
            raise ArgumentError(f"{argument}.t", expected, got)
        return hits

    def __len__(self) -> int:
        return len(self.t)
