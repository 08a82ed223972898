"""Sets of cameras: what is written comes back exactly, what is wrong is named with its key."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybrid_rt as hrt
from support import ROOT
from support.gltf import Gltf

HEAD = 'kind = "cameras"\nschema = 1\n'


def written(tmp_path, text, name="views.toml"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def several():
    """Return a camera of every kind, with numbers that no decimal writes in a few digits."""
    K = [[1100.1, 0, 655.3], [0, 1098.7, 371.9], [0, 0, 1]]
    angle = 0.3
    R = np.array([[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, 1]])
    R[2, 2] = math.cos(angle)
    projection = np.array([[1.5, 0, 0.1, 0], [0, 2, 0, 0], [0, 0, 0, 0.1], [0, 0, -1, 0]])
    return {
        "nave": hrt.Camera.look_at((-10, 1.5, 0.1), (5, 3, 0), vfov_deg=61.7, near=0.03),
        "a name, with \"signs\" and ünïcode": hrt.Camera.look_at((0, 0, 1), (0, 1, 0)),
        "plan": hrt.Camera.orthographic(
            (0, 20, 0), (0, 0, 0), (0, 0, -1), view_height=12.3, near=-1.5, far=20.7
        ),
        "calibrated": hrt.Camera.from_intrinsics(K, R, [0.1, 0, 2], width=1280, height=720),
        "engine": hrt.Camera.from_matrices(
            np.eye(4), projection, width=640, height=480, convention="d3d"
        ),
    }  # fmt: skip


def test_what_is_saved_is_loaded_exactly(tmp_path):
    path = tmp_path / "views.toml"
    hrt.save_cameras(path, several())
    found = hrt.load_cameras(path)
    assert list(found) == list(several())
    assert found == several()
    assert found["plan"].far == 20.7
    assert found["calibrated"].shift_px != (0.0, 0.0)


@given(
    st.tuples(*[st.floats(-1e6, 1e6)] * 3), st.floats(1.0, 170.0), st.floats(1e-6, 1e6),
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1),
)  # fmt: skip
def test_any_pinhole_under_any_name_comes_back(tmp_path_factory, eye, vfov, near, name):
    path = tmp_path_factory.mktemp("cameras") / "views.toml"
    target = (eye[0] + 1, eye[1] + 2, eye[2] - 3)
    camera = hrt.Camera.look_at(eye, target, vfov_deg=vfov, near=near, width=7, height=5)
    hrt.save_cameras(path, {name: camera})
    assert hrt.load_cameras(path) == {name: camera}


def test_forms_are_the_methods_of_the_camera(tmp_path):
    path = written(
        tmp_path,
        HEAD
        + """
[cameras.nave]
eye = [-10, 1.5, 0]
target = [5, 3, 0]

[cameras.plan]
form = "orthographic"
eye = [0, 20, 0]
target = [0, 0, 0]
up = [0, 0, -1]
view_height = 12
far = 20

[cameras.engine]
form = "matrices"
view = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -4], [0, 0, 0, 1]]
projection = [[1.5, 0, 0, 0], [0, 2, 0, 0], [0, 0, 0, 0.1], [0, 0, -1, 0]]
convention = "d3d"
width = 640
height = 480

[cameras.calibrated]
form = "intrinsics"
K = [[1100.0, 0.0, 655.5], [0.0, 1098.0, 371.0], [0.0, 0.0, 1.0]]
R = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
t = [0.1, 0.0, 2.0]
width = 1280
height = 720
""",
    )
    found = hrt.load_cameras(path)
    projection = [[1.5, 0, 0, 0], [0, 2, 0, 0], [0, 0, 0, 0.1], [0, 0, -1, 0]]
    view = np.eye(4)
    view[2, 3] = -4
    assert found == {
        "nave": hrt.Camera.look_at((-10, 1.5, 0), (5, 3, 0)),
        "plan": hrt.Camera.orthographic(
            (0, 20, 0), (0, 0, 0), (0, 0, -1), view_height=12, far=20
        ),
        "engine": hrt.Camera.from_matrices(
            view, projection, width=640, height=480, convention="d3d"
        ),
        "calibrated": hrt.Camera.from_intrinsics(
            [[1100, 0, 655.5], [0, 1098, 371], [0, 0, 1]], np.eye(3), [0.1, 0, 2],
            width=1280, height=720,
        ),
    }  # fmt: skip


def test_the_cameras_of_a_scenes_definition(tmp_path):
    text = """
