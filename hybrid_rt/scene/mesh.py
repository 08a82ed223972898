"""Triangles: meshes as files give them, and scenes that are traced."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt import _check
from hybrid_rt._record import Record, read_only
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F32, F64, I32, SceneArrays


class _Triangles(Record):
    """What meshes and scenes are alike in."""

    vertices: F32
    faces: I32
    object_id: I32
    polygon_id: I32

    def __post_init__(self) -> None:
        v = _check.owned("vertices", self.vertices, ("V", 3), np.float32)
        f = _check.owned("faces", self.faces, ("F", 3), np.int32)
        if len(f) == 0:
            raise ArgumentError("faces", "at least one triangle", "none")
        _check.in_range("faces", f, 0, len(v) - 1, f"there are {len(v)} vertices")
        _check.finite_rows("vertices", v, "float32 coordinates")
        if self.object_id is None:
            ids = np.zeros(len(f), np.int32)
        else:
            ids = _check.owned("object_id", self.object_id, ("F",), np.int32)
            _check.same_length("object_id", ids, "faces", len(f))
        if self.polygon_id is None:
            polygons = np.arange(len(f), dtype=np.int32)
        else:
            polygons = _check.owned("polygon_id", self.polygon_id, ("F",), np.int32)
            _check.same_length("polygon_id", polygons, "faces", len(f))
        self._own(SceneArrays(v, f, ids))
        object.__setattr__(self, "polygon_id", read_only(polygons))

    @property
    def arrays(self) -> SceneArrays:
        """Vertices, faces and object ids, as kernels take them."""
        arrays: SceneArrays = self._arrays
        return arrays

    def __len__(self) -> int:
        return len(self.faces)


def _apart(ids: Sequence[I32]) -> tuple[NDArray[np.integer[Any]], int]:
    """Return ids of several meshes, shifted so that none occurs in two, and how many there are."""
    shifted, n = [], 0
    for some in ids:
        least, most = int(some.min()), int(some.max())
        shifted.append(some + np.int64(n) if n else some)
        n += most + 1 if least >= 0 else most - least + 1
    return np.concatenate(shifted), n


@dataclass(frozen=True, eq=False)
class Mesh(_Triangles):
    """Triangles as a file or a generator gives them.

    Attributes
    ----------
    vertices : (V, 3) float32, world
        float64 is rounded to float32.
    faces : (F, 3) int32
        Indices into `vertices`, F >= 1; both windings are visible.
    object_id : (F,) int32
        Which object of the source a triangle belongs to; default 0.
    polygon_id : (F,) int32
        Which polygon of the source a triangle is part of, so that the halves of a quad stay one;
        default: each is a polygon of its own.

    Raises
    ------
    ArgumentError
        Wrong shape or dtype, no faces, an index out of range, a vertex that is NaN or infinite
        (also one that overflows float32).

    Notes
    -----
    The arrays are copied, and read-only from then on.
    """

    vertices: F32
    faces: I32
    object_id: I32 = None  # type: ignore[assignment]
    polygon_id: I32 = None  # type: ignore[assignment]

    @classmethod
    def from_arrays(
        cls, vertices: Any, faces: Any, object_id: Any = None, polygon_id: Any = None
    ) -> Mesh:
        """Return a mesh from arrays; arguments and errors are those of the class."""
        return cls(vertices, faces, object_id, polygon_id)


@dataclass(frozen=True, eq=False)
class Scene(_Triangles):
    """All triangles of a scene in one world, in the order that gives `prim_id` its meaning.

    Attributes
    ----------
    vertices, faces, object_id, polygon_id
        As in `Mesh`, with the same errors.
    name : str

    Notes
    -----
    Triangles of exactly zero area are kept, so that `prim_id` stays the index into `faces`, and no
    ray ever hits them.
    """

    vertices: F32
    faces: I32
    object_id: I32 = None  # type: ignore[assignment]
    name: str = "scene"
    polygon_id: I32 = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        _check.text("name", self.name)
        super().__post_init__()

    @classmethod
    def from_arrays(
        cls,
        vertices: Any,
        faces: Any,
        object_id: Any = None,
        *,
        name: str = "scene",
        polygon_id: Any = None,
    ) -> Scene:
        """Return a scene of one mesh; the arguments are those of the class."""
        return cls(vertices, faces, object_id, name, polygon_id)

    @classmethod
    def from_meshes(cls, meshes: Sequence[Mesh], *, name: str = "scene") -> Scene:
        """Return a scene that holds `meshes` one after the other.

        Object and polygon ids are shifted so that those of different meshes stay apart.

        Raises
        ------
        ArgumentError
            No mesh, or something else among them; more vertices, triangles, object or polygon ids
            together than int32 can number.
        """
        _check.text("name", name)
        if not isinstance(meshes, Sequence) or isinstance(meshes, str | bytes) or not meshes:
            raise ArgumentError(
                "meshes", "a sequence of at least one Mesh", _check.describe(meshes)
            )
        for mesh in meshes:
            _check.instance("meshes", mesh, Mesh)
        vertices, faces = [], []
        n_vertices = 0
        for mesh in meshes:
            vertices.append(mesh.vertices)
            faces.append(mesh.faces + np.int64(n_vertices) if n_vertices else mesh.faces)
            n_vertices += len(mesh.vertices)
        objects, n_objects = _apart([mesh.object_id for mesh in meshes])
        polygons, n_polygons = _apart([mesh.polygon_id for mesh in meshes])
        if max(n_vertices, n_objects, n_polygons) > np.iinfo(np.int32).max:
            raise ArgumentError(
                "meshes", "vertices, objects and polygons that int32 can number",
                f"{n_vertices} vertices, {n_objects} objects, {n_polygons} polygons",
            )  # fmt: skip
        arrays = SceneArrays(
            np.concatenate(vertices),
            np.concatenate(faces).astype(np.int32, copy=False),
            objects.astype(np.int32, copy=False),
        )
        polygon_id = read_only(polygons.astype(np.int32, copy=False))
        return cls._made(arrays, name=name, polygon_id=polygon_id)

    @classmethod
    def from_trimesh(cls, mesh_or_scene: Any, *, name: str = "scene") -> Scene:
        """Return a scene of what trimesh holds in memory.

        Parameters
        ----------
        mesh_or_scene : trimesh.Trimesh or trimesh.Scene
            Anything with `vertices` and `faces`, or with `dump()` that returns such meshes where
            its graph puts them, each of which becomes an object. What has no faces, such as points
            and paths, is left out.
        name : str

        Raises
        ------
        ArgumentError
            Something else, no faces at all, or what `Mesh` does not take.
        """
        argument = "mesh_or_scene"
        expected = "a trimesh.Trimesh or a trimesh.Scene"
        parts = [mesh_or_scene]
        try:
            if not hasattr(mesh_or_scene, "faces"):
                parts = [part for part in mesh_or_scene.dump() if hasattr(part, "faces")]
            pairs = [(np.asarray(part.vertices), np.asarray(part.faces)) for part in parts]
        except Exception as error:  # whatever somebody's own class does
            raise ArgumentError(argument, expected, _check.describe(mesh_or_scene)) from error
        meshes = [Mesh(vertices, faces) for vertices, faces in pairs if len(faces)]
        if not meshes:
            raise ArgumentError(argument, "at least one triangle", "none")
        return cls.from_meshes(meshes, name=name)

    def __repr__(self) -> str:
        return f"<Scene {self.name!r}: {len(self)} triangles, {len(self.vertices)} vertices>"

    def same_as(self, other: Scene) -> bool:
        """Return whether `other` has the same triangles in the same order."""
        _check.instance("other", other, Scene)
        return self is other or (
            np.array_equal(self.faces, other.faces)
            and np.array_equal(self.vertices, other.vertices)
        )

    @cached_property
    def zero_area(self) -> int:
        """Number of triangles of exactly zero area."""
        a, b, c = (self.vertices[self.faces[:, k]].astype(np.float64) for k in range(3))
        return int((np.cross(b - a, c - a) == 0).all(axis=1).sum())

    @cached_property
    def bounds(self) -> F64:
        """(2, 3) float64, world: the smallest and the largest corner of the used vertices."""
        used = self.vertices[self.faces.ravel()].astype(np.float64)
        bounds = np.stack([used.min(axis=0), used.max(axis=0)])
        bounds.flags.writeable = False
        return bounds

    @cached_property
    def corners(self) -> F32:
        """(F, 9) float32, world: the three vertices of each triangle, side by side, 36 bytes.

        For kernels, hence writable; nobody writes it.
        """
        return self.vertices[self.faces].reshape(-1, 9)

    @cached_property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal, world units: what a scene's lengths relate to."""
        low, high = self.bounds
        return float(np.linalg.norm(high - low))
