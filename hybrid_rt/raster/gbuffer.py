"""What one view shows, pixel by pixel."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from hybrid_rt import _check
from hybrid_rt._record import Record, read_only
from hybrid_rt.camera.camera import Camera, unproject
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F32, F64, I32, Bool, GBufferArrays
from hybrid_rt.raster import derivatives, engine_depth, tilted
from hybrid_rt.scene.mesh import Scene

SAID = 0.01
"""Share of pixels in which a depth buffer and its mesh may differ before a warning says so."""


@dataclass(frozen=True, eq=False)
class GBuffer(Record):
    """What a view shows: of a scene by `rasterize`, of an engine's depth buffer by `from_arrays`.

    Attributes
    ----------
    depth : (H, W) float32
        At the pixel's centre, 0 where nothing is visible: ``near / z_view`` of a pinhole camera,
        ``(far - z_view) / (far - near)`` of an orthographic one.
    ddx, ddy : (H, W) float32
        Change of `depth` for one pixel to the right and one pixel down.
    prim_id : (H, W) int32
        Index into ``scene.faces``, -1 where nothing is visible, and only there; of a scene that is
        not known 0 where anything is visible.
    scene : Scene or None
        None for a depth buffer alone: what needs triangles refuses it by name then.
    camera : Camera
        Of H by W pixels.
    timings : dict of str to float
        Seconds of the stages of `rasterize`: "vertices" (projecting them), "cull" (which faces may
        cover a pixel), "records" (their planes, and the tiles they are put into), "tiles" (drawing
        these and writing the images); with JIT compilation in a first call.
    uncertainty : (H, W) float32 or None
        By how much `depth` may be off, half of the step between the numbers of a depth buffer. 0
        where nothing is visible and where the plane of a triangle tells depth; None where it tells
        it everywhere.
    matched : (H, W) bool or None
        False where a depth buffer and the scene disagree; None where they cannot. No secondary ray
        starts in such a pixel, and `prim_id` is there what the scene shows, at whatever depth.

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
    scene: Scene | None
    camera: Camera
    timings: dict[str, float] = field(default_factory=dict)
    uncertainty: F32 | None = None
    matched: Bool | None = None

    def __post_init__(self) -> None:
        if self.scene is not None:
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
        faces = 1 if self.scene is None else len(self.scene)
        what = f"the scene has {faces} triangles" if self.scene else "the scene is not known"
        _check.in_range("prim_id", prim_id, -1, faces - 1, what)
        odd = np.argwhere((images["depth"] > 0) != (prim_id >= 0))
        if len(odd):
            y, x = (int(k) for k in odd[0])
            raise ArgumentError(
                "prim_id",
                "-1 where depth is 0, and only there",
                f"{prim_id[y, x]} at pixel ({x}, {y}), where depth is {images['depth'][y, x]:g}",
            )
        self._own(GBufferArrays(images["depth"], images["ddx"], images["ddy"], prim_id))
        self._own_doubts(shape)

    def _own_doubts(self, shape: tuple[int, int]) -> None:
        """Check and take over what is said of how sure the images are."""
        if self.uncertainty is not None:
            off = _check.owned("uncertainty", self.uncertainty, shape, np.float32)
            _check.finite_rows("uncertainty", off.reshape(-1, 1), "values")
            if (off < 0).any():
                raise ArgumentError("uncertainty", "values >= 0", f"{off.min()}")
            object.__setattr__(self, "uncertainty", read_only(off))
        if self.matched is not None:
            if self.scene is None:
                raise ArgumentError("matched", "None for a scene that is not known", "an array")
            matched = _check.owned("matched", self.matched, shape, np.bool_)
            object.__setattr__(self, "matched", read_only(matched))

    @classmethod
    def from_arrays(
        cls,
        camera: Camera,
        depth: Any,
        *,
        kind: Literal["standard", "reversed", "linear", "distance"] = "standard",
        bits: int | None = None,
        far: float | None = None,
        origin: Literal["top", "bottom"] = "top",
        background: Any = None,
        scene: Scene | None = None,
        tracer: Any = None,
    ) -> GBuffer:
        """Return what an engine's depth buffer shows, with its mesh or without.

        Parameters
        ----------
        camera : Camera
            That the buffer was drawn with, its near plane too; H by W pixels.
        depth : (H, W) float16, float32, float64, uint16 or uint32
            Integers are fixed-point numbers from 0 to 1, of `bits` bits.
        kind : {"standard", "reversed", "linear", "distance"}
            What the numbers mean; see the table in the Notes.
        bits : int, optional
            How many bits of an integer hold the depth, in the low end: 24 of uint32 for a D24
            buffer. Default: 16 for uint16; of uint32 it must be said.
        far : float, optional
            Distance of the far plane along the view, world units, > near. Default: that of the
            camera, which is infinite unless it says another.
        origin : {"top", "bottom"}
            Which row of the picture is row 0. ``glReadPixels`` and textures of OpenGL begin at the
            "bottom".
        background : number or (H, W) bool, optional
            What else than the far plane's value stands for nothing: a value (NaN too), or True in
            the pixels that show nothing.
        scene : Scene, optional
            The mesh that the engine drew. Without it the G-buffer knows no triangles.
        tracer : Tracer, optional
            Of the scene, such as an `EmbreeTracer`: it finds surfaces that the buffer shows and
            that the mesh has behind others, as where an engine leaves glass or the holes of leaves
            out of its depth. A scene need not be given beside it.

        Returns
        -------
        GBuffer

        Raises
        ------
        ArgumentError
            An array of another shape or dtype; a value that is NaN, negative or beyond the far
            plane, with the column and row of the first; nothing but background; surfaces that all
            lie at the near plane, as where "standard" and "reversed" are mistaken; a mesh with
            which less than half of the buffer agrees.

        Warns
        -----
        UserWarning
            More than 1 % of the pixels disagree with the mesh.

        Notes
        -----
        With z the distance along the view, n the near plane and f the far one:

        ============  ===============================  =================  ========================
        kind          the buffer holds                 nothing            written by
        ============  ===============================  =================  ========================
        "standard"    f / (f - n) (1 - n / z);         1                  OpenGL's window depth (0
                      1 - n / z where f is infinite                       to 1), Direct3D, Vulkan
        "reversed"    1 less what "standard" holds     0                  engines with reversed Z
        "linear"      z, world units                   f, and infinity    linear depth passes
        "distance"    the distance from the eye        f, and infinity    ray tracers, lidars
                      along the pixel's ray
        ============  ===============================  =================  ========================

        OpenGL's z from -1 to 1 is that of clip space; what it stores is 0 to 1. Of an orthographic
        camera "standard" holds (z - n) / (f - n), and "distance" is refused.

        **Without a mesh** `depth` is that of the buffer, `uncertainty` says how coarse it is, and
        `ddx` and `ddy` come from neighbours (`hybrid_rt.raster.derivatives.differences`).
        Techniques march through it and rays start on it, on tilted pixels in place of triangles.
        What needs triangles, as "certified" and every tracer, refuses it and asks for `scene`.

        **With the mesh** the buffer says which triangle a pixel shows, and the triangle's own
        plane says where it is: `depth`, `ddx` and `ddy` are exact and `uncertainty` 0 where the two
        agree, within what the buffer and a GPU's arithmetic round (`hybrid_rt.raster.matching`).
        Elsewhere `matched` is False, depth is the buffer's, and an answer that falls on the pixel
        names the triangle that the mesh shows there. "certified" proves by the mesh, not by depth,
        so its answers are as certain as those of `rasterize`.
        """
        from hybrid_rt.raster import matching

        _check.instance("camera", camera, Camera)
        if scene is not None:
            _check.instance("scene", scene, Scene)
        scene = matching.checked_tracer(tracer, scene)
        how = engine_depth.form(camera, depth, kind, bits, far, origin)
        seen = engine_depth.read(camera, depth, how, background)
        covered = seen.depth > 0.0
        if scene is None:
            prim_id = np.where(covered, 0, -1).astype(np.int32)
            ddx, ddy = derivatives.differences(seen.depth, seen.uncertainty)
            images = _stored(seen.depth, covered), _float32(ddx), _float32(ddy)
            return cls(*images, prim_id, None, camera, {}, _float32(seen.uncertainty))
        found = matching.match(scene, camera, seen, tracer)
        stored, ddx, ddy, off = found.depth, found.ddx, found.ddy, np.zeros_like(seen.depth)
        if not found.found[covered].all():
            rough = derivatives.differences(seen.depth, seen.uncertainty)
            stored, ddx, ddy, off = (
                np.where(found.found, exact, other)
                for exact, other in zip(
                    (stored, ddx, ddy, off), (seen.depth, *rough, seen.uncertainty), strict=True
                )
            )
        share = 1.0 - found.agrees.mean()
        if share > SAID:
            text = f"the depth buffer and scene {scene.name!r} disagree in {100 * share:.1f} % of"
            warnings.warn(f"{text} all pixels; see GBuffer.matched", UserWarning, stacklevel=2)
        images = _stored(stored, covered), _float32(ddx), _float32(ddy)
        return cls(*images, found.prim_id, scene, camera, {}, _float32(off), found.agrees)

    @property
    def arrays(self) -> GBufferArrays:
        """All images, in the order of the attributes, as kernels take them."""
        arrays: GBufferArrays = self._arrays
        return arrays

    @property
    def known_scene(self) -> Scene:
        """The scene, for what needs its triangles.

        Raises
        ------
        ArgumentError
            It is not known.
        """
        if self.scene is None:
            expected = "one that knows its triangles: GBuffer.from_arrays(..., scene=...)"
            raise ArgumentError("gbuffer", expected, "one of a depth buffer alone")
        return self.scene

    @property
    def bounds(self) -> F64:
        """(2, 3) float64, world: the scene's bounds or, where it is not known, of what is seen."""
        if self.scene is not None:
            return self.scene.bounds
        seen = self.position[self.prim_id >= 0]
        if len(seen) == 0:
            return np.zeros((2, 3))
        return np.stack([seen.min(axis=0), seen.max(axis=0)])

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
        """Normals of what is visible: (H, W, 3) float64, world, NaN where nothing is visible.

        Of unit length, turned to the side that is seen: the geometric normals
        ``cross(b - a, c - a)``, or their opposites where the winding faces away from the eye. A
        triangle seen exactly edge-on keeps the sense of its winding. A triangle of zero area, which
        `rasterize` never shows, has NaN. Where no triangle is known it is the normal of the pixel's
        plane, by `depth`, `ddx` and `ddy`. Made anew at each use.
        """
        covered = self.prim_id >= 0
        y, x = np.nonzero(covered)
        if self.scene is None or self.matched is None:
            known = np.full(len(x), self.scene is not None)
        else:
            known = self.matched[y, x]
        normals = np.empty((len(x), 3))
        if known.any():
            visible, of_pixel = np.unique(self.prim_id[y[known], x[known]], return_inverse=True)
            corners = self.known_scene.vertices[self.known_scene.faces[visible]]
            normals[known] = self._facing(corners.astype(np.float64))[of_pixel]
        if not known.all():
            corners = tilted.triangles(self.camera, self.arrays, y[~known], x[~known])
            normals[~known] = self._facing(corners)
        return self._image_of(covered, normals)

    @property
    def leaving(self) -> tuple[I32, F32, I32]:
        """What rays leave, for kernels: triangles by pixel, their vertices and faces.

        (H, W) int32, -1 where no ray starts; (V, 3) float32, world; (F, 3) int32. The scene's or,
        where that is not known, one in the plane of each pixel.
        """
        if self.scene is None:
            return tilted.soup(self.camera, self.arrays)
        prim_id = self.arrays.prim_id
        if self.matched is not None:
            prim_id = np.where(self.matched, prim_id, np.int32(-1))
        return prim_id, self.scene.arrays.vertices, self.scene.arrays.faces

    def _facing(self, corners: F64) -> F64:
        """Return the unit normals of triangles, (N, 3, 3), on the side of the eye."""
        a, b, c = corners.swapaxes(0, 1)
        normals = np.cross(b - a, c - a)
        with np.errstate(invalid="ignore"):
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        away = np.einsum("ij,ij->i", normals, self.camera.towards(a)) > 0
        normals[away] *= -1.0
        return np.asarray(normals)

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
        of = "a depth buffer alone" if self.scene is None else repr(self.scene.name)
        return f"<GBuffer of {of}: {size}, {100 * covered:.1f} % covered{self._doubts()}>"

    def _doubts(self) -> str:
        """Say in words how sure the images are, where they are not."""
        said = ""
        if self.matched is not None and not self.matched.all():
            apart = np.count_nonzero(~self.matched)
            share = 100.0 * apart / self.matched.size
            said += f", {apart} pixels ({share:.2g} %) not as in the scene"
        if self.uncertainty is not None and self.uncertainty.any():
            doubtful = self.uncertainty > 0
            relative = np.median(self.uncertainty[doubtful] / self.depth[doubtful])
            share = 100.0 * doubtful.sum() / max(1, np.count_nonzero(self.depth > 0))
            said += f", depth of {share:.3g} % of them within {relative:.1g} of itself (median)"
        return said


def _float32(image: F64) -> F32:
    return image.astype(np.float32)


def _stored(depth: F64, covered: Bool) -> F32:
    """Return depth as float32, above 0 wherever a surface is, however far."""
    smallest = float(np.finfo(np.float32).tiny)
    return np.where(covered, np.maximum(depth, smallest), 0.0).astype(np.float32)
