"""Find scenes by name or by path."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

import hybrid_rt as hrt
from hybrid_rt import _check
from hybrid_rt.registry import Registry
from hybrid_rt_scenes.automatic import automatic_cameras
from hybrid_rt_scenes.given import given_cameras
from hybrid_rt_scenes.places import data_directories
from hybrid_rt_scenes.spec import CameraSpec, LightsSpec, MeshSpec, SceneSpec

DEFINITIONS = Path(__file__).parent / "definitions"
BY_PATH = "It was named by its path."


class _Scenes(Registry[SceneSpec]):
    def check(self, thing: Any) -> None:
        _check.instance("scene", thing, SceneSpec)
        if thing.name in _defined():
            raise hrt.ArgumentError("name of a scene", "one that is not taken", repr(thing.name))


SCENES = _Scenes("scene", "hybrid_rt.scenes")
"""Scenes that are not defined here: of entry points, and registered in a script."""


def register(scene: SceneSpec) -> SceneSpec:
    """Make a scene known by its name, and return it.

    Installed distributions offer theirs as entry points of the group ``hybrid_rt.scenes``, each of
    which names a `SceneSpec`.

    Raises
    ------
    ArgumentError
        No SceneSpec, or a name that is taken.
    """
    return SCENES.register(scene)


def _defined() -> dict[str, Path]:
    """Return the definitions by name: those that come with the package, then imported ones."""
    found: dict[str, Path] = {}
    for folder in (DEFINITIONS, *data_directories()):
        for path in sorted(folder.glob("*.toml")):
            found.setdefault(path.stem, path)
    return found


def scene_names() -> list[str]:
    """Return the names of all scenes, sorted, whether their data is there or not.

    They are those that come with this package, those that ``hybrid-rt import`` has written to a
    data directory, a ``NAME.toml`` each, and those of `register`.
    """
    return sorted({*_defined(), *SCENES})


def get_scene(name: str) -> SceneSpec:
    """Return the definition of scene `name`; nothing is loaded yet.

    Raises
    ------
    UnknownNameError
        No such scene; the message suggests the nearest name.
    """
    if (path := _defined().get(name)) is not None:
        return read_definition(path)
    if name not in SCENES:
        raise hrt.UnknownNameError("scene", str(name), scene_names())
    return SCENES[name]


def all_scenes() -> tuple[list[SceneSpec], list[str]]:
    """Return all scenes, and a sentence about each name of which there is none to be had.

    That is a definition in a data directory that was damaged, or a plug-in that cannot be loaded.
    """
    specs, faults = [], []
    for name in scene_names():
        try:
            specs.append(get_scene(name))
        except hrt.HybridRTError as error:
            faults.append(f"scene {name!r} cannot be used: {error}")
    return specs, faults


def read_definition(path: Path) -> SceneSpec:
    """Return the scene that a TOML file defines; it is named after the file.

    Raises
    ------
    UnknownNameError
        A key, generator or generator's parameter that does not exist, with a suggestion.
    ArgumentError
        Not TOML, a key that is missing, or a value of the wrong kind or out of range.
    """
    return _validated(_table(path), path)


def _table(path: Path) -> dict[str, Any]:
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        raise hrt.ArgumentError(path.name, "a TOML file", str(error)) from error
    if "name" in table:
        raise hrt.UnknownNameError(f"key of {path.name}", "name", set(_keys(SceneSpec)) - {"name"})
    return table


def _validated(table: dict[str, Any], path: Path) -> SceneSpec:
    try:
        return SceneSpec.model_validate({**table, "name": path.stem})
    except hrt.UnknownNameError as error:
        kind = f"{error.kind} in {path.name}"
        raise hrt.UnknownNameError(kind, error.name, error.known) from None
    except ValidationError as error:
        raise _explain(path.name, error) from None


def _explain(file: str, error: ValidationError) -> hrt.HybridRTError:
    """Return the first of pydantic's complaints as one of ours."""
    # A misspelt key also leaves one missing: the misspelling is what helps.
    found = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
    first = found[0]
    where = first["loc"]
    if first["type"] == "extra_forbidden":
        models: dict[Any, type[BaseModel]] = {
            "mesh": MeshSpec, "cameras": CameraSpec, "lights": LightsSpec,
        }  # fmt: skip
        model = models.get(where[0], SceneSpec) if len(where) > 1 else SceneSpec
        known = set(_keys(model)) - {"name"}
        prefix = ".".join(str(part) for part in where[:-1])
        kind = f"key of {file}" + (f" [{prefix}]" if prefix else "")
        return hrt.UnknownNameError(kind, str(where[-1]), known)
    place = ": ".join([file, ".".join(str(part) for part in where)]) if where else file
    if first["type"] == "missing":
        return hrt.ArgumentError(place, "a value", "none")
    if first["type"] == "value_error":
        inner = first["ctx"]["error"]
        if isinstance(inner, hrt.ArgumentError):
            return hrt.ArgumentError(f"{place}.{inner.argument}", inner.expected, inner.got)
        return hrt.HybridRTError(f"{place}: {inner}")
    return hrt.ArgumentError(place, first["msg"], _check.describe(first["input"]))


def _keys(model: type[BaseModel]) -> list[str]:
    return list(model.model_fields)


def scene_from_path(path: str | Path) -> SceneSpec:
    """Return a scene of a mesh file, or the one that a TOML file of one's own defines.

    Parameters
    ----------
    path : str or Path
        Any file that `hybrid_rt.read_mesh` reads. It is read at once, since cameras depend on it,
        and `load` of the result returns what was read. Its views are the cameras of a glTF file,
        or else `automatic_cameras`. Or a ``.toml`` like those of this package, whose mesh files are
        looked for beside it first; `title`, `description` and `needs` may be left out.

    Raises
    ------
    MeshFileError
        The file cannot be read.
    ArgumentError, UnknownNameError
        As `read_definition`.

    Warns
    -----
    UserWarning
        The cameras of a glTF file cannot be used; then the views are automatic.
    """
    path = Path(path)
    if path.suffix.lower() == ".toml":
        return _own_definition(path)
    scene = hrt.load_scene(path)
    cameras = _own_cameras(path)
    said = (
        "Its cameras are those of the file."
        if cameras
        else "Its cameras were placed automatically, never inside closed geometry, so that "
        "surfaces fill half of each picture at least."
    )
    spec = SceneSpec(
        name=path.stem,
        title=path.name,
        description=f"{len(scene)} triangles of {path.name}. {said}",
        needs=BY_PATH,
        mesh=(MeshSpec(file=str(path.resolve())),),
        cameras=cameras or automatic_cameras(scene),
    )
    spec._loaded = scene
    return spec


def _own_cameras(path: Path) -> dict[str, CameraSpec]:
    """Return the views of a glTF file, if it has any that can be used."""
    if path.suffix.lower() not in (".glb", ".gltf"):
        return {}
    try:
        return given_cameras(hrt.load_cameras(path))
    except hrt.HybridRTError as error:
        warnings.warn(f"cameras are placed automatically: {error}", UserWarning, stacklevel=3)
        return {}


def _own_definition(path: Path) -> SceneSpec:
    table = _table(path)
    for key, value in (("title", path.stem), ("description", f"Defined by {path.name}.")):
        table.setdefault(key, value)
    meshes = table.get("mesh")
    for mesh in meshes if isinstance(meshes, list) else []:
        if isinstance(mesh, dict) and isinstance(mesh.get("file"), str):
            beside = path.parent / mesh["file"]
            if beside.is_file():
                mesh["file"] = str(beside.resolve())
            table.setdefault("needs", BY_PATH)
    return _validated(table, path)
