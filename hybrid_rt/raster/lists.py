"""Make the lists of primitives that touch each pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybrid_rt import _threads
from hybrid_rt.camera.camera import Camera
from hybrid_rt.kernels.arrays import F32, I32, ListArrays
from hybrid_rt.kernels.raster import lists as kernels
from hybrid_rt.kernels.raster import lists_bins as bin_kernels
from hybrid_rt.kernels.raster.bins import TILE, prefix_sums
from hybrid_rt.kernels.raster.lists_planes import PLANE_ROW
from hybrid_rt.scene.mesh import Scene


@dataclass(frozen=True, eq=False)
class PrimitiveLists:
    """For each pixel, the primitives that touch its square, as far as the list goes.

    A pixel's square is grown by `margin_px` to each side. Every triangle with a point between the
    near plane and, of an orthographic camera, the far plane that projects into the grown square is
    in the pixel's list, with a bound that none of these points is nearer than, or `rest` is such a
    bound.

    Attributes
    ----------
    prim_id : (H, W, K) int32
        Index into ``scene.faces``, nearest bound first, -1 past the end.
    nearest : (H, W, K) float32
        Upper bound of the depth, descending; 0 past the end.
    rest : (H, W) float32
        Upper bound of the depth of everything that is not in the list; 0 if that is nothing.
    planes : (F, 8) float32
        For each face that is in a list the plane of its depth, with its error; see
        `kernels.raster.lists_planes`. NaN where there is none to be trusted. Rows of faces that
        are in no list mean nothing.
    margin_px : float
    camera : Camera
        Whose pixels these are; not always that of the G-buffer, see `hybrid_rt.Certified`.
    """

    prim_id: I32
    nearest: F32
    rest: F32
    planes: F32
    margin_px: float
    camera: Camera

    @property
    def arrays(self) -> ListArrays:
        """All arrays, as kernels take them."""
        return ListArrays(self.prim_id, self.nearest, self.rest, self.planes)

    @property
    def length(self) -> int:
        """K, the largest number of primitives in a list."""
        return int(self.prim_id.shape[2])

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays: 8 K + 4 a pixel, 32 a face."""
        return sum(array.nbytes for array in self.arrays)


MARGIN_ULPS = 16
"""Growth of a pixel in units of 2**-24 times the longer side; see `certified.scalar`."""
BATCH_FACES = 1 << 21
BATCH_ENTRIES = 1 << 26
CHUNKS = 64


def primitive_lists(
    scene: Scene, camera: Camera, length: int, threads: int | None = None
) -> PrimitiveLists:
    """Return for each pixel the `length` primitives that can be nearest anywhere in its square.

    Arguments as `hybrid_rt.Certified` has checked them.
    """
    width, height = camera.width, camera.height
    margin = MARGIN_ULPS * 2.0**-24 * (max(width, height) + 1)
    prim_id = np.empty((height, width, length), np.int32)
    nearest = np.empty((height, width, length), np.float32)
    rest = np.empty((height, width), np.float32)
    vertices, faces = scene.arrays.vertices, scene.arrays.faces
    planes = np.zeros((len(faces), PLANE_ROW), np.float32)
    m, eye, frame, sigma, hand = camera.arrays
    tiles_x = -(-width // TILE)
    tiles = tiles_x * -(-height // TILE)
    boxes = np.empty(len(vertices), np.int64)
    flags = np.empty(len(vertices), np.uint8)
    nearest_of = np.empty(len(vertices), np.float32)
    with _threads.limited(threads):
        bin_kernels.box_vertices(
            vertices.reshape(-1),
            eye,
            m,
            width,
            height,
            margin,
            boxes,
            flags,
            nearest_of,
        )
        corners = boxes.view(np.int16).reshape(-1, 4)
        size = min(len(faces), BATCH_FACES)
        first = 0
        while first < len(faces):
            last = min(first + size, len(faces))
            chunk = -(-(last - first) // CHUNKS)
            chunks = -(-(last - first) // chunk)
            records = np.empty((last - first, 2), np.int64)
            n_survivors = np.empty(chunks, np.int32)
            counts = np.empty((chunks, tiles), np.int32)
            bin_kernels.cull_and_count(
                faces, first, last, corners, flags, nearest_of, width, height, tiles_x,
                chunk, records, n_survivors, counts,
            )  # fmt: skip
            entries = int(counts.sum(dtype=np.int64))
            if entries > BATCH_ENTRIES and size > 1:
                size = -(-size // 2)
                continue
            tile_start = np.empty(tiles + 1, np.int32)
            prefix_sums(n_survivors, counts, np.empty(chunks + 1, np.int32), tile_start)
            bins = np.empty(entries, np.int64)
            bin_kernels.fill_bins(records, n_survivors, tiles_x, chunk, counts, bins)
            kernels.fill_lists(
                scene.corners.reshape(-1), tile_start, bins, records, eye, m, frame, sigma,
                hand, width, height, margin, tiles_x, first == 0, prim_id, nearest, rest,
                planes.reshape(-1),
            )  # fmt: skip
            first = last
    return PrimitiveLists(prim_id, nearest, rest, planes, margin, camera)
