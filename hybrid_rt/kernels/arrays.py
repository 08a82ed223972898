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
    """A pinhole: pixel_from_world (3, 3) and eye (3,) float64, near plane's distance float64."""

    m: F64
    eye: F64
    near: float


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
    """A view as a proof needs it: the pinhole, a bound of its rows' sizes, the scene's bounds."""

    m: F64
    eye: F64
    near: float
    spread: float
    low: F64
    high: F64
