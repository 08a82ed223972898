"""The records in which arrays are handed to kernels: one convention for rays, view and results.

Every array is C-contiguous, in the machine's byte order and, since Numba has a type of its own for
read-only arrays, writable; who hands them over has checked them. Kernels take records first, then
numbers, and what they write last.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]
Bool = NDArray[np.bool_]


class SceneArrays(NamedTuple):
    """Triangles: vertices (V, 3) float32, world; faces (F, 3) and object_id (F,) int32."""

    vertices: F32
    faces: I32
    object_id: I32


class RayArrays(NamedTuple):
    """N rays: origin, direction (N, 3) float32, world; pixel (N, 2) int32; limits (N,) float32."""

    origin: F32
    direction: F32
    pixel: I32
    t_near: F32
    t_far: F32


class HitArrays(NamedTuple):
    """N hits: t (N,) float32, prim_id (N,) int32, u, v (N,) and n_g (N, 3) float32."""

    t: F32
    prim_id: I32
    u: F32
    v: F32
    n_g: F32


class MarchedArrays(NamedTuple):
    """The rows of a march's results, see `hybrid_rt.Marched`."""

    status: U8
    resolved: Bool
    pixel: I32
    prim_id: I32
    t: F32
    t_free: F32
    steps: I32


class ViewArrays(NamedTuple):
    """A view as a homogeneous map of ``p - eye``, and what leads back.

    ``m @ (p - eye, 1) = (x w, y w, w, d)``: x and y in pixels, ``depth = d / w``, the near plane at
    w = d and what is ahead of it at w > d. m (4, 4), eye (3,) float64. A pinhole has w = z_view and
    d = near, parallel lines of sight have w = 1.

    frame (4, 4) float64, with rows X, Y, W, D: the point x, y pixels from the screen's middle, at a
    depth, is ``sigma (x X + y Y + W) + depth D``, homogeneous and relative to the eye. sigma is
    near for a pinhole and 1 for parallel lines of sight.

    hand: 1.0, or -1.0 where the picture is the mirror image.
    """

    m: F64
    eye: F64
    frame: F64
    sigma: float
    hand: float


class SightArrays(NamedTuple):
    """Lines of sight: axes (3,) float64, the axis' place and 1 / scale in pixels, near and far."""

    eye: F64
    right: F64
    up: F64
    forward: F64
    cx: float
    cy: float
    inv_x: float
    inv_y: float
    parallel: bool
    near: float
    far: float


class GBufferArrays(NamedTuple):
    """What a view shows: depth, ddx, ddy (H, W) float32 and prim_id (H, W) int32."""

    depth: F32
    ddx: F32
    ddy: F32
    prim_id: I32


class PyramidArrays(NamedTuple):
    """Cells (C,) or (C, 3) float32; where a level begins, and its rows lie apart, (L,) int64."""

    cells: F32
    offsets: I64
    pitches: I64


class ListArrays(NamedTuple):
    """Primitives that touch each pixel: as `hybrid_rt.raster.lists.PrimitiveLists` has them."""

    prim_id: I32
    nearest: F32
    rest: F32
    planes: F32


class Box(NamedTuple):
    """A view as a proof needs it; `spread`, `deep`, `apart`: see `certified.scalar.trusted`.

    m, eye: as in `ViewArrays`; low, high (3,) float64: the scene's bounds.
    """

    m: F64
    eye: F64
    spread: float
    deep: float
    apart: float
    low: F64
    high: F64
