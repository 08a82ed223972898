"""Split the rays between the screen and the tracer, and write what the screen answers."""

from __future__ import annotations

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import fetch_add

CHUNK = 4096  # rays counted together


@parallel_kernel
def count_unresolved(resolved, counts):
    """Count the unresolved rays of each chunk; resolved (N,) bool, counts (chunks,) int64."""
    n = resolved.shape[0]
    for chunk in prange(counts.shape[0]):
        count = 0
        for i in range(chunk * CHUNK, min(n, (chunk + 1) * CHUNK)):
            if not resolved[i]:
                count += 1
        counts[chunk] = count


HAND_OVER_BACK = 1.0 - 2.0**-8
HAND_OVER_REACH = 2.0**-16


@inlined
def handed_over(i, origin, direction, t_free, reach):
    """Return where a tracer in float32 has to start on a ray that is proven free up to t_free.

    The tracer's own t errs, by 3e-7 of t on ordinary triangles and, on large ones that are seen at
    a grazing angle, by as much of the scene's `reach` over the sine: a hit just behind t_free must
    not be rejected for it. The first term gives up 0.4 % of what hand-over saves; the second,
    1.5e-5 of the scene, covers that error down to a quarter of a degree.
    """
    o = max(abs(origin[i, 0]), abs(origin[i, 1]), abs(origin[i, 2]))
    d = max(abs(direction[i, 0]), abs(direction[i, 1]), abs(direction[i, 2]))
    return t_free[i] * HAND_OVER_BACK - HAND_OVER_REACH * (o + reach) / d


@parallel_kernel
def list_unresolved(resolved, starts, indices):
    """Write which rays are unresolved, in their order; starts (chunks,) int64, indices int32."""
    n = resolved.shape[0]
    for chunk in prange(starts.shape[0]):
        j = starts[chunk]
        for i in range(chunk * CHUNK, min(n, (chunk + 1) * CHUNK)):
            if not resolved[i]:
                indices[j] = i
                j += 1


@parallel_kernel
def hand_over(indices, origin, direction, t_near, t_free, reach, starts):
    """Write from where the rays at `indices` are no longer known to be free; starts (N,) float32.

    The other rows are left as they are.
    """
    for k in prange(indices.shape[0]):
        i = indices[k]
        starts[i] = t_near[i]
        start = handed_over(i, origin, direction, t_free, reach)
        if start > t_near[i]:  # false for the NaN of a ray without direction
            starts[i] = start


@kernel
def barycentrics(ax, ay, az, bx, by, bz, cx, cy, cz, nx, ny, nz, px, py, pz):
    """Return (u, v) of a point of the plane of triangle abc, n being cross(b - a, c - a)."""
    inv = 1.0 / (nx * nx + ny * ny + nz * nz)
    qx, qy, qz = px - ax, py - ay, pz - az
    e1x, e1y, e1z = bx - ax, by - ay, bz - az
    e2x, e2y, e2z = cx - ax, cy - ay, cz - az
    u = ((qy * e2z - qz * e2y) * nx + (qz * e2x - qx * e2z) * ny + (qx * e2y - qy * e2x) * nz) * inv
    v = ((e1y * qz - e1z * qy) * nx + (e1z * qx - e1x * qz) * ny + (e1x * qy - e1y * qx) * nz) * inv
    return u, v


@kernel
def answer(i, origin, direction, prim, distance, vertices, faces, t, prim_id, u, v, n_g):
    """Write the hit of ray i on primitive `prim` at t = `distance`, or a miss for -1."""
    t[i] = distance
    prim_id[i] = prim
    if prim < 0:
        u[i] = 0.0
        v[i] = 0.0
        for axis in range(3):
            n_g[i, axis] = 0.0
        return
    a, b, c = faces[prim, 0], faces[prim, 1], faces[prim, 2]
    ax, ay, az = np.float64(vertices[a, 0]), np.float64(vertices[a, 1]), np.float64(vertices[a, 2])
    bx, by, bz = np.float64(vertices[b, 0]), np.float64(vertices[b, 1]), np.float64(vertices[b, 2])
    cx, cy, cz = np.float64(vertices[c, 0]), np.float64(vertices[c, 1]), np.float64(vertices[c, 2])
    nx = (by - ay) * (cz - az) - (bz - az) * (cy - ay)
    ny = (bz - az) * (cx - ax) - (bx - ax) * (cz - az)
    nz = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    uu, vv = barycentrics(
        ax,
        ay,
        az,
        bx,
        by,
        bz,
        cx,
        cy,
        cz,
        nx,
        ny,
        nz,
        origin[i, 0] + np.float64(distance) * direction[i, 0],
        origin[i, 1] + np.float64(distance) * direction[i, 1],
        origin[i, 2] + np.float64(distance) * direction[i, 2],
    )
    u[i] = uu
    v[i] = vv
    n_g[i, 0] = nx
    n_g[i, 1] = ny
    n_g[i, 2] = nz


@parallel_kernel
def answer_occlusion(resolved, march_prim, occluded):
    """Write whether each ray that the march resolved meets anything; (N,) bool."""
    for i in prange(resolved.shape[0]):
        if resolved[i]:
            occluded[i] = march_prim[i] >= 0


@parallel_kernel
def answer_hits(
    workers, resolved, origin, direction, march_prim, march_t, vertices, faces,
    t, prim_id, u, v, n_g,
):  # fmt: skip
    """Write the hit of each ray that the march resolved; the other rows are left as they are.

    Workers take chunks as they come: resolved rays lie together.
    """
    n = resolved.shape[0]
    taken = np.zeros(1, np.int64)
    for _worker in prange(workers):
        first = fetch_add(taken.ctypes.data, CHUNK)
        while first < n:
            for i in range(first, min(n, first + CHUNK)):
                if resolved[i]:
                    answer(
                        i, origin, direction, march_prim[i], march_t[i], vertices, faces,
                        t, prim_id, u, v, n_g,
                    )  # fmt: skip
            first = fetch_add(taken.ctypes.data, CHUNK)
