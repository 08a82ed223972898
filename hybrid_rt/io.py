"""Read triangle meshes from files."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from hybrid_rt.errors import ArgumentError, MeshFileError
from hybrid_rt.types import Mesh


def read_mesh(path: str | Path) -> Mesh:
    """Return the triangles of a mesh file."""
    path = Path(path)
    if not path.is_file():
        raise MeshFileError(f"{path}: no such file")
    try:
        with np.load(path, allow_pickle=False) as data:
            arrays = {key: data[key] for key in data.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise MeshFileError(f"{path}: not a readable .npz archive ({error})") from error
    try:
        return Mesh.from_arrays(arrays["vertices"], arrays["faces"], arrays.get("object_id"))
    except (KeyError, ArgumentError) as error:
        raise MeshFileError(f"{path}: {error}") from error
