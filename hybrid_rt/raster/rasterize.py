"""Rasterise a scene: depth, its derivatives and the visible primitive of every pixel."""

from __future__ import annotations

import time
from typing import Literal

import numpy as np

from hybrid_rt import _check, _threads
from hybrid_rt.camera.camera import Camera
from hybrid_rt.kernels.arrays import I32, GBufferArrays
from hybrid_rt.kernels.raster import tiles as kernels
from hybrid_rt.kernels.raster.bins import TILE, prefix_sums
from hybrid_rt.kernels.raster.clip import transform_vertices
from hybrid_rt.kernels.raster.cull import LANES, cull_and_count
from hybrid_rt.kernels.raster.records import ROW, fill_bins
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.scene.mesh import Scene

BATCH_FACES = 1 << 21
"""Faces that go through together; bounds the memory for records."""
BATCH_ENTRIES = 1 << 25
"""Bin entries of one batch; a batch with more is cut in halves."""
CHUNKS = 64
"""Parts of a batch that threads take in turn."""


def rasterize(
    scene: Scene,
    camera: Camera,
    *,
    derivatives: Literal["plane", "quad"] = "plane",
    threads: int | None = None,
) -> GBuffer:
    """Return the visible surface at every pixel's centre.

    Parameters
    ----------
    scene : Scene
        Both windings are visible; triangles of zero area are not.
    camera : Camera
    derivatives : {"plane", "quad"}
        Where ddx and ddy come from. "plane": the visible triangle's own plane, exact. "quad": what
        a pass over the finished depth buffer can know, differences of depth within each aligned
        quad of 2x2 pixels, ddx once for each row and ddy once for each column of the quad. Across
        a silhouette a quad's differences mix two surfaces. The last column or row of an odd size
        takes the neighbour it has; an image one pixel wide has ddx 0, one pixel high ddy 0.
    threads : int, optional
        Default: as many as Numba is set to.

    Returns
    -------
    GBuffer

    Raises
    ------
    ArgumentError
        An argument of the wrong type, an unknown `derivatives`, `threads` out of range.

    Notes
    -----
    Coverage: vertices are projected in float64 and snapped to 1/256 pixel; integer edge functions
    with the top-left rule decide at pixel centres, so meshes are watertight. Triangles are clipped
    at the near plane and, beyond tens of thousands of pixels, at a guard band; an edge is cut at
    the same point for both of its triangles. What lies beyond an orthographic camera's far plane
    has a depth below 0 and loses against nothing; a pinhole camera's `far` cuts nothing off.

    Depth: the plane of the unsnapped vertices in float64, kept within the range of the vertices'
    depths, because the snapped outline may reach past the true one, where a plane seen nearly
    edge-on runs away. It is rounded to float32 and compared as stored: what two surfaces leave
    equal goes to the smallest prim_id. Comparing in float64 would order surfaces less than 6e-8 of
    their distance apart, which Embree, whose own t errs by 3e-7, cannot; and it would let rounding
    noise choose between triangles in one plane.

    The inputs are never written. The result has the same bits for any number of threads.

    On a GPU, ddx and ddy inside a pixel shader extrapolate the shaded triangle to its whole quad;
    depth is linear in screen space, so that is the "plane" derivative. What differs is a deferred
    or compute pass over the depth buffer, which is "quad".

    References
    ----------
    Pineda, "A Parallel Algorithm for Polygon Rasterization" (1988), for the edge functions.
    """
    _check.instance("scene", scene, Scene)
    _check.instance("camera", camera, Camera)
    _check.choice("derivatives", derivatives, ("plane", "quad"))
    images = _images(camera.height, camera.width)
    with _threads.limited(threads):
        timings = _draw(scene, camera, images)
        if derivatives == "quad":
            kernels.quad_differences(images.depth, images.ddx, images.ddy)
    return GBuffer._made(images, scene=scene, camera=camera, timings=timings)


def _images(height: int, width: int) -> GBufferArrays:
    """Return room for depth, ddx, ddy and prim_id: one block, which few pages need be found for."""
    block = _in_lines(4 * height * width).reshape(4, height, width)
    depth, ddx, ddy = block[:3].view(np.float32)
    return GBufferArrays(depth, ddx, ddy, block[3])


def _in_lines(n: int) -> I32:
    """Return room for n int32 that begins with a cache line."""
    raw = np.empty(n + 16, np.int32)
    start = -raw.ctypes.data % 64 // 4
    return raw[start : start + n]


def _draw(scene: Scene, camera: Camera, images: GBufferArrays) -> dict[str, float]:
    """Draw all faces over the images, a batch at a time; return the seconds of every stage."""
    timings = dict.fromkeys(("vertices", "cull", "records", "tiles"), 0.0)
    last_time = time.perf_counter()

    def done(stage: str) -> None:
        nonlocal last_time
        now = time.perf_counter()
        timings[stage] += now - last_time
        last_time = now

    vertices, faces = scene.arrays.vertices, scene.arrays.faces
    width, height = camera.width, camera.height
    m, eye, frame, sigma, _ = camera.arrays
    xy = np.empty(len(vertices), np.int64)
    transform_vertices(vertices, eye, m, width, height, xy)
    done("vertices")

    tiles_x = -(-width // TILE)
    tiles = tiles_x * -(-height // TILE)
    size = min(len(faces), BATCH_FACES)
    first = 0
    while first < len(faces):
        last = min(first + size, len(faces))
        chunk = -(-(last - first) // CHUNKS)
        chunks = -(-(last - first) // chunk)
        survivors = np.empty((chunks, chunk + LANES), np.int32)
        n_survivors = np.empty(chunks, np.int32)
        n_records = np.empty(chunks, np.int32)
        counts = np.empty((chunks, tiles), np.int32)
        cull_and_count(
            vertices, faces, first, last, eye, m, width, height, xy, tiles_x,
            chunk, survivors, n_survivors, n_records, counts,
        )  # fmt: skip
        entries = int(counts.sum(dtype=np.int64))
        done("cull")
        if entries > BATCH_ENTRIES and size > 1:
            size = -(-size // 2)
            continue
        record_start = np.empty(chunks + 1, np.int32)
        tile_start = np.empty(tiles + 1, np.int32)
        prefix_sums(n_records, counts, record_start, tile_start)
        records = _in_lines(2 * ROW * int(record_start[-1])).view(np.int64)
        bins = np.empty(entries, np.int64)
        fill_bins(
            vertices, faces, eye, m, frame, sigma, width, height, xy, tiles_x,
            survivors, n_survivors, record_start, counts, records, bins,
        )  # fmt: skip
        done("records")
        kernels.draw_tiles(
            tile_start, bins, records, tiles_x, 0.5 * width, 0.5 * height,
            first == 0, *images,
        )  # fmt: skip
        done("tiles")
        first = last
    return timings
