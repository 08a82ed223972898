"""The cameras of glTF files stand where their nodes do."""

import math

import pytest

import hybrid_rt as hrt
from hybrid_rt.scene.io import read_cameras
from support.gltf import Gltf

LENS = {"yfov": 0.8, "znear": 0.1}


def test_cameras_of_the_default_scene_in_the_order_of_its_nodes(tmp_path):
    g = Gltf()
    g.add("cameras", type="perspective", name="lens", perspective=LENS)
    g.add("cameras", type="perspective", perspective={**LENS, "aspectRatio": 1.5, "zfar": 100})
    g.add(
        "cameras", type="orthographic", orthographic={"xmag": 1.5, "ymag": 3, "znear": 0, "zfar": 9}
    )
    half = math.sqrt(0.5)
    below = g.node(False, camera=1, translation=[0, 0, 5], name="below")
    g.node(rotation=[0, half, 0, half], scale=[3, 3, 3], children=[below])
    g.node(camera=0, translation=[1, 2, 3])
    g.node(camera=2)
    g.node(False, camera=0)
    first, second, third = read_cameras(g.write(tmp_path / "m.glb"))
    assert first.name == "below"
    assert first.eye == pytest.approx((15, 0, 0))
    assert first.target == pytest.approx((14, 0, 0))
    assert first.up == pytest.approx((0, 1, 0))
    assert (first.yfov, first.aspect, first.znear, first.zfar) == (0.8, 1.5, 0.1, 100)
    assert second.name == "lens"
    assert second.eye == (1, 2, 3)
    assert second.target == pytest.approx((1, 2, 2))
    assert second.up == (0, 1, 0)
    assert (second.aspect, second.zfar) == (None, None)
    assert (third.yfov, third.ymag, third.aspect, third.znear, third.zfar) == (None, 3, 0.5, 0, 9)


def test_files_without_cameras(tmp_path):
    g = Gltf()
    g.node()
    assert read_cameras(g.write(tmp_path / "m.gltf")) == []
    (tmp_path / "m.obj").write_text("")
    with pytest.raises(hrt.MeshFileError, match="unknown glTF format"):
        read_cameras(tmp_path / "m.obj")
    with pytest.raises(hrt.ArgumentError, match="path"):
        read_cameras(None)


@pytest.mark.parametrize(
    "lens", [{"yfov": 0, "znear": 1}, {"yfov": 4, "znear": 1}, {"yfov": 1, "znear": 0},
             {"yfov": 1, "znear": 2, "zfar": 1}, {"yfov": 1},
             {"yfov": 1, "znear": 1, "aspectRatio": 0}]
)  # fmt: skip
def test_lenses_that_make_no_sense(tmp_path, lens):
    g = Gltf()
    g.add("cameras", type="perspective", perspective=lens)
    g.node(camera=0)
    with pytest.raises(hrt.MeshFileError, match=r"m\.glb: cameras\[0\]\.perspective: "):
        read_cameras(g.write(tmp_path / "m.glb"))


@pytest.mark.parametrize(
    "lens", [{"xmag": 0, "ymag": 1, "znear": 0, "zfar": 1}, {"xmag": 1, "ymag": 1, "znear": 0},
             {"xmag": 1, "ymag": 1, "znear": 2, "zfar": 1}]
)  # fmt: skip
def test_orthographic_lenses_that_make_no_sense(tmp_path, lens):
    g = Gltf()
    g.add("cameras", type="orthographic", orthographic=lens)
    g.node(camera=0)
    with pytest.raises(hrt.MeshFileError, match=r"m\.glb: cameras\[0\]\.orthographic: "):
        read_cameras(g.write(tmp_path / "m.glb"))


def test_a_lens_of_no_known_type(tmp_path):
    g = Gltf()
    g.add("cameras", type="fisheye", perspective=LENS)
    g.node(camera=0)
    with pytest.raises(hrt.MeshFileError, match=r"m\.glb: cameras\[0\]\.type: expected 'pers"):
        read_cameras(g.write(tmp_path / "m.glb"))


def test_a_camera_without_a_direction(tmp_path):
    g = Gltf()
    g.add("cameras", type="perspective", perspective=LENS)
    g.node(camera=0, scale=[1, 1, 0])
    with pytest.raises(hrt.MeshFileError, match=r"nodes\[0\]: its transform leaves a camera no"):
        read_cameras(g.write(tmp_path / "m.glb"))
