"""Scene definitions, the places generated from code, and what is said of what is missing."""

from __future__ import annotations

import hashlib
import shutil

import numpy as np
import platformdirs
import pytest
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

import hybrid_rt as hrt
from hybrid_rt_scenes import (
    MissingDataError,
    SceneSpec,
    data_directories,
    data_directory,
    get_scene,
    read_definition,
    scene_from_path,
    scene_names,
)
from hybrid_rt_scenes import spec as spec_module
from hybrid_rt_scenes.atrium import atrium
from hybrid_rt_scenes.primitives import lathe, place, quad, tubes
from hybrid_rt_scenes.simple import geodesic
from hybrid_rt_scenes.street import street
from support import ROOT

BUILT_IN = ("atrium", "cornell", "sphere", "street")
REAL = ("bistro", "conference", "kitchen", "nori_sphere", "sponza")
SMALL = {"atrium": 2**16, "street": 2**17}


@pytest.fixture(scope="module")
def small() -> dict[str, hrt.Scene]:
    return {name: get_scene(name).load(size=SMALL.get(name)) for name in BUILT_IN}


def first_hits(scene: hrt.Scene, camera: hrt.Camera) -> np.ndarray:
    """Return the distances of the primary rays, infinite where there is nothing."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    across = ((x - camera.width / 2) / camera.focal_px).ravel()[:, None]
    down = ((camera.height / 2 - y) / camera.focal_px).ravel()[:, None]
    rays = np.array(camera.forward) + across * camera.right + down * np.array(camera.up)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    embree = EmbreeScene()
    TriangleMesh(embree, scene.vertices, scene.faces)
    eyes = np.tile(np.array(camera.eye, np.float32), (len(rays), 1))
    found = embree.run(eyes, rays.astype(np.float32), output=True)
    return np.where(found["primID"] >= 0, found["tfar"], np.inf)


def digest(mesh: hrt.Mesh) -> str:
    data = mesh.vertices.tobytes() + mesh.faces.tobytes() + mesh.object_id.tobytes()
    return hashlib.sha256(data).hexdigest()


def test_all_scenes_are_there():
    assert scene_names() == sorted(BUILT_IN + REAL)


@pytest.mark.parametrize("name", scene_names())
def test_every_definition_reads_and_its_cameras_are_valid(name):
    spec = get_scene(name)
    assert spec.name == name
    assert spec.title
    assert spec.description
    assert spec.builtin == (name in BUILT_IN)
    assert bool(spec.needs) == (name in REAL)
    assert len(spec.cameras) >= 4
    for camera in spec.cameras:
        made = spec.camera(camera, 160, 90)
        assert (made.width, made.height) == (160, 90)
        assert made.near == spec.cameras[camera].near


@pytest.mark.parametrize("name", BUILT_IN)
def test_no_camera_stands_in_geometry_or_before_a_blank_wall(small, name):
    spec, scene = get_scene(name), small[name]
    size = np.linalg.norm(np.diff(scene.bounds, axis=0))
    for camera in spec.cameras:
        view = spec.camera(camera, 96, 54)
        t = first_hits(scene, view)
        hit = np.isfinite(t)
        assert hit.mean() > 0.5, camera
        assert np.median(t[hit]) > 0.04 * size, camera
        # the near plane cuts nothing that is visible
        assert t.min() > 1.5 * view.near, camera
        # depths of many kinds: not one wall
        assert np.percentile(t[hit], 90) > 1.3 * np.percentile(t[hit], 10), camera


@pytest.mark.parametrize("name", ["atrium", "street"])
def test_surfaces_do_not_lie_on_top_of_each_other(small, name):
    """Two in one plane, which no place has, would make the first hit a toss-up."""
    scene, spec = small[name], get_scene(name)
    half = np.random.default_rng(0).random(len(scene)) < 0.5
    parts = [hrt.Scene.from_arrays(scene.vertices, scene.faces[h]) for h in (half, ~half)]
    for camera in spec.cameras:
        one, other = (first_hits(part, spec.camera(camera, 200, 120)) for part in parts)
        both = np.isfinite(one) & np.isfinite(other)
        one, other = one[both], other[both]
        assert (np.abs(one - other) <= 2e-6 * one).mean() < 0.005, camera


@pytest.mark.parametrize("make", [street, atrium])
@pytest.mark.parametrize("size", [2**15, 40001, 2**16])
def test_generated_places_have_exactly_the_size_asked_for_and_no_flat_triangle(make, size):
    mesh = make(size)
    scene = hrt.Scene.from_meshes([mesh])
    assert len(scene) == size
    assert scene.zero_area == 0
    assert len(np.unique(mesh.object_id)) > 20


@pytest.mark.parametrize("size", [1024, 1025, 1777, 4096])
def test_a_street_may_be_tiny(size):
    assert len(street(size).faces) == size


def test_more_triangles_are_more_detail_and_not_a_larger_place(small):
    coarse = hrt.Scene.from_meshes([street(2**12)])
    fine = small["street"]
    np.testing.assert_allclose(coarse.bounds[:, [0, 2]], fine.bounds[:, [0, 2]], atol=0.5)

    # cutting flat walls into more triangles would leave the area as it is
    def area(scene: hrt.Scene) -> float:
        a, b, c = (scene.vertices[scene.faces[:, k]].astype(np.float64) for k in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    assert area(fine) > 1.2 * area(coarse)


@pytest.mark.parametrize("make", [street, atrium])
def test_the_same_seed_gives_the_same_bits_and_another_seed_does_not(make):
    assert digest(make(2**15, seed=5)) == digest(make(2**15, seed=5))
    assert digest(make(2**15, seed=5)) != digest(make(2**15, seed=6))


def test_the_fixed_scenes_have_the_triangles_that_they_say(small):
    assert len(small["cornell"]) == 36
    assert 1000 <= len(small["sphere"]) <= 1100
    assert all(str(n) in get_scene(s).description for s, n in (("cornell", 36), ("sphere", 980)))


def test_a_size_out_of_range_or_for_a_fixed_scene_is_refused():
    with pytest.raises(
        hrt.ArgumentError, match=r"size: expected an integer >= 1024 and <= 8388608.*1023"
    ):
        get_scene("street").load(size=1023)
    with pytest.raises(hrt.ArgumentError, match=r"size: expected None.*'cornell'"):
        get_scene("cornell").load(size=5000)
    with pytest.raises(hrt.ArgumentError, match="size: expected an integer"):
        atrium(1e5)  # type: ignore[arg-type]
    with pytest.raises(hrt.ArgumentError, match="seed"):
        street(2**12, seed=-1)


def test_a_geodesic_sphere_is_closed_and_round():
    for frequency in (1, 2, 7):
        part = geodesic(frequency, 2.0)
        assert part.triangles == 20 * frequency**2
        mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
        assert mesh.is_watertight
        assert mesh.volume > 0
        np.testing.assert_allclose(np.linalg.norm(part.vertices, axis=1), 2.0)


def test_primitives_have_the_triangles_that_they_promise():
    assert quad([0, 0, 0], [1, 0, 0], [0, 1, 0], (3, 4)).triangles == 24
    assert lathe([[0, 0], [1, 0], [1, 1], [0, 1]], 8).triangles == 8 + 16 + 8
    line = np.array([[[0.0, 0, 0], [0, 1, 0], [0, 2, 0.5]]])
    tube = tubes(line, 0.1, 5)
    assert tube.triangles == 2 * 5 * 2
    away = np.linalg.norm(tube.vertices[:, [0, 2]], axis=1)
    assert away[:6] == pytest.approx(0.1)


def test_place_turns_z_towards_x_and_moves_last():
    part = quad([0, 0, 0], [0, 0, 1], [0, 1, 0])
    turned = place(part, [[5, 0, 0], [0, 0, 7]], [np.pi / 2, 0.0], [[1, 1, 2], [1, 1, 1]])
    np.testing.assert_allclose(turned.vertices[1], [7, 0, 0], atol=1e-12)
    np.testing.assert_allclose(turned.vertices[5], [0, 0, 8], atol=1e-12)
    assert turned.triangles == 4


def test_unknown_names_come_with_a_suggestion():
    with pytest.raises(hrt.UnknownNameError, match="unknown scene 'sponsa'; did you mean 'sponza'"):
        get_scene("sponsa")
    with pytest.raises(hrt.UnknownNameError, match=r"camera of scene 'street'.*'along'"):
        get_scene("street").camera("alogn", 64, 64)


GOOD = """
title = "A"
description = "B"
[[mesh]]
generator = "sphere"
[cameras.front]
eye = [0, 1, 9]
target = [0, 0, 0]
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("title", "titel", "unknown key of scene.toml 'titel'; did you mean 'title'"),
        ("target", "targt", "unknown key of scene.toml [cameras.front] 'targt'; did you mean"),
        ("generator =", "generater =", "[mesh.0] 'generater'; did you mean 'generator'"),
        ('"sphere"', '"spere"', "unknown generator in scene.toml 'spere'; did you mean 'sphere'"),
        ('"sphere"', '"street"\nparameters = { sise = 9 }', "'sise'; did you mean 'size'"),
        ("eye = [0, 1, 9]", "", "scene.toml: cameras.front.eye: expected a value, got none"),
        ("[0, 1, 9]", "[0, 1]", "scene.toml: cameras.front.eye"),
        ("[0, 1, 9]", "[0, 0, 0]", "cameras.front.target: expected a point other than eye"),
        ("[0, 1, 9]", "[0, 1, 9]\nnear = 0", "cameras.front.near"),
        ("[0, 1, 9]", "[0, 1, 9]\nvfov_deg = 180", "cameras.front.vfov_deg"),
        (
            "[0, 1, 9]",
            "[0, 1, 9]\nup = [0, 1, 9]",
            "cameras.front.up: expected a direction not parallel",
        ),
        ("generator", 'file = "x.npz"\ngenerator', "either a file or a generator"),
        ('generator = "sphere"', 'file = "x.npz"', "needs"),
        ('title = "A"', 'title = "A', "a TOML file"),
        ('title = "A"', 'name = "A"', "unknown key of scene.toml 'name'"),
        ('description = "B"', "", "description"),
    ],
)
def test_a_wrong_definition_names_the_file_and_what_is_wrong(tmp_path, old, new, words):
    path = tmp_path / "scene.toml"
    path.write_text(GOOD)
    assert read_definition(path).cameras["front"].vfov_deg == 60
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(hrt.HybridRTError) as caught:
        read_definition(path)
    assert "scene.toml" in str(caught.value)
    assert words in str(caught.value)


