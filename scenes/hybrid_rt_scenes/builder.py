"""Spend a number of triangles on the parts of a place."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hybrid_rt import _check
from hybrid_rt_scenes.primitives import Part, join, place


def choose_detail(cost: Callable[[int], float], budget: float, most: int) -> int:
    """Return the largest detail from 0 to `most` whose `cost(detail)` is within `budget`."""
    chosen = 0
    for detail in range(1, most + 1):
        if cost(detail) > budget:
            break
        chosen = detail
    return chosen


def checked_size(size: int, seed: int, least: int, most: int) -> np.random.Generator:
    """Return the random numbers of a seed, once size and seed are found to be in range."""
    _check.integer("size", size, least=least, most=most)
    return np.random.default_rng(_check.integer("seed", seed, least=0))


class Builder:
    """Collects parts, each under an object id of its own, and counts their triangles."""

    def __init__(self) -> None:
        self._parts: list[Part] = []
        self._ids: list[int] = []
        self.triangles = 0

    def add(self, *parts: Part) -> None:
        """Add parts that are one object together."""
        part = join(parts)
        if part.triangles:
            self._parts.append(part)
            self._ids.append(len(self._ids))
            self.triangles += part.triangles

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:
        """Return vertices float32, faces and object ids int32."""
        whole = join(self._parts)
        ids = np.repeat(self._ids, [p.triangles for p in self._parts])
        return (
            whole.vertices.astype(np.float32),
            whole.faces.astype(np.int32),
            ids.astype(np.int32),
        )

    def fill(
        self,
        make: Callable[[int], Part],
        at: ArrayLike,
        yaw: ArrayLike,
        budget: float,
        *,
        scale: ArrayLike = 1.0,
        most: int = 24,
    ) -> None:
        """Add copies of a thing, as detailed as `budget` allows, and fewer if that is too much.

        ``make(detail)`` grows with `detail`; `at`, `yaw` and `scale` are those of `place`.
        """
        where = np.atleast_2d(np.asarray(at, np.float64))
        total = len(where)
        detail = choose_detail(lambda d: make(d).triangles * total, budget, most)
        part = make(detail)
        n = min(total, int(budget // max(part.triangles, 1)))
        if n:
            turn = np.broadcast_to(np.asarray(yaw, np.float64), total)
            factors = np.broadcast_to(np.asarray(scale, np.float64), (total, 3))
            self.add(place(part, where[:n], turn[:n], factors[:n]))
