"""Scenes by name: real ones from files, and places generated from code."""

from hybrid_rt_scenes.registry import (
    automatic_cameras,
    get_scene,
    read_definition,
    scene_from_path,
    scene_names,
)
from hybrid_rt_scenes.spec import (
    CameraSpec,
    MeshSpec,
    MissingDataError,
    SceneSpec,
    data_directory,
)

__all__ = [
    "CameraSpec",
    "MeshSpec",
    "MissingDataError",
    "SceneSpec",
    "automatic_cameras",
    "data_directory",
    "get_scene",
    "read_definition",
    "scene_from_path",
    "scene_names",
]