def test_missing_data_is_said_with_what_where_and_how(tmp_path):
    spec = get_scene("sponza")
    said = spec.missing(tmp_path)
    assert said is not None
    for word in (
        "sponza.npz", str(tmp_path), "Crytek", "HYBRID_RT_DATA", "hybrid-rt import",
        "docs/scenes.md",
    ):  # fmt: skip
        assert word in said
    with pytest.raises(MissingDataError) as caught:
        spec.load(data_dir=tmp_path)
    assert str(caught.value) == said
    assert isinstance(caught.value, hrt.HybridRTError)
    for name in BUILT_IN:
        assert get_scene(name).missing(tmp_path) is None


def test_data_is_found_where_the_variable_says(tmp_path, monkeypatch):
    np.savez(
        tmp_path / "sponza.npz", vertices=np.eye(3, dtype=np.float32), faces=np.array([[0, 1, 2]])
    )
    monkeypatch.setenv("HYBRID_RT_DATA", str(tmp_path))
    assert data_directory() == tmp_path
    assert get_scene("sponza").missing() is None
    scene = get_scene("sponza").load()
    assert (scene.name, len(scene)) == ("sponza", 1)


def test_without_the_variable_it_is_the_users_folder_and_then_that_beside_the_checkout(monkeypatch):
    monkeypatch.delenv("HYBRID_RT_DATA")
    users = platformdirs.user_data_path("hybrid-rt", appauthor=False)
    assert data_directory() == users
    assert data_directories() == (users, ROOT.parent / "shared" / "scenes")


