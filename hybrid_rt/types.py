"""Frozen dataclasses that the modules hand to each other.

Spaces are suffixes: ``_w`` world, ``_v`` view, ``_px`` screen. Screen space is x right, y down, and
pixel (i, j) covers [i, i + 1) x [j, j + 1). ``depth = near / z_view`` with ``z_view`` positive
forward: reversed-Z with an infinite far plane, in (0, 1] on a surface and 0 where there is none,
linear in screen space. Nearest is the largest.

No array in here is written after it is made; every function of the library leaves its inputs alone.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]
Bool = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles as a file or a generator gives them.

    Attributes
    ----------
    vertices : (V, 3) float32, world
    faces : (F, 3) int32
        Indices into `vertices`; both windings are visible.
    object_id : (F,) int32
        Which object of the source a triangle belongs to; 0 where the source names none.
    instances : int
        How many instances of a scene graph were flattened into it (1 for a plain mesh).
    """

    vertices: F32
    faces: I32
    object_id: I32
    instances: int = 1

    @classmethod
    def from_arrays(
        cls, vertices: Any, faces: Any, object_id: Any = None, *, instances: int = 1
    ) -> Mesh:
        """Return a mesh from arrays, after checking every index and coordinate.

        Parameters
        ----------
        vertices : (V, 3) array_like of float
            World positions. float64 is rounded to float32.
        faces : (F, 3) array_like of int
            F >= 1.
        object_id : (F,) array_like of int, optional
        instances : int, optional

        Raises
        ------
        ArgumentError
            Wrong shape or dtype, no faces, an index out of range, a vertex that is NaN or infinite
            (also one that overflows float32).
        """
        v = _check.array("vertices", vertices, ("V", 3), np.float32)
        f = _check.array("faces", faces, ("F", 3), np.int32)
        if len(f) == 0:
            raise ArgumentError("faces", "at least one triangle", "none")
        low, high = int(f.min()), int(f.max())
        if low < 0 or high >= len(v):
            bad = (f < 0) | (f >= len(v))
            first = int(np.argmax(bad.any(axis=1)))
            raise ArgumentError(
                "faces",
                f"indices from 0 to {len(v) - 1} (there are {len(v)} vertices)",
                f"{int(bad.sum())} out of range, the first in face {first}: {f[first].tolist()}",
            )
        _check.finite_rows("vertices", v, "float32 coordinates")
        if object_id is None:
            ids = np.zeros(len(f), np.int32)
        else:
            ids = _check.array("object_id", object_id, ("F",), np.int32)
            _check.same_length("object_id", ids, "faces", len(f))
        return cls(v, f, ids, instances)


