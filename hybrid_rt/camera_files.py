"""Sets of cameras in files: TOML of the library's own, definitions of scenes, glTF.

A file of cameras, see `load_cameras`::

    kind = "cameras"
    schema = 1

    [cameras.nave]                  # form = "look_at", which need not be said
    eye = [-10.0, 1.5, 0.0]
    target = [5.0, 3.0, 0.0]
    vfov_deg = 60.0                 # up, width, height and near as in Camera.look_at

    [cameras.plan]
    form = "orthographic"           # Camera.orthographic
    eye = [0.0, 20.0, 0.0]
    target = [0.0, 0.0, 0.0]
    up = [0.0, 0.0, -1.0]
    view_height = 12.0
    far = 20.0

    [cameras.engine]
    form = "matrices"               # Camera.from_matrices
    view = [[1.0, 0.0, 0.0, 0.0], ...]
    projection = [[...], ...]
    convention = "d3d"
    width = 1280
    height = 720

    [cameras.calibrated]
    form = "intrinsics"             # Camera.from_intrinsics
    K = [[1100.0, 0.0, 655.5], [0.0, 1098.0, 371.0], [0.0, 0.0, 1.0]]
    R = [[...], [...], [...]]
    t = [0.1, 0.0, 2.0]
    width = 1280
    height = 720
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import tomlkit

from hybrid_rt import _check
from hybrid_rt.camera.camera import Camera
from hybrid_rt.camera.orthographic import Orthographic
from hybrid_rt.camera.pinhole import Pinhole
from hybrid_rt.errors import ArgumentError, UnknownNameError
from hybrid_rt.scene.io import GLTF_SUFFIXES, FileCamera, read_cameras

SCHEMA = 1
KIND = "cameras"
MOST_BYTES = 2**24
"""No file of cameras is longer than this."""
DEFAULT_HEIGHT = 1080
"""Pixels of a camera whose file says the shape of its picture and not the size."""

FORMS: dict[str, Callable[..., Camera]] = {
    "look_at": Camera.look_at,
    "orthographic": Camera.orthographic,
    "matrices": Camera.from_matrices,
    "intrinsics": Camera.from_intrinsics,
    "pinhole": Pinhole,
    "parallel": Orthographic,
}
"""What makes the camera of a table, by its `form`."""


def load_cameras(path: str | Path) -> dict[str, Camera]:
    """Return the cameras in a file by their names.

    Parameters
    ----------
    path : str or Path
        A ``.toml``: a file of cameras as this module describes it, or the definition of a scene; or
        a ``.gltf`` or ``.glb``.

    Returns
    -------
    dict of str to Camera
        In the order of the file; of a glTF file those of its default scene, and empty where there
        are none. Where the file says no size, pictures have 1920x1080 pixels or, of another shape,
        1080 rows: `Camera.resized` changes that.

    Raises
    ------
    ArgumentError, UnknownNameError
        A file that is absent or none of these, another schema, a key that is unknown or missing, a
        value that no camera can have: with the file and the key.
    MeshFileError
        A glTF file that cannot be read.

    Notes
    -----
    A file of cameras says ``kind = "cameras"`` and ``schema = 1``; each camera is a table
    ``[cameras.NAME]`` with a `form`, and the keys of a form are the arguments of a method, with the
    same defaults:

    ==============  ============================================================================
    form            keys
    ==============  ============================================================================
    "look_at"       eye, target, up, vfov_deg, width, height, near: `Camera.look_at`; the default
    "orthographic"  eye, target, up, view_height, width, height, near, far: `Camera.orthographic`
    "matrices"      view, projection, width, height, convention: `Camera.from_matrices`
    "intrinsics"    K, R, t, width, height, near: `Camera.from_intrinsics`
    "pinhole"       the attributes of `Pinhole`, as `save_cameras` writes them
    "parallel"      the attributes of `Orthographic`, as `save_cameras` writes them
    ==============  ============================================================================
    """
    path = _path(path)
    if path.suffix.lower() in GLTF_SUFFIXES:
        return _of_gltf(path)
    if path.suffix.lower() != ".toml":
        expected = "a file that ends in .toml, .gltf or .glb"
        raise ArgumentError("path", expected, repr(str(path)))
    return cameras_of(read_table(path), path.name)


def save_cameras(path: str | Path, cameras: Mapping[str, Camera]) -> None:
    """Write cameras into a TOML file that `load_cameras` reads back exactly.

    Parameters
    ----------
    path : str or Path
        Ends in ``.toml``; what is there is replaced.
    cameras : mapping of str to Camera
        At least one.

    Raises
    ------
    ArgumentError
        No camera, a name that is no text, a file that cannot be written.
    """
    path = _path(path)
    if path.suffix.lower() != ".toml":
        raise ArgumentError("path", "a file name that ends in .toml", repr(str(path)))
    if not isinstance(cameras, Mapping) or not cameras:
        raise ArgumentError("cameras", "at least one camera by name", _check.describe(cameras))
    tables = {}
    for name, camera in cameras.items():
        if not isinstance(name, str) or not name:
            raise ArgumentError("cameras", "names that are text", _check.describe(name))
        _check.instance(f"cameras[{name!r}]", camera, Camera)
        form = next(key for key in ("pinhole", "parallel") if type(camera) is FORMS[key])
        values = {f.name: getattr(camera, f.name) for f in dataclasses.fields(camera)}
        tables[name] = {"form": form, **values}
    text = tomlkit.dumps({"kind": KIND, "schema": SCHEMA, "cameras": tables})
    try:
        path.write_text(text, encoding="utf-8")
    except (OSError, UnicodeEncodeError) as error:
        raise ArgumentError("path", "a file that can be written", str(error)) from error


def cameras_of(table: Mapping[str, Any], source: str) -> dict[str, Camera]:
    """Return the cameras in a TOML table; `source` names it in messages.

    Raises
    ------
    ArgumentError, UnknownNameError
        As `load_cameras`.
    """
    if "mesh" not in table:  # else the definition of a scene, which is checked where it is read
        for key in table:
            if key not in ("kind", "schema", "cameras"):
                raise UnknownNameError(f"key of {source}", key, ("kind", "schema", "cameras"))
        for key, value in (("kind", KIND), ("schema", SCHEMA)):
            if table.get(key) != value or isinstance(table.get(key), bool):
                got = repr(table[key]) if key in table else "none"
                raise ArgumentError(f"{source}: {key}", repr(value), got)
    tables = table.get("cameras")
    if not isinstance(tables, Mapping) or not tables:
        got = "none" if not tables else repr(tables)
        raise ArgumentError(f"{source}: cameras", "tables [cameras.NAME]", got)
    return {name: camera_of(each, f"{source}: cameras.{name}") for name, each in tables.items()}


def camera_of(table: Any, place: str) -> Camera:
    """Return the camera of a TOML table; `place` names it in messages.

    Raises
    ------
    ArgumentError, UnknownNameError
        As `load_cameras`.
    """
    if not isinstance(table, Mapping):
        raise ArgumentError(place, "a table", _check.describe(table))
    values = dict(table)
    form = values.pop("form", "look_at")
    if not isinstance(form, str) or form not in FORMS:
        raise UnknownNameError(f"{place}.form", str(form), FORMS)
    known = inspect.signature(FORMS[form]).parameters
    for key in values:
        if key not in known:
            raise UnknownNameError(f"key of {place} (form {form!r})", key, (*known, "form"))
    for key, parameter in known.items():
        if key not in values and parameter.default is parameter.empty:
            raise ArgumentError(f"{place}.{key}", "a value", "none")
    try:
        return FORMS[form](**values)
    except ArgumentError as error:
        raise ArgumentError(f"{place}.{error.argument}", error.expected, error.got) from None


def _of_gltf(path: Path) -> dict[str, Camera]:
    found: dict[str, Camera] = {}
    for one in read_cameras(path):
        name, number = one.name, 2
        while name in found:  # nodes of one name are many in some files
            name, number = f"{one.name} {number}", number + 1
        try:
            found[name] = _of_file(one)
        except ArgumentError as error:
            place = f"{path.name}: camera {name!r}: {error.argument}"
            raise ArgumentError(place, error.expected, error.got) from None
    return found


def _of_file(camera: FileCamera) -> Camera:
    aspect = 16 / 9 if camera.aspect is None else camera.aspect
    places = camera.eye, camera.target, camera.up
    size = {"width": max(1, round(DEFAULT_HEIGHT * aspect)), "height": DEFAULT_HEIGHT}
    far = math.inf if camera.zfar is None else camera.zfar
    if camera.ymag is not None:
        shown = 2.0 * camera.ymag
        return Camera.orthographic(*places, view_height=shown, near=camera.znear, far=far, **size)
    vfov = math.degrees(camera.yfov or 0.0)
    view = Camera.look_at(*places, vfov_deg=vfov, near=camera.znear, **size)
    return dataclasses.replace(view, far=far)


def _path(path: Any) -> Path:
    if not isinstance(path, str | Path) or "\0" in str(path):
        raise ArgumentError("path", "the path of a file of cameras", _check.describe(path))
    return Path(path)


def read_table(path: Path) -> dict[str, Any]:
    """Return the table in a TOML file; errors as `load_cameras`."""
    try:
        if not path.is_file():
            raise ArgumentError("path", "an existing file of cameras", repr(str(path)))
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise ArgumentError(path.name, f"at most {MOST_BYTES} bytes", "more")
        return tomllib.loads(content.decode("utf-8"))
    except OSError as error:
        raise ArgumentError("path", "a file that can be read", str(error)) from error
    except (ValueError, RecursionError) as error:
        if isinstance(error, ArgumentError):
            raise
        said = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise ArgumentError(path.name, "a TOML document", said) from None
