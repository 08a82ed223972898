"""What one view shows, pixel by pixel."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hybrid_rt import _check
from hybrid_rt._record import Record
from hybrid_rt.camera.camera import Camera, unproject
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F32, F64, I32, Bool, GBufferArrays
from hybrid_rt.scene.mesh import Scene


@dataclass(frozen=True, eq=False)
class GBuffer(Record):
    """What a view shows: `rasterize` makes one, and so can anything that has a depth buffer.

    Attributes
    ----------
    depth : (H, W) float32
        At the pixel's centre, 0 where nothing is visible: ``near / z_view`` of a pinhole camera,
        ``(far - z_view) / (far - near)`` of an orthographic one.
    ddx, ddy : (H, W) float32
        Change of `depth` for one pixel to the right and one pixel down.
    prim_id : (H, W) int32
        Index into ``scene.faces``, -1 where nothing is visible, and only there.
    scene : Scene
    camera : Camera
        Of H by W pixels.
    timings : dict of str to float
        Seconds of the stages of `rasterize`: "vertices" (projecting them), "cull" (which faces may
        cover a pixel), "records" (their planes, and the tiles they are put into), "tiles" (drawing
        these and writing the images); with JIT compilation in a first call.

    Raises
    ------
    ArgumentError
        Images of another shape or dtype than said, a depth that is negative or not finite, a
        prim_id that the scene does not have or that says otherwise than the depth whether anything
        is visible.

    Notes
    -----
    The arrays are copied, and read-only from then on.
    """

    depth: F32
    ddx: F32
    ddy: F32
    prim_id: I32
    scene: Scene
    camera: Camera
    timings: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check.instance("scene", self.scene, Scene)
        _check.instance("camera", self.camera, Camera)
        _check.instance("timings", self.timings, dict)
        shape = self.camera.height, self.camera.width
        images = {
            name: _check.owned(name, getattr(self, name), shape, np.float32)
            for name in ("depth", "ddx", "ddy")
        }
        for name, image in images.items():
            _check.finite_rows(name, image.reshape(-1, 1), "values")
        if (images["depth"] < 0).any():
            raise ArgumentError("depth", "values >= 0", f"{images['depth'].min()}")
        prim_id = _check.owned("prim_id", self.prim_id, shape, np.int32)
        faces = len(self.scene)
        _check.in_range("prim_id", prim_id, -1, faces - 1, f"the scene has {faces} triangles")
        odd = np.argwhere((images["depth"] > 0) != (prim_id >= 0))
        if len(odd):
            y, x = (int(k) for k in odd[0])
            raise ArgumentError(
                "prim_id",
                "-1 where depth is 0, and only there",
                f"{prim_id[y, x]} at pixel ({x}, {y}), where depth is {images['depth'][y, x]:g}",
            )
        self._own(GBufferArrays(images["depth"], images["ddx"], images["ddy"], prim_id))

    @property
    def arrays(self) -> GBufferArrays:
        """All images, in the order of the attributes, as kernels take them."""
        arrays: GBufferArrays = self._arrays
        return arrays

    @property
    def position(self) -> F64:
        """Visible points: (H, W, 3) float64, world, NaN where nothing is visible.

        Where the view through the pixel's centre has the stored depth, which is float32: off the
        triangle by its rounding, 6e-8 of the distance along the view. Made anew at each use.
        """
        covered = self.prim_id >= 0
        y, x = np.nonzero(covered)
        points = unproject(self.camera, np.stack([x + 0.5, y + 0.5, self.depth[covered]], axis=1))
        return self._image_of(covered, points)

    @property
    def normal(self) -> F64:
        """Normals of the visible triangles: (H, W, 3) float64, world, NaN where nothing is visible.

        Of unit length, turned to the side that is seen: the geometric normals
        ``cross(b - a, c - a)``, or their opposites where the winding faces away from the eye. A
        triangle seen exactly edge-on keeps the sense of its winding. A triangle of zero area, which
        `rasterize` never shows, has NaN. Made anew at each use.
        """
        covered = self.prim_id >= 0
        visible, of_pixel = np.unique(self.prim_id[covered], return_inverse=True)
        a, b, c = self.scene.vertices[self.scene.faces[visible]].astype(np.float64).swapaxes(0, 1)
        normals = np.cross(b - a, c - a)
        with np.errstate(invalid="ignore"):
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        away = np.einsum("ij,ij->i", normals, self.camera.towards(a)) > 0
        normals[away] *= -1.0
        return self._image_of(covered, normals[of_pixel])

    @staticmethod
    def _image_of(covered: Bool, rows: F64) -> F64:
        """Return the (H, W, 3) image with these rows at the covered pixels and NaN elsewhere."""
        image = np.full((*covered.shape, 3), np.nan)
        image[covered] = rows
        return image

    def __repr__(self) -> str:
        camera = self.camera
        covered = np.count_nonzero(self.prim_id >= 0) / self.prim_id.size
        size = f"{camera.width} x {camera.height} pixels"
        return f"<GBuffer of {self.scene.name!r}: {size}, {100 * covered:.1f} % covered>"
