"""Meshes of someone's own become scenes: turned, scaled, with cameras that look at them."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest
import trimesh

import hybrid_rt as hrt
from hybrid_rt_scenes import import_scene, read_definition
from support.gltf import Gltf


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """A ball off the origin, 2 wide, as an .obj."""
    path = tmp_path_factory.mktemp("meshes") / "A Ball.obj"
    mesh = trimesh.creation.icosphere(subdivisions=2)
    mesh.apply_translation((1, 2, 3))
    mesh.export(path)
    return path


def test_a_name_is_made_of_the_files(ball):
    made = import_scene(ball)
    assert made.spec.name == "a_ball"
    assert made.file == "a_ball.npz"
    assert made.cameras_from == "automatic"
    assert not made.known
    assert min(made.covered().values()) >= 0.5
    assert (made.mesh.vertices == hrt.read_mesh(ball).vertices).all()


def test_z_goes_up_without_mirroring_and_scale_follows(ball):
    made = import_scene(ball, up="z", scale=0.01)
    low, high = hrt.Scene.from_meshes([made.mesh]).bounds
    assert (low + high) / 2 == pytest.approx([0.01, 0.03, -0.02], abs=1e-4)
    volume = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False).volume
    assert volume == pytest.approx(4 / 3 * math.pi * 1e-6, rel=0.1)  # positive: not mirrored


def test_cameras_of_a_gltf_go_with_the_mesh(tmp_path):
    g = Gltf()
    lens = {"yfov": 0.8, "znear": 0.1}
    g.node(mesh=g.mesh())
    for place in ([0.5, 0.5, 2], [0.5, 0.5, 3]):  # both in front of the unit square at z = 0
        g.node(camera=g.add("cameras", type="perspective", perspective=lens),
               translation=place, name="Camera 001")  # fmt: skip
    made = import_scene(g.write(tmp_path / "m.glb"), up="z", scale=10)
    assert made.cameras_from == "file"
    assert list(made.spec.cameras) == ["Camera_001", "Camera_001_2"]
    view = made.spec.cameras["Camera_001"]
    assert view.eye == pytest.approx((5, 20, -5))
    assert view.target == pytest.approx((5, 10, -5))
    assert view.up == pytest.approx((0, 0, -1))
    assert view.vfov_deg == pytest.approx(math.degrees(0.8))
    assert view.near == pytest.approx(1)
    assert min(made.covered().values()) > 0.09  # they still see what they saw


def test_orthographic_cameras_are_left_out_with_a_word(tmp_path):
    g = Gltf()
    g.node(mesh=g.mesh())
    plan = {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}
    g.node(camera=g.add("cameras", type="orthographic", orthographic=plan), name="plan")
    with pytest.warns(UserWarning, match="'plan' is left out"):
        made = import_scene(g.write(tmp_path / "m.glb"))
    assert made.cameras_from == "automatic"


def test_the_definition_reads_back_the_same(ball, tmp_path):
    made = import_scene(ball, name="ball-2")
    path = tmp_path / "ball-2.toml"
    path.write_text(made.definition)
    again = read_definition(path)
    assert again == made.spec
    assert tomllib.loads(made.definition)["mesh"] == [{"file": "ball-2.npz"}]


def test_a_real_scene_keeps_its_definition(ball):
    made = import_scene(ball, name="bistro")
    assert (made.known, made.definition, made.file) == (True, None, "bistro_exterior.npz")
    assert "front" not in made.spec.cameras


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"name": "sphere"}, "made from code"),
        ({"name": "Two Words"}, "lower-case"),
        ({"name": ""}, "lower-case"),
        ({"name": "../up"}, "lower-case"),
        ({"scale": 0.0}, "scale"),
        ({"scale": float("nan")}, "scale"),
        ({"scale": 1e39}, "float32"),
        ({"up": "x"}, "up"),
    ],
)
def test_what_cannot_be_is_refused(ball, words, said):
    with pytest.raises(hrt.ArgumentError, match=said):
        import_scene(ball, **words)


def test_a_file_whose_name_gives_none(tmp_path):
    path = tmp_path / "12.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(hrt.ArgumentError, match="name"):
        import_scene(path)
    assert import_scene(path, name="twelve").spec.name == "twelve"
    assert np.isfinite(import_scene(path, name="twelve").spec.cameras["front"].eye).all()
