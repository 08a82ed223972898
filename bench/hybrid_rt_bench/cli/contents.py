"""What is in a mesh file, a definition of a scene or a file of cameras, as tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt.camera_files import read_table
from hybrid_rt_bench.cli import terminal
from hybrid_rt_bench.measure.plan import find_scene

MOST_OBJECTS = 20
"""Objects that are listed one by one: the largest."""


def show(name: str) -> None:
    """Print what is in a file, or in a scene of that name.

    Raises
    ------
    ArgumentError, UnknownNameError, MeshFileError, MissingDataError
        What cannot be read.
    """
    out = terminal.out()
    path = Path(name)
    if path.suffix.lower() == ".toml" and path.is_file() and not _is_scene(path):
        out.print(_cameras(f"cameras of {path.name}", hrt.load_cameras(path)))
        return
    spec = find_scene(name)
    scene = spec.load()
    out.print(_mesh(spec, scene))
    if len(np.unique(scene.object_id)) > 1:
        out.print(_objects(scene))
    views = {key: view.sized(1920, 1080) for key, view in spec.cameras.items()}
    own = any(isinstance(view, hrs.GivenCamera) for view in spec.cameras.values())
    placed = path.is_file() and path.suffix.lower() != ".toml" and not own
    title = "cameras, placed automatically" if placed else "cameras"
    out.print(_cameras(title, views))


def _is_scene(path: Path) -> bool:
    return "mesh" in read_table(path)


def _mesh(spec: hrs.SceneSpec, scene: hrt.Scene) -> Table:
    low, high = scene.bounds
    rows = {
        "scene": spec.title,
        "triangles": f"{len(scene):,}",
        "of zero area": f"{scene.zero_area:,}",
        "vertices": f"{len(scene.vertices):,}",
        "objects": f"{len(np.unique(scene.object_id)):,}",
        "polygons": f"{len(np.unique(scene.polygon_id)):,}",
        "from": _vector(low),
        "to": _vector(high),
        "diagonal": f"{scene.diagonal:.6g}",
    }
    table = Table(show_header=False, box=None)
    for key, value in rows.items():
        table.add_row(key, value)
    return table


def _objects(scene: hrt.Scene) -> Table:
    """Return the largest objects, with their bounds."""
    ids, counts = np.unique(scene.object_id, return_counts=True)
    largest = np.argsort(-counts, kind="stable")[:MOST_OBJECTS]
    more = f", the {MOST_OBJECTS} largest of {len(ids)}" if len(ids) > MOST_OBJECTS else ""
    table = Table("object", "triangles", "from", "to", title=f"objects{more}", title_justify="left")
    for k in largest:
        used = scene.vertices[scene.faces[scene.object_id == ids[k]].ravel()]
        table.add_row(
            str(ids[k]), f"{counts[k]:,}", _vector(used.min(axis=0)), _vector(used.max(axis=0))
        )
    return table


def _cameras(title: str, cameras: Mapping[str, hrt.Camera]) -> Table:
    columns = ("name", "kind", "pixels", "eye", "along", "shows", "near", "far")
    table = Table(*columns, title=title, title_justify="left")
    for name, camera in cameras.items():
        parallel = isinstance(camera, hrt.Orthographic)
        shows = (
            f"{camera.view_height:.4g} high"
            if isinstance(camera, hrt.Orthographic)
            else f"{getattr(camera, 'vfov_deg', np.nan):.4g} degrees high"
        )
        table.add_row(
            name, "orthographic" if parallel else "pinhole", f"{camera.width}x{camera.height}",
            _vector(camera.eye), _vector(camera.forward), shows, f"{camera.near:.4g}",
            f"{camera.far:.4g}",
        )  # fmt: skip
    return table


def _vector(values: Any) -> str:
    return ", ".join(f"{float(value):.4g}" for value in values)
