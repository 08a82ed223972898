"""Scenes by name: real ones from files, and places generated from code."""

from hybrid_rt_scenes.automatic import automatic_cameras
from hybrid_rt_scenes.given import GivenCamera, given_cameras
from hybrid_rt_scenes.importing import ImportedScene, import_scene
from hybrid_rt_scenes.places import data_directories, data_directory
from hybrid_rt_scenes.registry import (
    SCENES,
    all_scenes,
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
)

__all__ = [
    "SCENES",
    "CameraSpec",
    "GivenCamera",
    "ImportedScene",
    "LightsSpec",
    "MeshSpec",
    "MissingDataError",
    "SceneSpec",
    "all_scenes",
    "automatic_cameras",
    "automatic_lights",
    "data_directories",
    "data_directory",
    "get_scene",
    "given_cameras",
    "import_scene",
    "read_definition",
    "register",
    "scene_from_path",
    "scene_names",
]
