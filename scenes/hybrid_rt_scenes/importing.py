"""Make a scene of a mesh file of someone's own: checked, turned, scaled, with cameras."""

from __future__ import annotations

import itertools
import math
import re
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import tomlkit
from numpy.typing import NDArray
from pydantic import ValidationError

import hybrid_rt as hrt
from hybrid_rt import _check
from hybrid_rt.scene.io import FileCamera, read_cameras
from hybrid_rt_scenes.automatic import automatic_cameras, coverage
from hybrid_rt_scenes.registry import DEFINITIONS, SCENES, get_scene
from hybrid_rt_scenes.spec import CameraSpec, MeshSpec, SceneSpec, Vector

F64 = NDArray[np.float64]

NAME = re.compile(r"[a-z][a-z0-9_-]{0,63}")
Up = Literal["y", "z"]


@dataclass(frozen=True, eq=False)
class ImportedScene:
    """A scene that is ready to be written to a data directory.

    Attributes
    ----------
    spec : SceneSpec
        Its definition; `spec.name` is the scene's name.
    file : str
        Name of the .npz that the definition reads.
    mesh : Mesh
        What belongs in that file: +Y up, scaled.
    known : bool
        Whether the definition is one that comes with this package, so that none has to be written.
    cameras_from : str
        "definition", "file" or "automatic".
    """

    spec: SceneSpec
    file: str
    mesh: hrt.Mesh
    known: bool
    cameras_from: str

    @property
    def definition(self) -> str | None:
        """The text of the TOML file that defines the scene, or None where it is `known`."""
        if self.known:
            return None
        said = self.spec.model_dump(mode="json", exclude={"name"}, exclude_none=True)
        said["mesh"] = [{"file": self.file}]
        return tomlkit.dumps(said)

    def covered(self) -> dict[str, float]:
        """Return the share of pixels that show a surface, by camera."""
        scene = hrt.Scene.from_meshes([self.mesh], name=self.spec.name)
        return {name: coverage(scene, view) for name, view in self.spec.cameras.items()}


def import_scene(
    path: str | Path, *, name: str | None = None, scale: float = 1.0, up: Up = "y"
) -> ImportedScene:
    """Return the scene that a mesh file makes; nothing is written.

    Parameters
    ----------
    path : str or Path
        Any file that `hybrid_rt.read_mesh` reads.
    name : str, optional
        What the scene will be called; default: the file's name in lower case, with "_" for what a
        name cannot hold. The name of a real scene that this package defines, such as "sponza",
        stands for that scene: the file takes the place that its definition reads.
    scale : float
        What all coordinates are multiplied with, > 0: 0.01 makes metres of centimetres.
    up : {"y", "z"}
        The axis that points upwards in the file. "z" turns it about x, so that +Y does.

    Returns
    -------
    ImportedScene
        Its cameras are those of the definition where the package has one, else the perspective
        cameras of a glTF file, else placed automatically.

    Raises
    ------
    ArgumentError
        A name that cannot be one, or is that of a scene made from code or of a plug-in; a scale
        that is not finite and > 0, or that leaves float32; an `up` that is neither.
    MeshFileError
        The file cannot be read.

    Warns
    -----
    UserWarning
        Points or lines of the file, or its orthographic cameras, are left out.
    """
    scale = _check.real("scale", scale, above=0.0)
    _check.choice("up", up, ("y", "z"))
    path = Path(path)
    chosen = _name(path, name)
    known = _known(chosen)
    mesh = _turned(hrt.read_mesh(path), scale, up)
    if known is not None:
        file = next(str(part.file) for part in known.mesh if part.file is not None)
        return ImportedScene(known, file, mesh, True, "definition")
    views = _cameras(path, scale, up)
    source = "file" if views else "automatic"
    scene = hrt.Scene.from_meshes([mesh], name=chosen)
    file = f"{chosen}.npz"
    spec = SceneSpec(
        name=chosen,
        title=path.name,
        description=f"{len(scene):,} triangles, imported from {path.name}.",
        needs=f"It was imported from {path.name}.",
        mesh=(MeshSpec(file=file),),
        cameras=views or {k: _rounded(v) for k, v in automatic_cameras(scene).items()},
    )
    return ImportedScene(spec, file, mesh, False, source)