def test_files_are_found_in_the_first_folder_that_has_them(tmp_path, monkeypatch):
    first, second = tmp_path / "first", tmp_path / "second"
    for k, folder in enumerate((first, second)):
        folder.mkdir()
        vertices = np.eye(3, dtype=np.float32) * (k + 1)
        np.savez(folder / "sponza.npz", vertices=vertices, faces=[[0, 1, 2]])
    shutil.copy(second / "sponza.npz", second / "conference.npz")
    monkeypatch.setattr(spec_module, "data_directories", lambda: (first, second))
    assert get_scene("sponza").load().bounds.max() == 1
    assert get_scene("conference").load().bounds.max() == 2
    said = get_scene("kitchen").missing()
    assert f"neither in {first} nor in {second}" in said


def test_definitions_in_the_data_directory_are_scenes(tmp_path, monkeypatch):
    monkeypatch.setenv("HYBRID_RT_DATA", str(tmp_path))
    np.savez(tmp_path / "own.npz", vertices=np.eye(3, dtype=np.float32), faces=[[0, 1, 2]])
    (tmp_path / "own.toml").write_text(
        GOOD.replace('generator = "sphere"', 'file = "own.npz"').replace(
            "description", 'needs = "Mine."\ndescription', 1
        )
    )
    (tmp_path / "sphere.toml").write_text("no scene at all")  # the package's own is asked first
    assert scene_names() == sorted(BUILT_IN + REAL + ("own",))
    assert len(get_scene("own").load()) == 1
    assert get_scene("sphere").builtin


def test_a_file_from_the_command_line_gets_cameras_that_see_it(tmp_path, small):
    path = tmp_path / "ball.ply"
    scene = small["sphere"]
    trimesh.Trimesh(scene.vertices, scene.faces, process=False).export(path)
    spec = scene_from_path(path)
    assert isinstance(spec, SceneSpec)
    assert spec.name == "ball"
    assert "automatically" in spec.description
    assert not spec.builtin
    assert len(spec.cameras) >= 4
    assert spec.missing() is None
    loaded = spec.load()
    np.testing.assert_array_equal(loaded.faces, scene.faces)
    for name in ("front", "side", "corner", "above"):
        t = first_hits(loaded, spec.camera(name, 64, 36))
        assert np.isfinite(t).mean() > 0.45


def test_a_file_without_extent_or_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(hrt.MeshFileError, match="no such file"):
        scene_from_path(tmp_path / "absent.obj")
    np.savez(tmp_path / "dot.npz", vertices=np.ones((3, 3)), faces=np.array([[0, 1, 2]]))
    with pytest.raises(hrt.ArgumentError, match="single point"):
        scene_from_path(tmp_path / "dot.npz")
