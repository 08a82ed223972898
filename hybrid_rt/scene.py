"""Assemble scenes from mesh files."""

from __future__ import annotations

from pathlib import Path

from hybrid_rt.io import read_mesh
from hybrid_rt.types import Scene


def load_scene(path: str | Path) -> Scene:
    """Return the scene in a mesh file (see `hybrid_rt.io.read_mesh` for what can be read)."""
    return Scene.from_meshes([read_mesh(path)], name=Path(path).stem)
