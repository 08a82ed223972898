"""Make the lists of primitives that touch each pixel."""

from __future__ import annotations

import numpy as np

from hybrid_rt import _threads
from hybrid_rt.kernels import lists as kernels
from hybrid_rt.kernels.raster import prefix_sums
from hybrid_rt.types import Camera, PrimitiveLists, Scene

MARGIN_ULPS = 16
"""Growth of a pixel in units of 2**-24 times the longer side; see `hybrid_rt.kernels.certified`."""
BATCH_FACES = 1 << 21
BATCH_ENTRIES = 1 << 26
CHUNKS = 64
CHUNK_FACES = 1024


def primitive_lists(
    scene: Scene, camera: Camera, length: int, threads: int | None = None
) -> PrimitiveLists:
    """Return for each pixel the `length` primitives that can be nearest anywhere in its square.

    Arguments as `hybrid_rt.rasterize` has checked them.
    """
    width, height, near = camera.width, camera.height, float(camera.near)
    margin = MARGIN_ULPS * 2.0**-24 * (max(width, height) + 1)
    prim_id = np.full((height, width, length), -1, np.int32)
    nearest = np.zeros((height, width, length), np.float32)
    rest = np.zeros((height, width), np.float32)
    vertices, faces = scene.vertices, scene.faces
    eye = np.array(camera.eye, np.float64)
    m, frame = camera.pixel_from_world, camera.world_from_pixel
    tiles_x = -(-width // kernels.TILE)
    tiles = tiles_x * -(-height // kernels.TILE)
    with _threads.limited(threads) as lanes:
        size = min(len(faces), BATCH_FACES)
        first = 0
        while first < len(faces):
            last = min(first + size, len(faces))
            chunk = -(-(last - first) // CHUNKS)
            chunks = -(-(last - first) // chunk)
            cursors = np.zeros((chunks, tiles), np.int32)
            place = (
                vertices, faces, first, last, eye, m, near, width, height, margin, tiles_x, chunk,
            )  # fmt: skip
            kernels.bin_faces(*place, cursors, np.empty(0, np.int32))
            entries = int(cursors.sum(dtype=np.int64))
            if entries > BATCH_ENTRIES and size > 1:
                size = -(-size // 2)
                continue
            tile_start = np.empty(tiles + 1, np.int32)
            prefix_sums(
                np.zeros(chunks, np.int32), cursors, np.empty(chunks + 1, np.int32), tile_start
            )
            bins = np.empty(entries, np.int32)
            if entries:
                kernels.bin_faces(*place, cursors, bins)
            kernels.fill_lists(
                vertices, faces, tile_start, bins, eye, m, frame, near, width, height, margin,
                tiles_x, lanes, prim_id, nearest, rest,
            )  # fmt: skip
            first = last
    planes = np.empty((len(faces), kernels.PLANE_ROW), np.float32)
    with _threads.limited(threads):
        kernels.face_planes(
            vertices, faces, eye, m, frame, near, width, height, margin, CHUNK_FACES, planes
        )
    return PrimitiveLists(prim_id, nearest, rest, planes, margin)
