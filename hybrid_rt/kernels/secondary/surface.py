"""Make secondary rays from a G-buffer; vectors are tuples of three."""

from __future__ import annotations

import math

import numpy as np

from hybrid_rt.kernels._jit import called, inlined, parallel_kernel
from hybrid_rt.kernels._queue import part
from hybrid_rt.kernels.secondary.philox import uniform_pair
from hybrid_rt.kernels.secondary.sampling import (
    cosine_hemisphere,
    cross,
    dot,
    ggx_reflection,
    minus,
    scaled,
)

TILE_LOG2 = 5
TILE = 1 << TILE_LOG2  # pixels along a side: rays of one tile stay together
ULP = 2.0**-24  # half a unit in the last place of a float32, relative

# Embree finds t = dot(n_g, a - o) / dot(n_g, d) in float32. The three differences a - o, the two
# cross products behind n_g and the dot product round at most 3 + 4 + 3 times along any path to the
# numerator, so 16 half-ulps of |a - o| bound the distance at which a ray can meet the triangle it
# starts on.
SELF_HIT_ULPS = 16.0

# As many half-ulps of the distance to a light, and of the coordinates at both ends, bound the error
# of that distance and of Embree's t of a surface that the light lies on.
LIGHT_ULPS = 16.0

MIRROR, GLOSSY, COSINE, POINT, DIRECTION = range(5)  # what `aim` makes of a pixel


def _morton_order():
    """Return (TILE * TILE, 2) int64: the (x, y) of each Morton code of a tile."""
    code = np.arange(TILE * TILE)
    x, y = np.zeros_like(code), np.zeros_like(code)
    for bit in range(TILE_LOG2):
        x |= ((code >> (2 * bit)) & 1) << bit
        y |= ((code >> (2 * bit + 1)) & 1) << bit
    return np.stack([x, y], axis=1)


MORTON = _morton_order()