@dataclass(frozen=True, eq=False)
class Scene:
    """All triangles of a scene in one world, in the order that gives `prim_id` its meaning.

    Attributes
    ----------
    vertices : (V, 3) float32, world
    faces : (F, 3) int32
    object_id : (F,) int32
    name : str
    zero_area : int
        Triangles of exactly zero area. They are kept, so that `prim_id` stays the index into
        `faces`, and no ray ever hits them.
    """

    vertices: F32
    faces: I32
    object_id: I32
    name: str = "scene"
    zero_area: int = 0

    @classmethod
    def from_arrays(
        cls, vertices: Any, faces: Any, object_id: Any = None, *, name: str = "scene"
    ) -> Scene:
        """Return a scene of one mesh; the arguments are those of `Mesh.from_arrays`."""
        return cls.from_meshes([Mesh.from_arrays(vertices, faces, object_id)], name=name)

    @classmethod
    def from_meshes(cls, meshes: Sequence[Mesh], *, name: str = "scene") -> Scene:
        """Return a scene that holds `meshes` one after the other.

        Object ids are shifted so that those of different meshes stay apart.
        """
        if len(meshes) == 0:
            raise ArgumentError("meshes", "at least one Mesh", "none")
        vertices, faces, ids = [], [], []
        n_vertices, n_objects = 0, 0
        for mesh in meshes:
            _check.instance("meshes", mesh, Mesh)
            vertices.append(mesh.vertices)
            faces.append(mesh.faces + np.int32(n_vertices) if n_vertices else mesh.faces)
            ids.append(mesh.object_id + np.int32(n_objects) if n_objects else mesh.object_id)
            n_vertices += len(mesh.vertices)
            n_objects += int(mesh.object_id.max()) + 1
        v, f = np.concatenate(vertices), np.concatenate(faces)
        a, b, c = (v[f[:, k]].astype(np.float64) for k in range(3))
        zero_area = int((np.cross(b - a, c - a) == 0).all(axis=1).sum())
        return cls(v, f, np.concatenate(ids), name, zero_area)

    @cached_property
    def bounds(self) -> F64:
        """(2, 3) float64, world: the smallest and the largest corner of the used vertices."""
        used = self.vertices[self.faces.ravel()].astype(np.float64)
        return np.stack([used.min(axis=0), used.max(axis=0)])

    @cached_property
    def corners(self) -> F32:
        """(F, 9) float32, world: the three vertices of each triangle, side by side, 36 bytes."""
        return self.vertices[self.faces].reshape(-1, 9)

    @cached_property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal, world units: what a scene's lengths relate to."""
        low, high = self.bounds
        return float(np.linalg.norm(high - low))

    def __len__(self) -> int:
        return len(self.faces)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with square pixels. Make one with `Camera.look_at`.

    Attributes
    ----------
    eye : three float, world
    right, up, forward : three float, world
        Orthonormal; the camera looks along `forward`, which is -Z of its own right-handed frame.
    vfov_deg : float
        Vertical field of view in degrees.
    width, height : int
        Pixels.
    near : float
        Distance of the near plane along `forward`, world units.
    """

    eye: tuple[float, float, float]
    right: tuple[float, float, float]
    up: tuple[float, float, float]
    forward: tuple[float, float, float]
    vfov_deg: float
    width: int
    height: int
    near: float

    @classmethod
    def look_at(
        cls,
        eye: Any,
        target: Any,
        up: Any = (0.0, 1.0, 0.0),
        *,
        vfov_deg: float = 60.0,
        width: int = 1920,
        height: int = 1080,
        near: float = 0.05,
    ) -> Camera:
        """Return a camera at `eye` that looks at `target`.

        Parameters
        ----------
        eye, target, up : three float, world
            `up` need not be orthogonal to the view, only not parallel to it.
        vfov_deg : float
            Vertical field of view, 0 < vfov_deg < 180.
        width, height : int
            Pixels, 1 to 32768 each.
        near : float
            Distance of the near plane, > 0, world units.

        Raises
        ------
        ArgumentError
            Anything out of range, `eye` equal to `target`, `up` zero or parallel to the view.
        """
        eye3 = np.array(_check.vector3("eye", eye))
        target3 = np.array(_check.vector3("target", target))
        up3 = np.array(_check.vector3("up", up))
        forward = target3 - eye3
        distance = float(np.linalg.norm(forward))
        if distance == 0.0 or not math.isfinite(distance):
            raise ArgumentError("target", "a point other than eye", _check.describe(target))
        forward = forward / distance
        length = float(np.linalg.norm(up3))
        if length == 0.0 or not math.isfinite(length):
            raise ArgumentError("up", "a direction of finite length > 0", _check.describe(up))
        right = np.cross(forward, up3 / length)
        sine = float(np.linalg.norm(right))
        if sine < 1e-9:  # relative: both vectors have unit length here
            raise ArgumentError("up", "a direction not parallel to the view", _check.describe(up))
        right = right / sine
        return cls(
            eye=_vec(eye3),
            right=_vec(right),
            up=_vec(np.cross(right, forward)),
            forward=_vec(forward),
            vfov_deg=_check.real("vfov_deg", vfov_deg, above=0.0, below=180.0),
            width=_check.integer("width", width, least=1, most=32768),
            height=_check.integer("height", height, least=1, most=32768),
            near=_check.real("near", near, above=0.0),
        )

    def resized(self, width: int, height: int) -> Camera:
        """Return the same view with another number of pixels; the vertical field of view stays."""
        return replace(
            self,
            width=_check.integer("width", width, least=1, most=32768),
            height=_check.integer("height", height, least=1, most=32768),
        )

    def widened(self, factor: float) -> Camera:
        """Return a view `factor` times as wide and as high around the same axis.

        Pixels stay as they are, so their number grows with the square of `factor`: with a factor
        above 1 the view gets a border, a *guard band*.

        Parameters
        ----------
        factor : float
            > 0; the numbers of pixels are rounded.

        Raises
        ------
        ArgumentError
            `factor` out of range, or more pixels than a camera may have.
        """
        factor = _check.real("factor", factor, above=0.0)
        height = max(1, round(self.height * factor))
        wider = self.resized(max(1, round(self.width * factor)), height)
        return replace(wider, vfov_deg=math.degrees(2.0 * math.atan(0.5 * height / self.focal_px)))

    @property
    def focal_px(self) -> float:
        """Distance of the image plane in pixels."""
        return 0.5 * self.height / math.tan(math.radians(self.vfov_deg) / 2)

    @property
    def pixel_from_world(self) -> F64:
        """(3, 3) float64 matrix M of the projection.

        ``q = M @ (p_w - eye)`` gives ``x_px = q0 / q2``, ``y_px = q1 / q2`` and ``z_view = q2``.
        The eye is subtracted first, in float64, so that a scene far from the origin loses nothing.
        """
        f = self.focal_px
        forward = np.array(self.forward)
        return np.stack(
            [
                f * np.array(self.right) + 0.5 * self.width * forward,
                -f * np.array(self.up) + 0.5 * self.height * forward,
                forward,
            ]
        )

    @property
    def world_from_pixel(self) -> F64:
        """(3, 3) float64; rows right / f, -up / f and forward, with f = `focal_px`.

        The ray ``forward + (x - W / 2) row0 + (y - H / 2) row1`` runs from the eye through the
        place (x, y) of the screen and has z_view = 1 at its end.
        """
        f = self.focal_px
        return np.stack([np.array(self.right) / f, -np.array(self.up) / f, np.array(self.forward)])


def _vec(v: F64) -> tuple[float, float, float]:
    return float(v[0]), float(v[1]), float(v[2])


@dataclass(frozen=True, eq=False)
class PrimitiveLists:
    """For each pixel, the primitives that touch its square, as far as the list goes.

    A pixel's square is grown by `margin_px` to each side. Every triangle with a point in front of
    the near plane that projects into the grown square is in the pixel's list, with a bound that
    none of these points is nearer than, or `rest` is such a bound.

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
        `hybrid_rt.kernels.lists`. NaN where there is none to be trusted. Rows of faces that are in
        no list mean nothing.
    margin_px : float
    camera : Camera
        Whose pixels these are; not always that of the G-buffer, see `rasterize`.
    """

    prim_id: I32
    nearest: F32
    rest: F32
    planes: F32
    margin_px: float
    camera: Camera

    @property
    def length(self) -> int:
        """K, the largest number of primitives in a list."""
        return int(self.prim_id.shape[2])

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays: 8 K + 4 a pixel, 32 a face."""
        return sum(a.nbytes for a in (self.prim_id, self.nearest, self.rest, self.planes))


