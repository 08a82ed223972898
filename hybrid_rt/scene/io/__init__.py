"""Read triangle meshes from files, each format by a module of its own.

The rule: the right geometry, or an error that names the file, the place in it and the feature;
never another geometry without a word.
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError, MeshFileError
from hybrid_rt.scene.io import npz, obj, ply, stl
from hybrid_rt.scene.io.fault import Budget, FormatError
from hybrid_rt.scene.io.gltf import cameras, reader
from hybrid_rt.scene.io.gltf.cameras import FileCamera
from hybrid_rt.scene.mesh import Mesh, Scene

__all__ = ["GLTF_SUFFIXES", "SUFFIXES", "FileCamera", "load_scene", "read_cameras", "read_mesh"]

GLTF_SUFFIXES = (".glb", ".gltf")
_ONE_FILE = {".obj": obj.read, ".ply": ply.read, ".stl": stl.read}
SUFFIXES = (".npz", ".obj", ".ply", ".glb", ".gltf", ".stl")


def read_mesh(path: str | Path, *, max_bytes: int | None = None) -> Mesh:
    """Return the triangles of a mesh file.

    Parameters
    ----------
    path : str or Path
        ``.npz`` with ``vertices`` (V, 3) float, ``faces`` (F, 3) int and, if wanted, ``object_id``
        and ``polygon_id`` (F,) int; or ``.obj .ply .glb .gltf .stl``. The suffix decides, in either
        case of letters.
    max_bytes : int, optional
        The most that the file, and what it unpacks to, may take in memory, bytes; default: the
        environment variable HYBRID_RT_MAX_MESH_BYTES, or else 4 GiB.

    Returns
    -------
    Mesh
        No vertex is merged and no triangle dropped, be its area zero. Polygons come as triangles,
        in the order of the file, and `polygon_id` says which are of one. A scene graph is
        flattened: every primitive of every node is an instance with its own `object_id`, its
        transform is applied in float64 and the result rounded once to float32. In an .obj each o, g
        or usemtl that changes the name begins an object, in an .stl each solid is one.

    Raises
    ------
    ArgumentError
        `path` is no path, `max_bytes` no number.
    MeshFileError
        The file is absent, a folder, of an unknown suffix, truncated, corrupt, larger than allowed,
        holds no triangles, something that cannot be read as it is meant, or arrays that `Mesh`
        refuses. The message names the file, the place in it and what is wrong.

    Warns
    -----
    UserWarning
        The file holds points or lines beside its triangles; they are left out.

    Notes
    -----
    What of each format is read and what is refused stands at the top of the module that reads it:
    ``hybrid_rt/scene/io/{npz,obj,ply,stl,gltf/reader,polygons}.py``.

    A file that ends early is noticed wherever the format tells its own length (.npz, .ply, .glb,
    .stl) and otherwise where what is left makes no sense; an .obj cut after a whole face line is a
    valid smaller .obj.
    """
    path = _regular_file(path, SUFFIXES, "mesh")
    budget = Budget(max_bytes)
    try:
        with np.errstate(all="ignore"):  # what overflows is refused as not finite
            mesh, skipped = _read(path, budget)
    except Exception as error:
        raise _named(path, error) from error
    if skipped:
        message = f"{path}: its {skipped} are left out; only triangles are read"
        warnings.warn(message, UserWarning, stacklevel=2)
    return mesh


def _read(path: Path, budget: Budget) -> tuple[Mesh, str]:
    """Return the mesh, and in words what was left out."""
    suffix = path.suffix.lower()
    if suffix == ".npz":
        return Mesh.from_arrays(**npz.read(path, budget)), ""
    data = _bytes(path, budget)
    found = reader.read(path, data, budget) if suffix in GLTF_SUFFIXES else _ONE_FILE[suffix](data)
    arrays = found.vertices, found.faces, found.object_id, found.polygon_id
    return Mesh.from_arrays(*arrays), found.skipped


def read_cameras(path: str | Path, *, max_bytes: int | None = None) -> list[FileCamera]:
    """Return the cameras in the default scene of a glTF file.

    Parameters
    ----------
    path : str or Path
        A .gltf or .glb.
    max_bytes : int, optional
        As in `read_mesh`.

    Returns
    -------
    list of FileCamera
        In the order of the scene's nodes; empty where there is none.

    Raises
    ------
    ArgumentError, MeshFileError
        As in `read_mesh`.
    """
    path = _regular_file(path, GLTF_SUFFIXES, "glTF")
    try:
        return cameras.read(path, _bytes(path, Budget(max_bytes)))
    except Exception as error:
        raise _named(path, error) from error


def load_scene(path: str | Path, *, max_bytes: int | None = None) -> Scene:
    """Return the scene in a mesh file.

    Parameters
    ----------
    path : str or Path
        Any file that `hybrid_rt.read_mesh` reads: .npz .obj .ply .glb .gltf .stl.
    max_bytes : int, optional
        As in `hybrid_rt.read_mesh`.

    Returns
    -------
    Scene
        Named after the file. Triangles keep the order of the file, so `prim_id` is theirs, and
        ``scene.polygon_id[prim_id]`` is the polygon of the file.

    Raises
    ------
    MeshFileError
        The file cannot be read; the message names it and says what is wrong.
    """
    return Scene.from_meshes([read_mesh(path, max_bytes=max_bytes)], name=Path(path).stem)


def _regular_file(path: object, suffixes: tuple[str, ...], kind: str) -> Path:
    if not isinstance(path, str | os.PathLike):
        raise ArgumentError("path", "a str or a Path", _check.describe(path))
    path = Path(os.fspath(path))
    if "\0" in str(path):
        raise ArgumentError("path", "a path without NUL characters", _check.describe(str(path)))
    try:
        folder, there = path.is_dir(), path.exists()
    except OSError as error:  # a name that is too long, a folder that may not be looked into
        raise MeshFileError(f"{path}: {error.strerror}") from error
    if folder:
        raise MeshFileError(f"{path}: expected a mesh file, got a folder")
    if not there:
        raise MeshFileError(f"{path}: no such file")
    if not path.is_file():
        raise MeshFileError(f"{path}: expected a regular file, got a device, pipe or socket")
    if path.suffix.lower() not in suffixes:
        known = " ".join(suffixes)
        raise MeshFileError(
            f"{path}: unknown {kind} format {path.suffix or '(no suffix)'!r}; known: {known}"
        )
    return path


def _bytes(path: Path, budget: Budget) -> bytes:
    budget.spend(path.stat().st_size, "the file")
    return path.read_bytes()


def _named(path: Path, error: Exception) -> MeshFileError:
    """Return the error of a file; readers mean the first two kinds, the system the next two."""
    match error:
        case FormatError() | ArgumentError():
            what = str(error)
        case MemoryError():
            what = "more than memory can hold"
        case OSError():
            what = error.strerror or str(error)
        case _:
            what = f"corrupt in a way that no check foresaw ({type(error).__name__}: {error})"
    return MeshFileError(f"{path}: {what}")
