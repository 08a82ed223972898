"""Find which triangle of a scene a depth buffer shows in each pixel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.camera.camera import Camera
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F64, I32, Bool
from hybrid_rt.raster.engine_depth import FLOAT32, ScreenDepth
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.rasterize import rasterize
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene

SUBPIXEL = 2.0**-8
"""To which a GPU rounds vertices on the screen, pixels: 8 bits, as Direct3D and Vulkan ask for."""
LEAST_MATCHED = 0.5
"""Share of the pixels that a buffer must have in common with the mesh to be of it."""
BESIDE = [(dx, dy) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy]


@dataclass(frozen=True, eq=False)
class Matches:
    """Triangles by pixel.

    Attributes
    ----------
    prim_id : (H, W) int32
        -1 where there is nothing. Where no triangle lies at the depth of the buffer: that which
        the mesh shows there or, where it shows none, in the nearest pixel.
    depth, ddx, ddy : (H, W) float64
        Of the triangle's plane; only where a triangle was found.
    found : (H, W) bool
        Where a triangle lies at the depth of the buffer.
    agrees : (H, W) bool
        Where the buffer and the mesh say the same, also that there is nothing.
    """

    prim_id: I32
    depth: F64
    ddx: F64
    ddy: F64
    found: Bool
    agrees: Bool


def match(scene: Scene, camera: Camera, seen: ScreenDepth, tracer: Any = None) -> Matches:
    """Return which triangles a depth buffer shows.

    A pixel shows the triangle that the raster sees there, or else sees in a neighbour, if its plane
    lies at the depth of the buffer: within its uncertainty, the rounding of a GPU's vertices to
    1/256 pixel and of its arithmetic to float32. What is left is sought by rays, if there is a
    tracer: surfaces behind others that the engine does not draw into depth.

    Raises
    ------
    ArgumentError
        The buffer agrees with the mesh in less than half of its pixels.
    """
    ours = rasterize(scene, camera)
    covered = seen.depth > 0.0
    found = _Found(scene, camera, seen, covered)
    found.take(ours.prim_id, ours)
    for dx, dy in BESIDE:
        found.take(_shifted(ours.prim_id, dx, dy))
    if tracer is not None:
        found.trace(tracer)
    share = found.ok.sum() / covered.sum()
    if share < LEAST_MATCHED:
        raise _of_another(seen, ours, share)
    prim_id = np.where(covered, found.prim_id, -1).astype(np.int32)
    left = covered & ~found.ok
    prim_id[left] = _nearest(ours.prim_id)[left]
    agrees = found.ok | (~covered & ~_well_inside(ours.prim_id >= 0))
    return Matches(prim_id, found.depth, found.ddx, found.ddy, found.ok, agrees)


class _Found:
    """What has been found so far."""

    def __init__(self, scene: Scene, camera: Camera, seen: ScreenDepth, covered: Bool) -> None:
        self.scene, self.camera, self.seen = scene, camera, seen
        self.covered = covered
        self.ok = np.zeros(covered.shape, np.bool_)
        self.prim_id = np.full(covered.shape, -1, np.int32)
        self.depth, self.ddx, self.ddy = np.zeros((3, *covered.shape))

    def take(self, candidates: I32, drawn: GBuffer | None = None) -> None:
        """Keep those candidates that lie at the buffer's depth where nothing is found yet.

        `drawn`: a raster's images of them; else their planes are computed.
        """
        y, x = np.nonzero(self.covered & ~self.ok & (candidates >= 0))
        prim = candidates[y, x]
        if drawn is None:
            depth, ddx, ddy = plane_at(self.scene, self.camera, prim, x, y)
        else:
            depth, ddx, ddy = (
                image[y, x].astype(np.float64) for image in (drawn.depth, drawn.ddx, drawn.ddy)
            )
        off = np.abs(depth - self.seen.depth[y, x])
        with np.errstate(invalid="ignore"):
            keep = (depth > 0.0) & (off <= self._tolerance(y, x, depth, ddx, ddy))
        y, x = y[keep], x[keep]
        self.ok[y, x], self.prim_id[y, x] = True, prim[keep]
        for image, values in ((self.depth, depth), (self.ddx, ddx), (self.ddy, ddy)):
            image[y, x] = values[keep]

    def _tolerance(self, y: Any, x: Any, depth: F64, ddx: F64, ddy: F64) -> F64:
        slope_x, slope_y = np.abs(ddx), np.abs(ddy)
        camera, off = self.camera, self.seen.uncertainty[y, x]
        terms = depth + camera.width * slope_x + camera.height * slope_y
        # Twice: engines round to the nearest step or cut off what is below one.
        return np.asarray(
            2.0 * off + SUBPIXEL * (slope_x + slope_y) + FLOAT32 * terms + self.seen.arithmetic
        )

    def trace(self, tracer: Any) -> None:
        """Look with rays that end at the buffer's depth, where nothing is found yet."""
        y, x = np.nonzero(self.covered & ~self.ok)
        if len(x) == 0:
            return
        depth, off = self.seen.depth[y, x], self.seen.uncertainty[y, x]
        around = 2.0 * off + 64.0 * FLOAT32 * depth + self.seen.arithmetic
        camera = self.camera
        origin, direction, nearest, farthest = camera.primary(x + 0.5, y + 0.5)
        start = camera.near if camera.parallel else 0.0  # where t is 0, along the view
        first = camera.z_view(depth + around) - start
        last = camera.z_view(np.maximum(depth - around, 0.0)) - start
        hits = tracer.intersect(
            Rays.from_arrays(
                origin.astype(np.float32), direction.astype(np.float32), None,
                np.maximum(first, nearest), np.minimum(last, farthest),
            )
        )  # fmt: skip
        candidates = np.full(self.covered.shape, -1, np.int32)
        candidates[y, x] = hits.prim_id
        self.take(candidates)


