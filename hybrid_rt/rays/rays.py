"""Rays in linear arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt._arrays import F32, I32
from hybrid_rt.errors import ArgumentError


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays in linear arrays.

    Attributes
    ----------
    origin, direction : (N, 3) float32, world
        `direction` need not have unit length; every t is in units of its length.
    pixel : (N, 2) int32
        The pixel (x, y) on whose visible surface the ray starts; (-1, -1) for a ray that starts
        anywhere else.
    t_near, t_far : (N,) float32
        Only hits with ``t_near <= t <= t_far`` count.
    """

    origin: F32
    direction: F32
    pixel: I32
    t_near: F32
    t_far: F32

    @classmethod
    def from_arrays(
        cls,
        origin: Any,
        direction: Any,
        pixel: Any = None,
        t_near: Any = None,
        t_far: Any = None,
    ) -> Rays:
        """Return rays from arrays.

        Parameters
        ----------
        origin, direction : (N, 3) array_like of float, world
            A ray with a NaN, an infinity or a zero direction is kept: it is `MarchStatus.INVALID`
            in a march and hits nothing.
        pixel : (N, 2) array_like of int, optional
            Default (-1, -1).
        t_near, t_far : (N,) array_like of float, optional
            Default 0 and infinity. NaN or a negative `t_near` is refused.

        Raises
        ------
        ArgumentError
            Wrong shape, dtype or length; a NaN or negative `t_near`, a NaN `t_far`.
        """
        o = _check.array("origin", origin, ("N", 3), np.float32)
        d = _check.array("direction", direction, ("N", 3), np.float32)
        n = len(o)
        _check.same_length("direction", d, "origin", n)
        if pixel is None:
            px = np.full((n, 2), -1, np.int32)
        else:
            px = _check.array("pixel", pixel, ("N", 2), np.int32)
            _check.same_length("pixel", px, "origin", n)
        limits = []
        for argument, value, default in (("t_near", t_near, 0.0), ("t_far", t_far, np.inf)):
            if value is None:
                t = np.full(n, default, np.float32)
            else:
                t = _check.array(argument, value, ("N",), np.float32)
                _check.same_length(argument, t, "origin", n)
            limits.append(t)
        if not (limits[0] >= 0).all():
            raise ArgumentError("t_near", "values >= 0", "negative values or NaN")
        if np.isnan(limits[1]).any():
            raise ArgumentError("t_far", "values that are not NaN", "NaN")
        return cls(o, d, px, limits[0], limits[1])

    def __len__(self) -> int:
        return len(self.origin)

    @property
    def arrays(self) -> tuple[F32, F32, I32, F32, F32]:
        """All arrays, in the order of the attributes, as kernels take them."""
        return self.origin, self.direction, self.pixel, self.t_near, self.t_far

    def take(self, index: Any) -> Rays:
        """Return the rays selected by an index or boolean array."""
        return Rays(
            self.origin[index],
            self.direction[index],
            self.pixel[index],
            self.t_near[index],
            self.t_far[index],
        )
