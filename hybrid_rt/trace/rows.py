"""Which rays a tracer is asked for, and where their answers go."""

from __future__ import annotations

from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.base import check_rays
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import I32
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene


def checked_rays(rays: Rays, scene: Scene) -> None:
    """Raise unless these are rays that may be traced in a scene."""
    _check.instance("rays", rays, Rays)
    check_rays(rays, scene)


def checked_some(rays: Rays, scene: Scene, indices: Any, t_near: Any) -> tuple[Rays, I32 | None]:
    """Return rays with the t_near that is to be used, and indices that all are in range."""
    checked_rays(rays, scene)
    n = len(rays)
    places = None
    if indices is not None:
        places = _check.owned("indices", indices, ("M",), np.int32)
        _check.in_range("indices", places, 0, n - 1, f"there are {n} rays")
    if t_near is not None:
        near = _check.owned("t_near", t_near, ("N",), np.float32)
        _check.same_length("t_near", near, "rays", n)
        if not (near[rows_at(places)] >= 0).all():
            raise ArgumentError("t_near", "values >= 0", "negative values or NaN")
        rays = rays._starting(near)
    return rays, places


def writable_hits(hits: Hits, n: int) -> Hits:
    """Return `hits` if a kernel may write `n` rows there."""
    _check.instance("hits", hits, Hits)
    for name, shape, dtype in (
        ("t", (n,), np.float32),
        ("prim_id", (n,), np.int32),
        ("u", (n,), np.float32),
        ("v", (n,), np.float32),
        ("n_g", (n, 3), np.float32),
    ):
        _check.writable(f"hits.{name}", getattr(hits, name), shape, dtype)
    return hits


def rows_at(indices: I32 | None) -> Any:
    """Return what selects the rows of `indices`, or all of them."""
    return slice(None) if indices is None else indices
