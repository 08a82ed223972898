"""Assemble scenes from mesh files."""

from __future__ import annotations

from pathlib import Path

from hybrid_rt.io import read_mesh
from hybrid_rt.types import Scene


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