def _name(path: Path, name: str | None) -> str:
    stem = re.sub(r"[^a-z0-9_-]+", "_", path.stem.lower()).strip("_")
    chosen = stem if name is None else _check.text("name", name)
    if not NAME.fullmatch(chosen):
        expected = "lower-case letters, digits, _ and -, at most 64, a letter first"
        raise hrt.ArgumentError("name", expected, repr(chosen))
    return chosen


def _known(name: str) -> SceneSpec | None:
    """Return the definition of a real scene of that name, or None where the name is free."""
    if name in SCENES:
        raise hrt.ArgumentError("name", "one that no plug-in has", repr(name))
    if not (DEFINITIONS / f"{name}.toml").is_file():
        return None
    spec = get_scene(name)
    if spec.builtin:
        got = f"{name!r}, which is made from code"
        raise hrt.ArgumentError("name", "one that is not taken", got)
    return spec


def _turned(mesh: hrt.Mesh, scale: float, up: Up) -> hrt.Mesh:
    if scale == 1.0 and up == "y":
        return mesh
    places = _upright(mesh.vertices.astype(np.float64), up) * scale
    with np.errstate(over="ignore"):  # what leaves float32 is refused as not finite
        vertices = places.astype(np.float32)
    if not np.isfinite(vertices).all():
        raise hrt.ArgumentError("scale", "one that leaves coordinates within float32", repr(scale))
    return hrt.Mesh.from_arrays(vertices, mesh.faces, mesh.object_id, mesh.polygon_id)


def _upright(rows: F64, up: Up) -> F64:
    """Return (N, 3) places or directions with +Y up."""
    return rows if up == "y" else rows[:, [0, 2, 1]] * (1.0, 1.0, -1.0)


def _cameras(path: Path, scale: float, up: Up) -> dict[str, CameraSpec]:
    """Return the cameras of a file, by names that a command line can spell."""
    if path.suffix.lower() not in (".gltf", ".glb"):
        return {}
    views: dict[str, CameraSpec] = {}
    for camera in read_cameras(path):
        if camera.yfov is None:
            text = f"{path}: camera {camera.name!r} is left out: a scene's views are perspective"
            warnings.warn(text, UserWarning, stacklevel=3)
            continue
        try:
            views[_free(camera.name, views)] = _view(camera, camera.yfov, scale, up)
        except ValidationError as error:
            said = error.errors()[0]["msg"]
            raise hrt.MeshFileError(f"{path}: camera {camera.name!r}: {said}") from error
    return views


def _free(name: str, taken: Iterable[str]) -> str:
    plain = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "camera"
    numbered = (f"{plain}_{k}" for k in itertools.count(2))
    return next(one for one in itertools.chain([plain], numbered) if one not in taken)


def _view(camera: FileCamera, yfov: float, scale: float, up: Up) -> CameraSpec:
    eye, target, above = _upright(np.array([camera.eye, camera.target, camera.up]), up)
    return CameraSpec(
        eye=_vector(eye * scale),
        target=_vector(target * scale),
        up=_vector(above),
        vfov_deg=math.degrees(yfov),
        near=camera.znear * scale,
    )


def _rounded(view: CameraSpec) -> CameraSpec:
    """Return a view in numbers that people like to edit."""
    eye, target = (
        _vector(np.array([float(f"{x:.6g}") for x in place])) for place in (view.eye, view.target)
    )
    near = float(f"{view.near:.3g}")
    return CameraSpec(eye=eye, target=target, vfov_deg=view.vfov_deg, near=near)


def _vector(row: F64) -> Vector:
    x, y, z = row.tolist()
    return x, y, z