@dataclass(frozen=True, eq=False)
class GBuffer:
    """What the rasteriser writes for one view.

    Attributes
    ----------
    depth : (H, W) float32
        ``near / z_view`` at the pixel's centre, 0 where nothing is visible.
    ddx, ddy : (H, W) float32
        Change of `depth` for one pixel to the right and one pixel down.
    prim_id : (H, W) int32
        Index into ``scene.faces``, -1 where nothing is visible.
    scene : Scene
    camera : Camera
    lists : PrimitiveLists, optional
        What mode "certified" reads, if the rasteriser was asked for it.
    timings : dict of str to float
        Seconds of the stages of `rasterize`: "vertices" (projecting them), "cull" (which faces may
        cover a pixel), "records" (their planes, and the tiles they are put into), "tiles" (drawing
        these and writing the images); with JIT compilation in a first call.
    """

    depth: F32
    ddx: F32
    ddy: F32
    prim_id: I32
    scene: Scene
    camera: Camera
    lists: PrimitiveLists | None = None
    timings: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class DepthPyramid:
    """Nearest depth of 1, 4, 16 ... pixels; level 0 is the depth buffer itself.

    Level l has ``ceil(W / 2**l)`` by ``ceil(H / 2**l)`` cells and ends at 1 by 1, so the cell of a
    pixel is always ``(x >> l, y >> l)``.

    Attributes
    ----------
    data : (cells,) float32
        All levels, row by row, each padded to powers of two; see `hybrid_rt.pyramid.layout`.
    offsets : (L,) int64
        Index of the first cell of each level in `data`.
    pitches : (L,) int64
        Cells from the start of a row of a level to the start of the next.
    widths, heights : (L,) int64
        Cells of a level without its padding.
    conservative : bool
        Whether the depths are those of pixel squares (the first bounds of `PrimitiveLists`) and
        not those of pixel centres.
    """

    data: F32
    offsets: I64
    pitches: I64
    widths: I64
    heights: I64
    conservative: bool = False

    def __len__(self) -> int:
        return len(self.offsets)

    def level(self, index: int) -> F32:
        """Return level `index` as a (height, width) view of `data`."""
        n = _check.integer("index", index, least=0, most=len(self) - 1)
        return _level(self, n)


