"""Split the rays between the screen and the tracer, and write what the screen answers."""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._faces import place_of, vertices_of
from hybrid_rt.kernels._jit import inlined, parallel_kernel
from hybrid_rt.kernels._queue import part, take

CHUNK = 4096  # rays counted together

F32, I32 = np.float32, np.int32


@inlined
def unresolved(resolved, i, end):
    """Return the mask of the rays from i on, before `end`, that are not resolved."""
    return ~simd.load_masked(resolved, i, simd.first(end - i), True)


@parallel_kernel
def count_unresolved(share, resolved, counts):
    """Count the unresolved rays of each chunk; resolved (N,) bool, counts (chunks,) int64."""
    n = resolved.shape[0]
    for chunk in part(share, counts.shape[0]):
        count = 0
        end = min(n, (chunk + 1) * CHUNK)
        for i in range(chunk * CHUNK, end, simd.WIDTH):
            count += simd.count(unresolved(resolved, i, end))
        counts[chunk] = count


@parallel_kernel
def list_unresolved(share, resolved, starts, indices):
    """Write which rays are unresolved, in their order; starts (chunks,) int64, indices int32."""
    n = resolved.shape[0]
    for chunk in part(share, starts.shape[0]):
        j = starts[chunk]
        end = min(n, (chunk + 1) * CHUNK)
        for i in range(chunk * CHUNK, end, simd.WIDTH):
            rest = unresolved(resolved, i, end)
            count = simd.count(rest)
            here = simd.compress(simd.iota() + I32(i), rest)
            simd.store_masked(indices, j, here, simd.first(count))
            j += count


HAND_OVER_BACK = 1.0 - 2.0**-8
HAND_OVER_REACH = 2.0**-16


@inlined
def longest(vectors, i, end):
    """Return the largest coordinates of the vectors from i on, before `end`, in float64."""
    x, y, z = simd.load_triples(vectors, 3 * i, end - i)
    largest = simd.maximum(simd.absolute(x), simd.absolute(y))
    return simd.to_f64(simd.maximum(largest, simd.absolute(z)))


@parallel_kernel
def hand_over(share, resolved, origin, direction, t_near, t_free, reach, starts):
    """Write where a tracer in float32 has to start on rays that are proven free up to t_free.

    starts (N,) float32: t_near for resolved rays, and never less than that for the others.

    The tracer's own t errs, by 3e-7 of t on ordinary triangles and, on large ones that are seen at
    a grazing angle, by as much of the scene's `reach` over the sine: a hit just behind t_free must
    not be rejected for it. The first term gives up little of what hand-over saves; the second,
    1.5e-5 of the scene, covers that error down to a quarter of a degree.
    """
    n = resolved.shape[0]
    for chunk in part(share, (n + CHUNK - 1) // CHUNK):
        end = min(n, (chunk + 1) * CHUNK)
        for i in range(chunk * CHUNK, end, simd.WIDTH):
            rest = unresolved(resolved, i, end)
            live = simd.first(end - i)
            near = simd.load_masked(t_near, i, live, 0.0)
            start = near
            if simd.any_(rest):
                far = simd.to_f64(simd.load_masked(t_free, i, rest, 0.0)) * HAND_OVER_BACK
                slack = HAND_OVER_REACH * (longest(origin, i, end) + reach)
                free = far - slack / longest(direction, i, end)
                # False for the NaN of a ray without direction.
                later = rest & (free > simd.to_f64(near))
                start = simd.select(later, simd.to_f32(free), near)
            simd.store_masked(starts, i, start, live)


@inlined
def answer(
    resolved, origin, direction, march_prim, march_t, vertices, faces, t, prim_id, u, v, n_g
):
    """Write the hits, or misses for march_prim -1, of those rays (n,) that are resolved.

    n_g is cross(b - a, c - a); u, v are the barycentrics of the point at march_t in the plane of
    the triangle.
    """
    n = resolved.shape[0]
    for k in range(0, n, simd.WIDTH):
        live = simd.load_masked(resolved, k, simd.first(n - k), False)
        if not simd.any_(live):
            continue
        prim = simd.load_masked(march_prim, k, live, I32(-1))
        distance = simd.load_masked(march_t, k, live, F32(0.0))
        hit = prim >= I32(0)
        a, b, c = vertices_of(faces, prim, hit)
        ax, ay, az = place_of(vertices, a, hit)
        bx, by, bz = place_of(vertices, b, hit)
        cx, cy, cz = place_of(vertices, c, hit)
        e1x, e1y, e1z = bx - ax, by - ay, bz - az
        e2x, e2y, e2z = cx - ax, cy - ay, cz - az
        nx, ny, nz = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
        inv = 1.0 / (nx * nx + ny * ny + nz * nz)
        along = simd.to_f64(distance)
        ox, oy, oz = simd.load_triples(origin, 3 * k, n - k)
        dx, dy, dz = simd.load_triples(direction, 3 * k, n - k)
        qx = simd.to_f64(ox) + along * simd.to_f64(dx) - ax
        qy = simd.to_f64(oy) + along * simd.to_f64(dy) - ay
        qz = simd.to_f64(oz) + along * simd.to_f64(dz) - az
        uu = (qy * e2z - qz * e2y) * nx + (qz * e2x - qx * e2z) * ny + (qx * e2y - qy * e2x) * nz
        vv = (e1y * qz - e1z * qy) * nx + (e1z * qx - e1x * qz) * ny + (e1x * qy - e1y * qx) * nz
        simd.store_masked(t, k, distance, live)
        simd.store_masked(prim_id, k, prim, live)
        simd.store_masked(u, k, simd.to_f32(simd.select(hit, uu * inv, 0.0)), live)
        simd.store_masked(v, k, simd.to_f32(simd.select(hit, vv * inv, 0.0)), live)
        simd.store_triples(
            n_g, 3 * k, simd.to_f32(simd.select(hit, nx, 0.0)),
            simd.to_f32(simd.select(hit, ny, 0.0)), simd.to_f32(simd.select(hit, nz, 0.0)), live,
        )  # fmt: skip


@parallel_kernel
def answer_occlusion(share, resolved, march_prim, occluded):
    """Write whether each ray that the march resolved meets anything; (N,) bool."""
    for i in part(share, resolved.shape[0]):
        if resolved[i]:
            occluded[i] = march_prim[i] >= 0


@parallel_kernel
def answer_hits(
    share, resolved, origin, direction, march_prim, march_t, vertices, faces,
    t, prim_id, u, v, n_g,
):  # fmt: skip
    """Write the hit of each ray that the march resolved; the other rows are left as they are.

    Workers take chunks as they come: resolved rays lie together.
    """
    n = resolved.shape[0]
    first = take(share, CHUNK)
    while first < n:
        last = min(n, first + CHUNK)
        answer(
            resolved[first:last], origin[first:last], direction[first:last],
            march_prim[first:last], march_t[first:last], vertices, faces,
            t[first:last], prim_id[first:last], u[first:last], v[first:last], n_g[first:last],
        )  # fmt: skip
        first = take(share, CHUNK)
