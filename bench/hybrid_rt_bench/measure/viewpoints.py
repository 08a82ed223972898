"""Cameras that the command line names by a file: ``FILE`` or ``FILE:NAME``."""

from __future__ import annotations

from pathlib import Path

import hybrid_rt as hrt
from hybrid_rt.errors import ArgumentError, UnknownNameError

SUFFIXES = (".toml", ".glb", ".gltf")


def is_file(text: str) -> bool:
    """Return whether a text names a file of cameras, and not a camera of a scene."""
    return _split(text)[0].suffix.lower() in SUFFIXES


def cameras_in(option: str, text: str) -> dict[str, hrt.Camera]:
    """Return the cameras of ``FILE``, or the one of ``FILE:NAME``, by their names.

    Raises
    ------
    ArgumentError, UnknownNameError, MeshFileError
        As `hybrid_rt.load_cameras`; a file without cameras, or without the one of that name.
    """
    path, name = _split(text)
    found = hrt.load_cameras(path)
    if not found:
        raise ArgumentError(option, "a file with a camera", f"{path}, which has none")
    if name is None:
        return found
    if name not in found:
        raise UnknownNameError(f"camera of {path.name}", name, found)
    return {name: found[name]}


def camera_in(option: str, text: str) -> hrt.Camera:
    """Return the camera of ``FILE:NAME``, or the first of ``FILE``; errors as `cameras_in`."""
    return next(iter(cameras_in(option, text).values()))


def _split(text: str) -> tuple[Path, str | None]:
    """Return the path of a file and the name of a camera in it."""
    if Path(text).suffix.lower() in SUFFIXES:
        return Path(text), None
    path, colon, name = text.rpartition(":")
    return (Path(path), name) if colon else (Path(text), None)
