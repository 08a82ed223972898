"""Read triangle meshes from files."""

from __future__ import annotations

import io
import json
import os
import re
import zipfile
import zlib
from collections.abc import Iterator
from lzma import LZMAError
from pathlib import Path
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError, MeshFileError
from hybrid_rt.scene.mesh import Mesh, Scene

TRIMESH_SUFFIXES = (".obj", ".ply", ".glb", ".gltf", ".stl")
SUFFIXES = (".npz", *TRIMESH_SUFFIXES)

# trimesh would read these as zeros, or drop the copies, and only log it.
_GLTF_UNSUPPORTED = (
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "EXT_mesh_gpu_instancing",
)
_TRUNCATED = (zipfile.BadZipFile, zlib.error, LZMAError, EOFError, OSError, NotImplementedError)


def read_mesh(path: str | Path) -> Mesh:
    """Return the triangles of a mesh file.

    Parameters
    ----------
    path : str or Path
        ``.npz`` with ``vertices`` (V, 3) float, ``faces`` (F, 3) int and, if wanted, ``object_id``
        (F,) int; or ``.obj .ply .glb .gltf .stl``, read by trimesh. The suffix decides, in either
        case of letters.

    Returns
    -------
    Mesh
        No vertex is merged and no triangle dropped, be its area zero. Polygons come as triangles.
        A scene graph is flattened: every node that carries geometry is an instance with its own
        `object_id`, its transform is applied in float64 and the result rounded once to float32.

    Raises
    ------
    MeshFileError
        The file is absent, a folder, of an unknown suffix, truncated, corrupt, holds no triangles,
        or arrays that `Mesh.from_arrays` refuses. The message names the file and what is wrong.

    Notes
    -----
    A file that ends early is noticed wherever the format tells its own length (.npz, .ply, .glb,
    .stl) and otherwise where what is left makes no sense; an .obj cut after a whole face line is a
    valid smaller .obj.
    """
    if not isinstance(path, str | os.PathLike):
        raise ArgumentError("path", "a str or a Path", _check.describe(path))
    path = Path(path)
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
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        known = " ".join(SUFFIXES)
        raise MeshFileError(
            f"{path}: unknown mesh format {path.suffix or '(no suffix)'!r}; known: {known}"
        )
    try:
        return _read_npz(path) if suffix == ".npz" else _read_trimesh(path, suffix)
    except ArgumentError as error:
        raise MeshFileError(f"{path}: {error}") from error


def _read_npz(path: Path) -> Mesh:
    if not zipfile.is_zipfile(path):
        raise MeshFileError(f"{path}: truncated, or not an .npz archive at all")
    try:
        with np.load(path, allow_pickle=False) as archive:
            missing = [key for key in ("vertices", "faces") if key not in archive.files]
            if missing:
                held = ", ".join(archive.files) or "nothing"
                raise MeshFileError(
                    f"{path}: no array {' nor '.join(map(repr, missing))} (it holds {held})"
                )
            vertices, faces = archive["vertices"], archive["faces"]
            object_id = archive["object_id"] if "object_id" in archive.files else None
    except _TRUNCATED as error:
        raise MeshFileError(f"{path}: truncated or corrupt .npz archive ({error})") from error
    except ValueError as error:
        # NumPy says so of objects, which would have to be unpickled, and of broken headers.
        raise MeshFileError(f"{path}: not an .npz of plain numeric arrays ({error})") from error
    return Mesh.from_arrays(vertices, faces, object_id)


def _read_trimesh(path: Path, suffix: str) -> Mesh:
    try:
        scene = _open_with_trimesh(path, suffix)
        parts = list(_instances(scene, reverse=suffix == ".obj"))
    except MeshFileError:
        raise
    except Exception as error:  # whatever a parser meets in a broken file
        reason = f"{type(error).__name__}: {error}"
        raise MeshFileError(f"{path}: truncated or corrupt {suffix} file ({reason})") from error
    if not parts:
        raise MeshFileError(f"{path}: no triangles in it (a point cloud, lines or an empty scene)")
    starts = np.cumsum([0] + [len(v) for v, _ in parts[:-1]])
    return Mesh.from_arrays(
        np.concatenate([v for v, _ in parts]),
        np.concatenate([f + start for (_, f), start in zip(parts, starts, strict=True)]),
        np.repeat(np.arange(len(parts)), [len(f) for _, f in parts]),
    )