@parallel_kernel
def count_covered(share, prim_id, tiles_x, counts):
    """Count the covered pixels of each tile; prim_id (H, W), counts (tiles,) int64."""
    height, width = prim_id.shape
    for tile in part(share, counts.shape[0]):
        x0 = (tile % tiles_x) << TILE_LOG2
        y0 = (tile // tiles_x) << TILE_LOG2
        n = 0
        for y in range(y0, min(y0 + TILE, height)):
            for x in range(x0, min(x0 + TILE, width)):
                if prim_id[y, x] >= 0:
                    n += 1
        counts[tile] = n


@inlined
def next_float32(r, up):
    """Return the next float32 after r, `up` or down; np.nextafter costs fifty times as much."""
    if r == 0.0 or math.isinf(r):
        return np.nextafter(r, np.float32(np.inf if up else -np.inf))
    bits = np.float32(r).view(np.int32)
    return np.int32(bits + (1 if (bits >= 0) == up else -1)).view(np.float32)


@inlined
def round_towards(value, direction):
    """Return `value` rounded to float32, one ulp further in the sense of `direction`."""
    r = np.float32(value)
    if direction > 0.0:
        return next_float32(r, True)
    if direction < 0.0:
        return next_float32(r, False)
    return r


@inlined
def corner(vertices, index):
    """Return vertex `index` as float32."""
    return vertices[index, 0], vertices[index, 1], vertices[index, 2]


@inlined
def normal_towards(a, b, c, d):
    """Return the unit normal of triangle abc turned against the direction d."""
    n = cross(minus(b, a), minus(c, a))
    length = math.sqrt(dot(n, n))
    n = n[0] / length, n[1] / length, n[2] / length
    if dot(n, d) > 0.0:
        return -n[0], -n[1], -n[2]
    return n


@inlined
def surface_point(a, n, d, eye, z, unit):
    """Return the float32 point off the plane (a, n) where the view d from `eye` meets it.

    z is the stored z_view, and `unit` what one more of the stored depth, relative, takes from it.
    Where the raster clamped the depth of a sliver seen edge-on, the plane is far off and the stored
    depth is the surface.
    """
    cos_view = dot(n, d)
    if cos_view != 0.0:
        z_plane = dot(n, minus(a, eye)) / cos_view
        if abs(z_plane - z) <= 8.0 * ULP * unit:
            z = z_plane
    p = eye[0] + z * d[0], eye[1] + z * d[1], eye[2] + z * d[2]
    # OffsetRayOrigin (Pharr, Jakob and Humphreys, 6.8.6): along the normal by the error bound of
    # the point, here the rounding to float32, then every coordinate rounded outwards.
    offset = 2.0 * ULP * (abs(n[0] * p[0]) + abs(n[1] * p[1]) + abs(n[2] * p[2]))
    return (
        round_towards(p[0] + offset * n[0], n[0]),
        round_towards(p[1] + offset * n[1], n[1]),
        round_towards(p[2] + offset * n[2], n[2]),
    )


@inlined
def square_distance(a, b):
    """Return |a - b|**2."""
    q = minus(a, b)
    return dot(q, q)


@inlined
def self_hit_bound(a, b, c, o, cosine):
    """Return the t up to which a ray from o may meet the triangle abc that it starts on.

    All float32 but the ray's cosine with the normal. The farthest vertex bounds |a - o|, whichever
    vertex Embree calls a. A grazing ray's t of its own plane grows as 1 / cosine; beyond the
    triangle's reach it cannot be on the triangle any more.
    """
    farthest = max(square_distance(a, o), square_distance(b, o), square_distance(c, o))
    reach = np.float64(math.sqrt(farthest))
    return min(SELF_HIT_ULPS * ULP * reach / max(cosine, 1e-30), reach)


@inlined
def mirrored(d, n):
    """Return the direction d, of any length, as a unit vector reflected at the unit normal n."""
    inv = 1.0 / math.sqrt(dot(d, d))
    k = 2.0 * dot(n, d) * inv
    return minus(scaled(d, inv), scaled(n, k))


@inlined
def towards_light(o, light, u, v):
    """Return (unit direction, t_far) from o to light[0] + u light[1] + v light[2]; (9,) float64."""
    p = (
        light[0] + u * light[3] + v * light[6],
        light[1] + u * light[4] + v * light[7],
        light[2] + u * light[5] + v * light[8],
    )
    way = minus(p, o)
    distance = math.sqrt(dot(way, way))
    largest = 0.0
    for axis in range(3):
        largest = max(largest, abs(p[axis]), abs(np.float64(o[axis])))
    t_far = distance - LIGHT_ULPS * ULP * (distance + largest)
    return scaled(way, 1.0 / distance), t_far


@inlined
def aim(kind, x, y, d, n, o, alpha, reach, light, seed):
    """Return (direction, t_far) of the ray that leaves the surface seen along d at o."""
    if kind == MIRROR:
        return mirrored(d, n), np.inf
    if kind == DIRECTION:
        return (light[0], light[1], light[2]), np.inf
    u1, u2 = uniform_pair(x, y, seed)
    if kind == GLOSSY:
        return ggx_reflection(scaled(d, 1.0 / math.sqrt(dot(d, d))), n, alpha, u1, u2), np.inf
    if kind == COSINE:
        return cosine_hemisphere(n, u1, u2), reach
    return towards_light(o, light, u1, u2)


@inlined
def along_axes(origin, right, up, x, y):
    """Return a point or direction moved by x to the right and by y upwards."""
    return (
        origin[0] + x * right[0] + y * up[0],
        origin[1] + x * right[1] + y * up[1],
        origin[2] + x * right[2] + y * up[2],
    )


@inlined
def sight_of(x, y, depth, sight):
    """Return (origin, direction, z, unit): the line of sight of a pixel, and where its surface is.

    The surface is at origin + z direction, and `unit` is by how much z falls as depth grows,
    relative to depth: see `surface_point`.
    """
    x_v = (x + 0.5 - sight.cx) * sight.inv_x
    y_v = (sight.cy - y - 0.5) * sight.inv_y
    eye, forward = sight.eye, sight.forward
    if sight.parallel:
        unit = (sight.far - sight.near) * depth
        origin = along_axes(eye, sight.right, sight.up, x_v, y_v)
        return origin, (forward[0], forward[1], forward[2]), sight.far - unit, unit
    z = sight.near / depth
    direction = along_axes(forward, sight.right, sight.up, x_v, y_v)
    return (eye[0], eye[1], eye[2]), direction, z, z


@called
def tile_rays(
    kind, alpha, reach, light, seed, first, x0, y0, prim_id, depth, vertices, faces, sight,
    origin, direction, pixel, t_near, t_far, kept,
):  # fmt: skip
    """Write the rays of the tile at (x0, y0) from row `first` on; see `surface_rays`."""
    height, width = prim_id.shape
    i = first
    for code in range(TILE * TILE):
        x, y = x0 + MORTON[code, 0], y0 + MORTON[code, 1]
        if x >= width or y >= height or prim_id[y, x] < 0:
            continue
        a = corner(vertices, faces[prim_id[y, x], 0])
        b = corner(vertices, faces[prim_id[y, x], 1])
        c = corner(vertices, faces[prim_id[y, x], 2])
        a64 = np.float64(a[0]), np.float64(a[1]), np.float64(a[2])
        e, d, z, unit = sight_of(x, y, np.float64(depth[y, x]), sight)
        n = normal_towards(a64, b, c, d)
        o = surface_point(a64, n, d, e, z, unit)
        r, far = aim(kind, x, y, d, n, o, alpha, reach, light, seed)
        far = np.float32(far)
        pixel[i, 0], pixel[i, 1] = x, y
        for axis in range(3):
            origin[i, axis] = o[axis]
            direction[i, axis] = r[axis]
        t_far[i] = far
        t_near[i] = min(np.float32(self_hit_bound(a, b, c, o, abs(dot(r, n)))), far)
        rounded = direction[i, 0], direction[i, 1], direction[i, 2]
        kept[i] = kind == MIRROR or (dot(rounded, n) > 0.0 and far > 0.0)
        i += 1


@parallel_kernel
def surface_rays(
    share, kind, alpha, reach, light, seed, prim_id, depth, vertices, faces, sight,
    tiles_x, starts,
    origin, direction, pixel, t_near, t_far, kept,
):  # fmt: skip
    """Write one ray for each covered pixel, tile by tile in Morton order.

    `kind` and its parameters: alpha (GLOSSY), reach (COSINE), light (9,) float64 (POINT: a point
    and two edges; DIRECTION: the unit vector towards it), seed. prim_id (H, W) int32, depth (H, W)
    float32, starts (tiles,) int64: the first ray of each tile. Outputs (N, 3), (N, 3) float32,
    (N, 2) int32, (N,) float32 twice, (N,) bool: whether there is such a ray at all.
    """
    for tile in part(share, starts.shape[0]):
        tile_rays(
            kind, alpha, reach, light, seed, starts[tile],
            (tile % tiles_x) << TILE_LOG2, (tile // tiles_x) << TILE_LOG2,
            prim_id, depth, vertices, faces, sight, origin, direction, pixel, t_near, t_far, kept,
        )  # fmt: skip
