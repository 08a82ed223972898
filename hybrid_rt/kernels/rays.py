"""Make secondary rays from a G-buffer."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel

TILE_LOG2 = 5
TILE = 1 << TILE_LOG2  # pixels along a side: rays of one tile stay together
ULP = 2.0**-24  # half a unit in the last place of a float32, relative

# Embree finds t = dot(n_g, a - o) / dot(n_g, d) in float32. The three differences a - o, the two
# cross products behind n_g and the dot product round at most 3 + 4 + 3 times along any path to the
# numerator, so 16 half-ulps of |a - o| bound the distance at which a ray can meet the triangle it
# starts on.
SELF_HIT_ULPS = 16.0


@inlined
def morton_decode(code):
    """Return (x, y) of a Morton code of 2 x TILE_LOG2 bits."""
    x = 0
    y = 0
    for bit in range(TILE_LOG2):
        x |= ((code >> (2 * bit)) & 1) << bit
        y |= ((code >> (2 * bit + 1)) & 1) << bit
    return x, y


@parallel_kernel
def count_covered(prim_id, tiles_x, counts):
    """Count the covered pixels of each tile; prim_id (H, W), counts (tiles,) int64."""
    height, width = prim_id.shape
    for tile in prange(counts.shape[0]):
        x0 = (tile % tiles_x) << TILE_LOG2
        y0 = (tile // tiles_x) << TILE_LOG2
        n = 0
        for y in range(y0, min(y0 + TILE, height)):
            for x in range(x0, min(x0 + TILE, width)):
                if prim_id[y, x] >= 0:
                    n += 1
        counts[tile] = n


@inlined
def face_towards(nx, ny, nz, dx, dy, dz):
    """Return the normal turned against the direction d."""
    if nx * dx + ny * dy + nz * dz > 0.0:
        return -nx, -ny, -nz
    return nx, ny, nz


@inlined
def round_towards(value, direction):
    """Return `value` rounded to float32, one ulp further in the sense of `direction`."""
    r = np.float32(value)
    if direction > 0.0:
        return np.nextafter(r, np.float32(np.inf))
    if direction < 0.0:
        return np.nextafter(r, np.float32(-np.inf))
    return r


@kernel
def mirror_ray(
    i,
    x,
    y,
    prim,
    depth,
    vertices,
    faces,
    eye,
    right,
    up,
    forward,
    half_w,
    half_h,
    inv_focal,
    near,
    origin,
    direction,
    t_near,
):
    """Write ray i: the view through the centre of pixel (x, y), mirrored at primitive `prim`."""
    a, b, c = faces[prim, 0], faces[prim, 1], faces[prim, 2]
    ax, ay, az = np.float64(vertices[a, 0]), np.float64(vertices[a, 1]), np.float64(vertices[a, 2])
    e1x, e1y, e1z = vertices[b, 0] - ax, vertices[b, 1] - ay, vertices[b, 2] - az
    e2x, e2y, e2z = vertices[c, 0] - ax, vertices[c, 1] - ay, vertices[c, 2] - az
    nx = e1y * e2z - e1z * e2y
    ny = e1z * e2x - e1x * e2z
    nz = e1x * e2y - e1y * e2x
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    x_v = (x + 0.5 - half_w) * inv_focal
    y_v = (half_h - y - 0.5) * inv_focal
    dx = forward[0] + x_v * right[0] + y_v * up[0]
    dy = forward[1] + x_v * right[1] + y_v * up[1]
    dz = forward[2] + x_v * right[2] + y_v * up[2]
    nx, ny, nz = face_towards(nx, ny, nz, dx, dy, dz)
    # z_view on the triangle's plane; where the raster clamped the depth of a sliver seen edge-on,
    # the plane is far off and the stored depth is the surface.
    z = near / depth
    cos_view = nx * dx + ny * dy + nz * dz
    if cos_view != 0.0:
        z_plane = (nx * (ax - eye[0]) + ny * (ay - eye[1]) + nz * (az - eye[2])) / cos_view
        if abs(z_plane - z) <= 8.0 * ULP * z:
            z = z_plane
    px, py, pz = eye[0] + z * dx, eye[1] + z * dy, eye[2] + z * dz
    inv = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
    k = 2.0 * cos_view * inv
    rx, ry, rz = dx * inv - k * nx, dy * inv - k * ny, dz * inv - k * nz
    # OffsetRayOrigin (Pharr, Jakob and Humphreys, 6.8.6): along the normal by the error bound of
    # the point, here the rounding to float32, then every coordinate rounded outwards.
    offset = 2.0 * ULP * (abs(nx * px) + abs(ny * py) + abs(nz * pz))
    ox = round_towards(px + offset * nx, nx)
    oy = round_towards(py + offset * ny, ny)
    oz = round_towards(pz + offset * nz, nz)
    origin[i, 0], origin[i, 1], origin[i, 2] = ox, oy, oz
    direction[i, 0], direction[i, 1], direction[i, 2] = rx, ry, rz
    # The farthest vertex bounds |a - o|, whichever vertex Embree calls a.
    reach = 0.0
    for corner in range(3):
        v = faces[prim, corner]
        qx, qy, qz = vertices[v, 0] - ox, vertices[v, 1] - oy, vertices[v, 2] - oz
        reach = max(reach, math.sqrt(qx * qx + qy * qy + qz * qz))
    cos_mirror = abs(rx * nx + ry * ny + rz * nz)
    # A grazing mirror ray's t of its own plane grows as 1 / cosine. Beyond the triangle's reach it
    # cannot be on the triangle any more.
    t_near[i] = min(SELF_HIT_ULPS * ULP * reach / max(cos_mirror, 1e-30), reach)


@parallel_kernel
def mirror_rays(
    prim_id,
    depth,
    vertices,
    faces,
    eye,
    right,
    up,
    forward,
    inv_focal,
    near,
    tiles_x,
    starts,
    origin,
    direction,
    pixel,
    t_near,
):
    """Write one mirror ray for each covered pixel, tile by tile in Morton order.

    prim_id (H, W) int32, depth (H, W) float32, starts (tiles,) int64: the first ray of each tile.
    Outputs (N, 3), (N, 3) float32, (N, 2) int32, (N,) float32.
    """
    height, width = prim_id.shape
    for tile in prange(starts.shape[0]):
        x0 = (tile % tiles_x) << TILE_LOG2
        y0 = (tile // tiles_x) << TILE_LOG2
        i = starts[tile]
        for code in range(TILE * TILE):
            tx, ty = morton_decode(code)
            x, y = x0 + tx, y0 + ty
            if x < width and y < height and prim_id[y, x] >= 0:
                mirror_ray(
                    i,
                    x,
                    y,
                    prim_id[y, x],
                    np.float64(depth[y, x]),
                    vertices,
                    faces,
                    eye,
                    right,
                    up,
                    forward,
                    0.5 * width,
                    0.5 * height,
                    inv_focal,
                    near,
                    origin,
                    direction,
                    t_near,
                )
                pixel[i, 0] = x
                pixel[i, 1] = y
                i += 1
