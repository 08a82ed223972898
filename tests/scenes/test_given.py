"""Scenes of someone's own: the cameras of glTF files, definitions beside their meshes."""

import math

import pytest

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from support.gltf import Gltf

LENS = {"yfov": 0.8, "znear": 0.1, "aspectRatio": 1.5}


def model(tmp_path, *lenses, name="model.glb"):
    """Write a square with these perspective cameras two units before it, named "a door"."""
    g = Gltf()
    g.node(mesh=g.mesh())
    for lens in lenses:
        g.add("cameras", type="perspective", perspective=lens)
        g.node(camera=len(g.tree["cameras"]) - 1, translation=[0.5, 0.5, 2], name="a door")
    return g.write(tmp_path / name)


def test_a_gltf_files_own_cameras_are_its_views(tmp_path):
    spec = hrs.scene_from_path(model(tmp_path, LENS, {**LENS, "yfov": 0.5}))
    assert list(spec.cameras) == ["a_door", "a_door_2"]
    assert "those of the file" in spec.description
    view = spec.cameras["a_door"]
    assert view.eye == (0.5, 0.5, 2)
    assert view.target == (0.5, 0.5, 1)
    camera = spec.camera("a_door", 300, 200)
    own = hrt.load_cameras(tmp_path / "model.glb")["a door"]
    assert camera == own.resized(300, 200)
    assert camera.vfov_deg == math.degrees(0.8)
    assert (hrt.rasterize(spec.load(), camera).prim_id >= 0).any()


def test_an_orthographic_camera_with_its_near_plane_behind_the_eye():
    camera = hrt.Camera.orthographic((0, 0, 1), (0, 0, 0), view_height=2, near=-3, far=4)
    view = hrs.GivenCamera.of(camera)
    assert view.sized(30, 20) == camera.resized(30, 20)


def test_without_cameras_they_are_automatic(tmp_path):
    spec = hrs.scene_from_path(model(tmp_path))
    assert "front" in spec.cameras
    assert "placed automatically" in spec.description


def test_cameras_that_cannot_be_used_are_said_and_replaced(tmp_path):
    path = model(tmp_path, {**LENS, "znear": 0})
    with pytest.warns(UserWarning, match=r"placed automatically: .*cameras\[0\]\.perspective"):
        spec = hrs.scene_from_path(path)
    assert "front" in spec.cameras


def test_a_definition_finds_its_mesh_beside_itself(tmp_path, monkeypatch):
    model(tmp_path)
    path = tmp_path / "hall.toml"
    path.write_text(
        '[[mesh]]\nfile = "model.glb"\n[cameras.a]\neye = [0, 0, 5]\ntarget = [0, 0, 0]'
    )
    monkeypatch.chdir("/")
    spec = hrs.scene_from_path(path)
    assert (spec.name, spec.title) == ("hall", "hall")
    assert spec.missing() is None
    assert len(spec.load()) == 2
    assert list(spec.cameras) == ["a"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[mesh]]\nfile = 'model.glb'", "hall.toml: cameras: expected a value"),
        ("[cameras.a]\neye = [0, 0, 5]\ntarget = [0, 0, 0]", "hall.toml: mesh: expected a value"),
        ("mesh = 3", "hall.toml: mesh"),
        ("mesh", "hall.toml: expected a TOML file"),
    ],
)
def test_a_definition_that_is_none_is_refused_by_its_key(tmp_path, text, said):
    (tmp_path / "hall.toml").write_text(text)
    with pytest.raises(hrt.ArgumentError, match=said):
        hrs.scene_from_path(tmp_path / "hall.toml")
