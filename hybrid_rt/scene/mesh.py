"""Triangles: meshes as files give them, and scenes that are traced."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt._arrays import F32, F64, I32
from hybrid_rt.errors import ArgumentError


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
