"""Reading the corners of faces, a face in each lane."""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined


@inlined
def vertices_of(faces, face, live):
    """Return the numbers of the vertices of faces, i32."""
    at = face * np.int32(3)
    return (
        simd.gather(faces, at, live, 0),
        simd.gather(faces, at + np.int32(1), live, 0),
        simd.gather(faces, at + np.int32(2), live, 0),
    )


@inlined
def place_of(vertices, vertex, live):
    """Return the coordinates of vertices, f64."""
    at = vertex * np.int32(3)
    return (
        simd.to_f64(simd.gather(vertices, at, live, 0.0)),
        simd.to_f64(simd.gather(vertices, at + np.int32(1), live, 0.0)),
        simd.to_f64(simd.gather(vertices, at + np.int32(2), live, 0.0)),
    )
