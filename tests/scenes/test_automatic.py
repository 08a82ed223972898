"""Automatic cameras frame what there is, and never stand inside closed geometry."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_scenes import automatic_cameras, get_scene
from hybrid_rt_scenes.automatic import COVERED, coverage, inside, winding_number
from hybrid_rt_scenes.primitives import boxes, join, quad
from hybrid_rt_scenes.simple import geodesic
from support import DATA


def scene_of(part):
    return hrt.Scene.from_arrays(part.vertices, part.faces)


def ball(radius=1.0, at=(0, 0, 0)):
    return moved(geodesic(6, 1.0), radius, at)


def moved(part, scale, shift):
    return type(part)(part.vertices * scale + np.asarray(shift, float), part.faces)


def terrain():
    x, z = np.meshgrid(np.linspace(-5, 5, 30), np.linspace(-5, 5, 30))
    y = 0.4 * np.sin(x) * np.cos(z)
    at = np.arange(900).reshape(30, 30)
    a, b, c, d = (at[i : i + 29, j : j + 29].ravel() for i, j in ((0, 0), (0, 1), (1, 1), (1, 0)))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return hrt.Scene.from_arrays(np.stack([x, y, z], 2).reshape(-1, 3), faces)


MESHES = {
    "ball": lambda: scene_of(ball()),
    "far ball": lambda: scene_of(ball(1e-1, (1e4, 0, 0))),
    "two balls": lambda: scene_of(join([ball(1, (-9, 0, 0)), ball(1, (9, 0, 0))])),
    "shell": lambda: scene_of(join([ball(), ball(0.9)])),
    "box": lambda: scene_of(boxes([[0, 0, 0]], [[1, 2, 3]])),
    "stick": lambda: scene_of(boxes([[0, 0, 0]], [[0.01, 10, 0.01]])),
    "plate": lambda: scene_of(quad([-3, 0, -3], [6, 0, 0], [0, 0, 6])),
    "triangle": lambda: hrt.Scene.from_arrays(np.eye(3), [[0, 1, 2]]),
    "terrain": terrain,
    "cornell": lambda: get_scene("cornell").load(),
    "atrium": lambda: get_scene("atrium").load(2**15),
    "bunny": lambda: hrt.load_scene(DATA / "stanford_bunny.npz"),
    "suzanne": lambda: hrt.load_scene(DATA / "suzanne.npz"),
}
REAL = {"bunny": "stanford_bunny.npz", "suzanne": "suzanne.npz"}


@pytest.mark.parametrize("name", list(MESHES))
def test_half_of_each_picture_is_covered_and_no_eye_is_inside(name):
    if name in REAL and not (DATA / REAL[name]).is_file():
        pytest.skip(f"{REAL[name]} is not there")
    scene = MESHES[name]()
    views = automatic_cameras(scene)
    assert len(views) >= 2
    for view in views.values():
        assert coverage(scene, view) >= COVERED
        assert not inside(scene, view.eye)
        larger = hrt.rasterize(scene, view.sized(320, 180))
        assert (larger.prim_id >= 0).mean() > 0.9 * COVERED


def test_the_winding_number_counts_shells():
    scene = MESHES["shell"]()
    assert winding_number(scene, (0, 0, 0)) == pytest.approx(2, abs=1e-9)
    assert winding_number(scene, (0.94, 0, 0)) == pytest.approx(1, abs=1e-6)
    assert winding_number(scene, (3, 1, 2)) == pytest.approx(0, abs=1e-9)
    half = hrt.Scene.from_arrays(scene.vertices, scene.faces[: len(scene) // 2][:, ::-1])
    assert winding_number(half, (0, 0, 0)) == pytest.approx(-1, abs=1e-9)


def test_rooms_that_are_open_are_looked_at_from_their_centre():
    assert {"inside_x", "inside_z"} <= set(automatic_cameras(MESHES["atrium"]()))
    assert "inside_x" not in automatic_cameras(MESHES["ball"]())


def test_a_single_point_cannot_be_looked_at():
    with pytest.raises(hrt.ArgumentError, match=r"^scene: expected triangles that span"):
        automatic_cameras(hrt.Scene.from_arrays(np.zeros((3, 3)), [[0, 1, 2]]))