@dataclass(frozen=True, eq=False)
class SlopePyramid:
    """For 1, 4, 16 ... pixels, a plane in front of all their tilted planes; as a DepthPyramid lies.

    The plane of cell (i, j) of level l is ``a + b_x (x - x_c) + b_y (y - y_c)`` with the cell's
    centre ``x_c = (i + 1/2) 2**l``, ``y_c = (j + 1/2) 2**l``. Over the square of each pixel in the
    cell it is nowhere farther than that pixel's own plane; level 0 is those planes. Where nothing
    is visible in the whole cell, a is minus infinity and the slopes are 0.

    Attributes
    ----------
    data : (cells, 3) float32
        a, b_x, b_y, in depth and depth a pixel; the levels lie as in a DepthPyramid.
    offsets, pitches, widths, heights : (L,) int64
        As in a DepthPyramid.
    """

    data: F32
    offsets: I64
    pitches: I64
    widths: I64
    heights: I64

    def __len__(self) -> int:
        return len(self.offsets)

    def level(self, index: int) -> F32:
        """Return level `index` as a (height, width, 3) view of `data`."""
        n = _check.integer("index", index, least=0, most=len(self) - 1)
        return _level(self, n)


Pyramid = DepthPyramid | SlopePyramid
"""What a march goes through."""


