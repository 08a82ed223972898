"""A tree of boxes over the triangles of a scene, independent of Embree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybrid_rt.kernels.arrays import F32, I32
from hybrid_rt.kernels.judging import bvh as kernels


@dataclass(frozen=True, eq=False)
class Bvh:
    """A binary tree of boxes.

    Attributes
    ----------
    box : (M, 6) float32, world
        Least corner, then greatest, of each node; exact, since vertices are float32. Node 0 is the
        root.
    link : (M, 2) int32
        (first, number) of a leaf's entries in `prim_id`, or (left child, 0); the right child comes
        behind the left.
    prim_id : (K,) int32
        The triangles, leaf after leaf.
    """

    box: F32
    link: I32
    prim_id: I32


def build_bvh(vertices: F32, faces: I32, prim_id: I32) -> Bvh:
    """Return a tree over some triangles.

    Parameters
    ----------
    vertices : (V, 3) float32, world
    faces : (F, 3) int32
    prim_id : (K,) int32
        The rows of `faces` to hold. None at all gives one empty leaf.
    """
    n = len(prim_id)
    low, high = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
    kernels.corners(vertices, faces, prim_id, low, high)
    order = np.arange(n, dtype=np.int32)
    box, link = np.empty((2 * n + 1, 6), np.float32), np.empty((2 * n + 1, 2), np.int32)
    nodes = kernels.build(low, high, order, box, link)
    return Bvh(box[:nodes].copy(), link[:nodes].copy(), prim_id[order])