title = "Hall"
[[mesh]]
file = "hall.obj"
[cameras.door]
eye = [0, 1, 5]
target = [0, 1, 0]
near = 0.1
"""
    found = hrt.load_cameras(written(tmp_path, text))
    assert found == {"door": hrt.Camera.look_at((0, 1, 5), (0, 1, 0), near=0.1)}


def test_the_cameras_of_a_gltf_file(tmp_path):
    g = Gltf()
    g.add("cameras", type="perspective", perspective={"yfov": 0.8, "znear": 0.1, "zfar": 50.0})
    g.add(
        "cameras", type="perspective",
        perspective={"yfov": 1.0, "znear": 0.2, "aspectRatio": 1.5},
    )  # fmt: skip
    g.add(
        "cameras",
        type="orthographic",
        orthographic={"xmag": 4, "ymag": 2, "znear": 0.5, "zfar": 9},
    )
    g.node(camera=0, translation=[1, 2, 3], name="a")
    g.node(camera=1, translation=[1, 2, 3], name="a")
    g.node(camera=2, translation=[0, 0, 5])
    found = hrt.load_cameras(g.write(tmp_path / "m.glb"))
    assert list(found) == ["a", "a 2", "camera 2"]
    first, second, third = found.values()
    assert (first.width, first.height, first.near, first.far) == (1920, 1080, 0.1, 50.0)
    assert first.vfov_deg == pytest.approx(math.degrees(0.8))
    assert first.eye == (1, 2, 3)
    assert (second.width, second.height, second.far) == (1620, 1080, math.inf)
    assert isinstance(third, hrt.Orthographic)
    assert (third.view_height, third.near, third.far) == (4.0, 0.5, 9.0)
    assert (third.width, third.height) == (2160, 1080)


def test_a_gltf_file_without_cameras(tmp_path):
    g = Gltf()
    g.node()
    assert hrt.load_cameras(g.write(tmp_path / "m.gltf")) == {}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kind = [", "views.toml: expected a TOML document"),
        ("", "views.toml: kind: expected 'cameras', got none"),
        ('kind = "paper"', "views.toml: kind: expected 'cameras', got 'paper'"),
        ('kind = "cameras"', "views.toml: schema: expected 1, got none"),
        ('kind = "cameras"\nschema = 2', "views.toml: schema: expected 1, got 2"),
        ('kind = "cameras"\nschema = true', "views.toml: schema: expected 1, got True"),
        (HEAD, r"views.toml: cameras: expected tables \[cameras.NAME\], got none"),
        (HEAD + "cameras = 3", "views.toml: cameras: expected tables"),
        (HEAD + "camera = 3", "unknown key of views.toml 'camera'; did you mean 'cameras'"),
        (HEAD + "[cameras]\nnave = 3", "views.toml: cameras.nave: expected a table"),
        (HEAD + "[cameras.a]\ntarget = [0, 0, 0]", "views.toml: cameras.a.eye: expected a value"),
        (HEAD + '[cameras.a]\nform = "lookat"', "unknown views.toml: cameras.a.form 'lookat'; did"),
        (HEAD + "[cameras.a]\nform = 3", "unknown views.toml: cameras.a.form '3'"),
        (
            HEAD + "[cameras.a]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\nvfov = 3",
            r"unknown key of views.toml: cameras.a \(form 'look_at'\) 'vfov'; did you mean 'vfov",
        ),
        (
            HEAD + "[cameras.a]\neye = [0, 0]\ntarget = [0, 0, 0]",
            "views.toml: cameras.a.eye: expected three finite numbers",
        ),
        (
            HEAD + "[cameras.a]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\nvfov_deg = 180",
            "views.toml: cameras.a.vfov_deg: expected a finite number",
        ),
        (
            HEAD + '[cameras.a]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\nwidth = "wide"',
            "views.toml: cameras.a.width: expected an integer",
        ),
        (
            HEAD + '[cameras.a]\nform = "matrices"\nview = [[1]]\nprojection = 3\nwidth = 1\n'
            "height = 1",
            "views.toml: cameras.a.view: expected",
        ),
    ],
)
def test_what_is_wrong_is_named_with_file_and_key(tmp_path, text, said):
    with pytest.raises((hrt.ArgumentError, hrt.UnknownNameError), match=said):
        hrt.load_cameras(written(tmp_path, text))


def test_files_that_are_none(tmp_path):
    for path, said in (
        (tmp_path / "no.toml", "an existing file of cameras"),
        (tmp_path, "a file that ends in .toml"),
        (written(tmp_path, "x", "m.obj"), r"a file that ends in \.toml, \.gltf or \.glb"),
        (None, "the path of a file"),
        ("a\0.toml", "the path of a file"),
    ):
        with pytest.raises(hrt.ArgumentError, match=said):
            hrt.load_cameras(path)
    (tmp_path / "latin.toml").write_bytes(b'kind = "\xe9"')
    with pytest.raises(hrt.ArgumentError, match=r"latin\.toml: expected a TOML document"):
        hrt.load_cameras(tmp_path / "latin.toml")
    with pytest.raises(hrt.MeshFileError, match="no such file"):
        hrt.load_cameras(tmp_path / "no.glb")


def test_what_cannot_be_saved(tmp_path):
    camera = hrt.Camera.look_at((0, 0, 1), (0, 0, 0))
    path = tmp_path / "views.toml"
    for cameras, said in (
        ({}, "at least one camera"),
        ([camera], "at least one camera"),
        ({"": camera}, "names that are text"),
        ({3: camera}, "names that are text"),
        ({"a": "camera"}, r"cameras\['a'\]: expected a Camera"),
    ):
        with pytest.raises(hrt.ArgumentError, match=said):
            hrt.save_cameras(path, cameras)
        assert not path.exists()
    with pytest.raises(hrt.ArgumentError, match=r"ends in \.toml"):
        hrt.save_cameras(tmp_path / "views.json", {"a": camera})
    with pytest.raises(hrt.ArgumentError, match="a file that can be written"):
        hrt.save_cameras(tmp_path / "no" / "views.toml", {"a": camera})


def test_the_documented_file_is_one(tmp_path):
    page = (ROOT / "docs" / "frames.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    found = hrt.load_cameras(written(tmp_path, example))
    assert [type(camera) for camera in found.values()] == [
        hrt.Pinhole, hrt.Orthographic, hrt.Pinhole
    ]  # fmt: skip