def _open_with_trimesh(path: Path, suffix: str) -> Any:
    import trimesh  # a second of work that an .npz does not need

    # skip_materials: a missing texture must not matter to geometry.
    if suffix == ".obj":
        text = _absolute_indices(path.read_text(encoding="utf-8", errors="replace"))
        return trimesh.load_scene(
            io.BytesIO(text.encode()),
            file_type="obj",
            process=False,
            skip_materials=True,
            maintain_order=True,
            group_material=False,
        )
    if suffix in (".glb", ".gltf"):
        _check_gltf(path, suffix)
        return trimesh.load_scene(path, process=False, skip_materials=True, merge_primitives=False)
    if suffix == ".ply":
        _check_ascii_ply(path)
    return trimesh.load_scene(path, process=False)


def _instances(scene: Any, *, reverse: bool) -> Iterator[tuple[Any, Any]]:
    """Yield float64 world vertices and faces of each node of a scene graph that has triangles."""
    import trimesh

    nodes = list(scene.graph.nodes_geometry)
    # trimesh pops the pieces of an .obj from its end.
    for node in reversed(nodes) if reverse else nodes:
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if not isinstance(geometry, trimesh.Trimesh) or len(geometry.faces) == 0:
            continue
        vertices = np.asarray(geometry.vertices, np.float64)
        faces = np.asarray(geometry.faces, np.int64)
        yield vertices @ matrix[:3, :3].T + matrix[:3, 3], faces


def _absolute_indices(text: str) -> str:
    """Return .obj text whose faces count from the start of the file.

    A negative index counts back from the last vertex read so far; trimesh would count it from the
    last vertex of the file.
    """
    if not re.search(r"^f\s.*-", text, re.MULTILINE):
        return text
    seen = {"v": 0, "vt": 0, "vn": 0}
    order = tuple(seen)

    def absolute(corner: str) -> str:
        indices = [
            str(seen[kind] + 1 + int(index)) if index.startswith("-") else index
            for kind, index in zip(order, corner.split("/"), strict=False)
        ]
        return "/".join(indices)

    lines = []
    for line in text.splitlines():
        word, _, rest = line.partition(" ")
        if word in seen:
            seen[word] += 1
        elif word == "f" and "-" in rest:
            line = "f " + " ".join(absolute(corner) for corner in rest.split())
        lines.append(line)
    return "\n".join(lines)


def _check_gltf(path: Path, suffix: str) -> None:
    """Raise unless a glTF file is as long as it says and needs nothing that would be lost."""
    data = path.read_bytes()
    if suffix == ".glb":
        stated = int.from_bytes(data[8:12], "little")
        if data[:4] != b"glTF" or stated != len(data):
            raise ValueError(f"the header says {stated} bytes, the file has {len(data)}")
        data = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    tree = json.loads(data)
    lost = sorted(set(_GLTF_UNSUPPORTED) & set(tree.get("extensionsUsed", [])))
    if lost:
        raise MeshFileError(
            f"{path}: uses {', '.join(lost)}, which cannot be read; store it without"
        )
    accessors = tree.get("accessors", [])
    for mesh in tree.get("meshes", []):
        for primitive in mesh["primitives"]:
            if accessors[primitive["attributes"]["POSITION"]].get("normalized", False):
                # trimesh reads the integers as they are, 32767 times too large.
                raise MeshFileError(f"{path}: normalised positions cannot be read; store floats")


def _check_ascii_ply(path: Path) -> None:
    """Raise when an ASCII .ply has fewer rows than its header says; trimesh reads what is there."""
    with path.open("rb") as file:
        head, end, body = file.read().partition(b"end_header")
    if not end or b"format ascii" not in head:
        return
    stated = sum(int(n) for n in re.findall(rb"^element\s+\S+\s+(\d+)", head, re.MULTILINE))
    rows = len([row for row in body.splitlines() if row.strip()])
    if rows < stated:
        raise ValueError(f"the header says {stated} rows, the file has {rows}")


def load_scene(path: str | Path) -> Scene:
    """Return the scene in a mesh file.

    Parameters
    ----------
    path : str or Path
        Any file that `hybrid_rt.read_mesh` reads: .npz .obj .ply .glb .gltf .stl.

    Returns
    -------
    Scene
        Named after the file. Triangles keep the order of the file, so `prim_id` is theirs.

    Raises
    ------
    MeshFileError
        The file cannot be read; the message names it and says what is wrong.
    """
    return Scene.from_meshes([read_mesh(path)], name=Path(path).stem)