def _level(pyramid: Pyramid, n: int) -> F32:
    """Return level n, (height, width, ...), as a view without its padding."""
    start, pitch = int(pyramid.offsets[n]), int(pyramid.pitches[n])
    height, width = int(pyramid.heights[n]), int(pyramid.widths[n])
    rows = pyramid.data[start : start + height * pitch]
    return rows.reshape(height, pitch, *pyramid.data.shape[1:])[:, :width]


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays in linear arrays.

    Attributes
    ----------
    origin, direction : (N, 3) float32, world
        `direction` need not have unit length; every t is in units of its length.
    pixel : (N, 2) int32
        The pixel (x, y) on whose visible surface the ray starts; (-1, -1) for a ray that starts
        anywhere else.
    t_near, t_far : (N,) float32
        Only hits with ``t_near <= t <= t_far`` count.
    """

    origin: F32
    direction: F32
    pixel: I32
    t_near: F32
    t_far: F32

    @classmethod
    def from_arrays(
        cls,
        origin: Any,
        direction: Any,
        pixel: Any = None,
        t_near: Any = None,
        t_far: Any = None,
    ) -> Rays:
        """Return rays from arrays.

        Parameters
        ----------
        origin, direction : (N, 3) array_like of float, world
            A ray with a NaN, an infinity or a zero direction is kept: it is `MarchStatus.INVALID`
            in a march and hits nothing.
        pixel : (N, 2) array_like of int, optional
            Default (-1, -1).
        t_near, t_far : (N,) array_like of float, optional
            Default 0 and infinity. NaN or a negative `t_near` is refused.

        Raises
        ------
        ArgumentError
            Wrong shape, dtype or length; a NaN or negative `t_near`, a NaN `t_far`.
        """
        o = _check.array("origin", origin, ("N", 3), np.float32)
        d = _check.array("direction", direction, ("N", 3), np.float32)
        n = len(o)
        _check.same_length("direction", d, "origin", n)
        if pixel is None:
            px = np.full((n, 2), -1, np.int32)
        else:
            px = _check.array("pixel", pixel, ("N", 2), np.int32)
            _check.same_length("pixel", px, "origin", n)
        limits = []
        for argument, value, default in (("t_near", t_near, 0.0), ("t_far", t_far, np.inf)):
            if value is None:
                t = np.full(n, default, np.float32)
            else:
                t = _check.array(argument, value, ("N",), np.float32)
                _check.same_length(argument, t, "origin", n)
            limits.append(t)
        if not (limits[0] >= 0).all():
            raise ArgumentError("t_near", "values >= 0", "negative values or NaN")
        if np.isnan(limits[1]).any():
            raise ArgumentError("t_far", "values that are not NaN", "NaN")
        return cls(o, d, px, limits[0], limits[1])

    def __len__(self) -> int:
        return len(self.origin)

    @property
    def arrays(self) -> tuple[F32, F32, I32, F32, F32]:
        """All arrays, in the order of the attributes, as kernels take them."""
        return self.origin, self.direction, self.pixel, self.t_near, self.t_far

    def take(self, index: Any) -> Rays:
        """Return the rays selected by an index or boolean array."""
        return Rays(
            self.origin[index],
            self.direction[index],
            self.pixel[index],
            self.t_near[index],
            self.t_far[index],
        )


@dataclass(frozen=True, eq=False)
class Hits:
    """Nearest intersections, one for each ray.

    Attributes
    ----------
    t : (N,) float32
        Distance in units of the length of the ray's direction; infinity for a miss.
    prim_id : (N,) int32
        Index into ``scene.faces``; -1 for a miss.
    u, v : (N,) float32
        Barycentrics: the hit is at (1 - u - v) a + u b + v c; 0 for a miss.
    n_g : (N, 3) float32, world
        ``cross(b - a, c - a)`` of the triangle, not of unit length; 0 for a miss.
    """

    t: F32
    prim_id: I32
    u: F32
    v: F32
    n_g: F32

    @classmethod
    def empty(cls, n: int) -> Hits:
        """Return `n` misses, to be filled by a tracer."""
        return cls(
            np.full(n, np.inf, np.float32),
            np.full(n, -1, np.int32),
            np.zeros(n, np.float32),
            np.zeros(n, np.float32),
            np.zeros((n, 3), np.float32),
        )

    @classmethod
    def unfilled(cls, n: int) -> Hits:
        """Return room for `n` hits, with nothing in it yet, for code that writes every row."""
        return cls(
            np.empty(n, np.float32),
            np.empty(n, np.int32),
            np.empty(n, np.float32),
            np.empty(n, np.float32),
            np.empty((n, 3), np.float32),
        )

    @property
    def arrays(self) -> tuple[F32, I32, F32, F32, F32]:
        """All arrays, in the order of the attributes, as kernels take them."""
        return self.t, self.prim_id, self.u, self.v, self.n_g

    def put(self, index: Any, values: Hits) -> None:
        """Write `values` into the rows selected by an index or boolean array."""
        for mine, theirs in zip(self.arrays, values.arrays, strict=True):
            mine[index] = theirs

    def __len__(self) -> int:
        return len(self.t)


class MarchStatus(enum.IntEnum):
    """How the march of one ray ended."""

    HIT = 0
    """A pixel answers the ray."""
    MISS = 1
    """The ray stays in front of everything, for ever (or up to its t_far)."""
    OFFSCREEN = 2
    """It leaves the image sideways."""
    HIDDEN = 3
    """It meets or goes behind a visible surface, and what the screen holds does not answer it."""
    NEAR = 4
    """It leaves through the near plane, towards the observer."""
    EXHAUSTED = 5
    """The step budget ran out."""
    INVALID = 6
    """NaN, an infinity or a zero direction."""
    UNDECIDED = 7
    """Certified only: two hits, or a hit and a miss, are closer than float64 can tell apart."""
    SKIPPED = 8
    """Certified only: not marched, since no probe near it in the order of the rays was resolved."""


@dataclass(frozen=True)
class MarchWork:
    """What the lanes of a march went through, over all rays and workers.

    A stage goes through vectors of `lanes` lanes, of which some are at work. All but the numbers of
    vectors are the same however rays are put into lanes.

    Attributes
    ----------
    lanes : int
        Of a vector.
    step_vectors, steps, passes : int
        Steps read the pyramid, passes leave a pixel that has been looked at.
    refills : int
        Lanes that were given a ray to walk.
    look_vectors, looks : int
        Pixels whose lists were looked at, once for each time that a ray was sent there.
    entry_vectors, entries : int
        Entries of lists that were read.
    rests : int
        Lists that were gone through to their end.
    plane_vectors, planes : int
        Planes of triangles that were read.
    test_vectors, tests : int
        Exact tests.
    """

    lanes: int
    step_vectors: int
    steps: int
    passes: int
    refills: int
    look_vectors: int
    looks: int
    entry_vectors: int
    entries: int
    rests: int
    plane_vectors: int
    planes: int
    test_vectors: int
    tests: int

    @property
    def busy(self) -> dict[str, float]:
        """Share of the lanes at work, for each stage; NaN for one that nothing came to."""
        stages = {
            "step": (self.steps + self.passes, self.step_vectors),
            "look": (self.looks, self.look_vectors),
            "entry": (self.entries, self.entry_vectors),
            "plane": (self.planes, self.plane_vectors),
            "test": (self.tests, self.test_vectors),
        }
        return {
            stage: at_work / (vectors * self.lanes) if vectors else math.nan
            for stage, (at_work, vectors) in stages.items()
        }


@dataclass(frozen=True, eq=False)
class Marched:
    """What the screen says about each ray.

    Attributes
    ----------
    status : (N,) uint8
        A `MarchStatus` for each ray.
    resolved : (N,) bool
        Whether the march answers the ray, with a hit or, where `prim_id` is -1, with a miss. What
        resolves a ray is up to the mode.
    pixel : (N, 2) int32
        The pixel (x, y) that answers the ray with a hit, else (-1, -1). An answer from lists of
        another view than the G-buffer's has none.
    prim_id : (N,) int32
        The primitive that is hit, -1 for a miss and for unresolved.
    t : (N,) float32
        Where it is hit, infinity for a miss and for unresolved.
    t_free : (N,) float32
        Up to here the march found the ray in front of everything that it read.
    steps : (N,) int32
        Samples of the pyramid that the ray took.
    steps_by_level : (L,) int64, optional
        The same, summed over the rays, for each level; None where it was not counted.
    tests : int
        Exact tests of a ray against a primitive, over all rays; only mode "certified" makes any.
    work : MarchWork, optional
        What the lanes went through; None where the march has none.
    """

    status: U8
    resolved: Bool
    pixel: I32
    prim_id: I32
    t: F32
    t_free: F32
    steps: I32
    steps_by_level: I64 | None = None
    tests: int = 0
    work: MarchWork | None = None

    @classmethod
    def unfilled(cls, n: int) -> Marched:
        """Return room for `n` rays, with nothing in it yet, for code that writes every row."""
        return cls(
            np.empty(n, np.uint8),
            np.empty(n, np.bool_),
            np.empty((n, 2), np.int32),
            np.empty(n, np.int32),
            np.empty(n, np.float32),
            np.empty(n, np.float32),
            np.empty(n, np.int32),
        )

    @property
    def rows(self) -> tuple[U8, Bool, I32, I32, F32, F32, I32]:
        """The arrays with a row for each ray, in the order of the attributes, for kernels."""
        return (
            self.status,
            self.resolved,
            self.pixel,
            self.prim_id,
            self.t,
            self.t_free,
            self.steps,
        )

    def __len__(self) -> int:
        return len(self.status)


class _OfMarch:
    """What the results of a hybrid say of its march."""

    marched: Marched

    @property
    def resolved(self) -> Bool:
        """(N,) bool: whether the march answered the ray."""
        return self.marched.resolved

    @property
    def status(self) -> U8:
        """(N,) uint8: `MarchStatus` of every ray."""
        return self.marched.status

    @property
    def pixel(self) -> I32:
        """(N, 2) int32: the pixel that answered the ray, (-1, -1) where none did."""
        return self.marched.pixel


@dataclass(frozen=True, eq=False)
class HybridResult(_OfMarch):
    """What `trace_hybrid` returns.

    Attributes
    ----------
    hits : Hits
        For every ray, from the march or from the tracer.
    marched : Marched
        What the march said of every ray.
    timings : dict of str to float
        Seconds of the stages "march", "compaction", "fallback", "merge".
    """

    hits: Hits
    marched: Marched
    timings: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class OcclusionResult(_OfMarch):
    """What `occluded_hybrid` returns.

    Attributes
    ----------
    occluded : (N,) bool
        For every ray, from the march or from the tracer.
    marched : Marched
        What the march said of every ray.
    timings : dict of str to float
        Seconds of the stages "march", "compaction", "fallback", "merge".
    """

    occluded: Bool
    marched: Marched
    timings: dict[str, float] = field(default_factory=dict)
