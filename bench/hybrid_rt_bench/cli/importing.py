"""``hybrid-rt import``."""

from __future__ import annotations

import warnings
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.cli import terminal

if TYPE_CHECKING:
    from hybrid_rt_scenes import ImportedScene

LITTLE = 0.05
"""A camera that shows surfaces on less than this share of its pixels is worth a word."""


class Up(StrEnum):
    """The axis that points upwards in a file."""

    y = "y"
    z = "z"


def import_mesh(
    file: Annotated[Path, typer.Argument(help="A .obj .ply .stl .gltf .glb or .npz.")],
    name: Annotated[
        str | None,
        typer.Option("--name", help="What the scene will be called; default: as the file is."),
    ] = None,
    scale: Annotated[
        float, typer.Option("--scale", help="Multiplies all coordinates: 0.01 for centimetres.")
    ] = 1.0,
    up: Annotated[
        Up, typer.Option("--up", help="The axis that points upwards in the file.")
    ] = Up.y,
    force: Annotated[bool, typer.Option("--force", help="Replace a scene of that name.")] = False,
) -> None:
    """Bring a mesh file in as a scene, which then is known by its name.

    The mesh is checked and written to the data directory (see `info`) as `NAME.npz`, with
    `NAME.toml`, which defines its cameras: those of a glTF file, else some that are placed
    automatically. Edit that file to change them. The name of a real scene that `list` shows as
    missing stands for that scene: its file is written, and its own cameras are kept.

    Examples
    --------
    * `hybrid-rt import hall.glb`

    * `hybrid-rt import plant.stl --name plant --scale 0.001 --up z`

    * `hybrid-rt import Sponza.gltf --name sponza`
    """
    from hybrid_rt_scenes import import_scene

    out = terminal.out()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        made = import_scene(file, name=name, scale=scale, up=up.value)
    for warning in said:
        terminal.err().print(f"note: {warning.message}", style="yellow", soft_wrap=True)
    paths = _paths(made)
    taken = [path for path in paths if path.exists()]
    if taken and not force:
        got = f"{made.spec.name!r}, as {taken[0]} exists; --force replaces it"
        raise ArgumentError("--name", "one that is not taken", got)
    for line in [*_geometry(made), *_cameras(made)]:
        out.print(line, soft_wrap=True, highlight=False)
    _write(made, paths)
    for path in paths:
        out.print(f"wrote {path}", soft_wrap=True, highlight=False)
    out.print(f"\nTry: hybrid-rt render {made.spec.name} -o {made.spec.name}.png", highlight=False)
    out.print(f"     hybrid-rt run paper --quick --scenes {made.spec.name}", highlight=False)


def _paths(made: ImportedScene) -> list[Path]:
    """Return the files that the scene takes; the definition is last, and makes it known."""
    from hybrid_rt_scenes import data_directory

    folder = data_directory()
    mesh = folder / made.file
    return [mesh] if made.known else [mesh, folder / f"{made.spec.name}.toml"]


def _geometry(made: ImportedScene) -> list[str]:
    import numpy as np

    from hybrid_rt.scene.mesh import Scene

    scene = Scene.from_meshes([made.mesh])
    objects = len(np.unique(scene.object_id))
    low, high = (", ".join(f"{x:.6g}" for x in corner) for corner in scene.bounds)
    about = f"scene {made.spec.name!r}: {len(scene):,} triangles in {objects:,} object"
    about += "s" * (objects != 1)
    if scene.zero_area:
        about += f", {scene.zero_area:,} of them of zero area, which no ray hits"
    return [about, f"from ({low}) to ({high}), diagonal {scene.diagonal:.6g}, +Y up"]


def _cameras(made: ImportedScene) -> list[str]:
    covered = made.covered()
    shares = ", ".join(f"{name} ({share:.0%})" for name, share in covered.items())
    source = {
        "file": "cameras of the file",
        "automatic": "cameras, placed automatically",
        "definition": "cameras of the definition that comes with hybrid-rt",
    }[made.cameras_from]
    lines = [f"{len(covered)} {source}, with the share of pixels that show a surface: {shares}"]
    empty = [name for name, share in covered.items() if share < LITTLE]
    if empty and made.known:
        lines.append(
            f"note: {', '.join(empty)} show next to nothing. These cameras were placed for: "
            f"{made.spec.description} Try another --scale or --up."
        )
    elif empty:
        lines.append(f"note: {', '.join(empty)} show next to nothing")
    if made.known and made.spec.mark:
        lines.append(
            f"note: reports will call this scene {made.spec.mark}: {made.spec.note}. If that is "
            "not so of this file, give it another --name."
        )
    return lines


def _write(made: ImportedScene, paths: list[Path]) -> None:
    import numpy as np

    from hybrid_rt_bench.results.files import disk_errors, write_atomic, write_bytes

    folder, mesh = paths[0].parent, made.mesh
    with disk_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    write_atomic(
        paths[0],
        lambda file: np.savez_compressed(
            file,
            vertices=mesh.vertices,
            faces=mesh.faces,
            object_id=mesh.object_id,
            polygon_id=mesh.polygon_id,
        ),
    )
    if made.definition is not None:
        write_bytes(paths[1], made.definition.encode())