def plane_at(scene: Scene, camera: Camera, prim_id: I32, x: Any, y: Any) -> tuple[F64, F64, F64]:
    """Return depth, ddx and ddy of triangles' planes at pixels' centres; NaN where seen edge-on."""
    a, b, c = scene.vertices[scene.faces[prim_id]].astype(np.float64).swapaxes(0, 1)
    m = camera.arrays.m
    # Of a corner and two edges: x w, y w, w and d, of which d = depth w; x and y from the pixel on.
    rows = np.stack(
        [
            (a - np.array(camera.eye)) @ m[:, :3].T + m[:, 3],
            (b - a) @ m[:, :3].T,
            (c - a) @ m[:, :3].T,
        ]
    )
    w, d = rows[..., 2].T, rows[..., 3].T
    right = rows[..., 0].T - np.asarray(x + 0.5)[:, None] * w
    down = rows[..., 1].T - np.asarray(y + 0.5)[:, None] * w
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = _triple(right, down, w)
        return (
            _triple(right, down, d) / whole,
            _triple(d, down, w) / whole,
            _triple(right, d, w) / whole,
        )


def _triple(a: F64, b: F64, c: F64) -> F64:
    """Return the determinants of rows (N, 3)."""
    return np.asarray(np.einsum("ij,ij->i", a, np.cross(b, c)))


def checked_tracer(tracer: Any, scene: Scene | None) -> Scene | None:
    """Return the scene that a tracer, or else an argument, says; raise where they differ."""
    if tracer is None:
        return scene
    traced = getattr(tracer, "scene", None)
    if not callable(getattr(tracer, "intersect", None)) or not isinstance(traced, Scene):
        raise ArgumentError("tracer", "a tracer of the scene", _check.describe(tracer))
    if scene is not None and not scene.same_as(traced):
        got = f"one of another scene, {traced.name!r}"
        raise ArgumentError("tracer", f"a tracer of scene {scene.name!r}", got)
    return traced


def _of_another(seen: ScreenDepth, ours: GBuffer, share: float) -> ArgumentError:
    """Return the error of a buffer that does not show this mesh from this camera."""

    def agreeing(depth: F64) -> float:
        both = (depth > 0.0) & (ours.depth > 0.0)
        close = np.abs(depth - ours.depth) <= 0.01 * ours.depth
        return float((both & close).sum() / max(1, (depth > 0.0).sum()))

    where = np.argwhere((seen.depth > 0.0) & (np.abs(seen.depth - ours.depth) > 0.01 * ours.depth))
    got = f"one that agrees with it in {100 * share:.1f} % of its covered pixels"
    if len(where):
        y, x = (int(k) for k in where[len(where) // 2])
        there, here = (float(ours.camera.z_view(d[y, x])) for d in (seen.depth, ours.depth))
        mesh = f"{here:.6g}" if ours.depth[y, x] > 0 else "nothing"
        got += f" (at pixel ({x}, {y}): {there:.6g} along the view, mesh {mesh})"
    if agreeing(seen.depth[::-1]) > max(LEAST_MATCHED, agreeing(seen.depth)):
        got += '; upside down it would agree: see origin="bottom"'
    else:
        got += "; kind, near, far and the camera decide"
    return ArgumentError("depth", f"the depth buffer of scene {ours.known_scene.name!r}", got)


def _shifted(image: I32, dx: int, dy: int) -> I32:
    """Return for each pixel the value of its neighbour at (dx, dy), -1 outside."""
    padded = np.pad(image, 1, constant_values=-1)
    height, width = image.shape
    return padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width]


def _well_inside(covered: Bool) -> Bool:
    """Return the covered pixels all of whose neighbours are covered."""
    inside = covered.copy()
    for dx, dy in BESIDE:
        inside &= _shifted(covered.astype(np.int32), dx, dy) == 1
    return inside


def _nearest(prim_id: I32) -> I32:
    """Return each pixel's triangle or, where there is none, that of the nearest pixel with one."""
    from scipy.ndimage import distance_transform_edt

    empty = prim_id < 0
    if not empty.any() or empty.all():
        return np.maximum(prim_id, 0)
    rows, columns = distance_transform_edt(empty, return_distances=False, return_indices=True)
    return np.asarray(prim_id[rows, columns])
