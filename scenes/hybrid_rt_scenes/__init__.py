"""Scenes by name: real ones from files, and places generated from code."""

from hybrid_rt_scenes.automatic import automatic_cameras
from hybrid_rt_scenes.given import GivenCamera, given_cameras
from hybrid_rt_scenes.registry import (
    SCENES,
    get_scene,
    read_definition,
    register,
    scene_from_path,
    scene_names,
)
from hybrid_rt_scenes.spec import (
    CameraSpec,
    LightsSpec,
    MeshSpec,
    MissingDataError,
    SceneSpec,
    automatic_lights,
    data_directory,
)

__all__ = [
    "SCENES",
    "CameraSpec",
    "GivenCamera",
    "LightsSpec",
    "MeshSpec",
    "MissingDataError",
    "SceneSpec",
    "automatic_cameras",
    "automatic_lights",
    "data_directory",
    "get_scene",
    "given_cameras",
    "read_definition",
    "register",
    "scene_from_path",
    "scene_names",
]
