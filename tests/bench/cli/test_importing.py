"""``hybrid-rt import``: a mesh file of each kind goes in and comes out as a scene by name."""

import json
import sys

import numpy as np
import pytest
import trimesh

import hybrid_rt as hrt
from hybrid_rt_bench import cli
from hybrid_rt_scenes import get_scene, scene_names


@pytest.fixture
def data(tmp_path, monkeypatch):
    """An empty data directory, which does not exist yet."""
    folder = tmp_path / "data" / "scenes"
    monkeypatch.setenv("HYBRID_RT_DATA", str(folder))
    monkeypatch.setenv("COLUMNS", "200")
    return folder


@pytest.fixture
def hybrid_rt(monkeypatch, capsys):
    def run(*words, code=0):
        monkeypatch.setattr(sys, "argv", ["hybrid-rt", *map(str, words)])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        captured = capsys.readouterr()
        assert stopped.value.code == code, captured.err
        assert "Traceback" not in captured.err
        return captured.out if code == 0 else captured.err

    return run


def write(folder, suffix):
    """Write two balls side by side and return the path."""
    balls = [
        trimesh.creation.icosphere(subdivisions=2).apply_translation((x, 0, 0)) for x in (0, 3)
    ]
    mesh = trimesh.util.concatenate(balls)
    path = folder / f"balls.{suffix}"
    if suffix == "npz":
        np.savez(path, vertices=mesh.vertices.astype(np.float32), faces=mesh.faces)
    elif suffix == "gltf":
        for name, content in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh)).items():
            (folder / name.replace("model", "balls")).write_bytes(content)
    else:
        mesh.export(path)
    return path


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "gltf", "glb", "npz"])
def test_a_round_trip_of_each_reader(hybrid_rt, data, tmp_path, suffix):
    path = write(tmp_path, suffix)
    said = hybrid_rt("import", path)
    assert "640 triangles" in said
    assert "diagonal 5.7" in said
    assert f"wrote {data / 'balls.npz'}" in said
    assert "hybrid-rt run paper --quick --scenes balls" in said
    assert sorted(p.name for p in data.iterdir()) == ["balls.npz", "balls.toml"]
    read, scene = hrt.read_mesh(path), get_scene("balls").load()
    for field in ("vertices", "faces", "object_id", "polygon_id"):
        assert np.array_equal(getattr(read, field), getattr(scene, field)), field
    assert "balls" in scene_names()


def test_nothing_is_replaced_unless_forced(hybrid_rt, data, tmp_path):
    path = write(tmp_path, "obj")
    hybrid_rt("import", path)
    before = (data / "balls.npz").read_bytes()
    assert "--force" in hybrid_rt("import", path, "--scale", "2", code=2)
    assert (data / "balls.npz").read_bytes() == before
    hybrid_rt("import", path, "--scale", "2", "--force")
    assert get_scene("balls").load().diagonal == pytest.approx(2 * hrt.load_scene(path).diagonal)


def test_a_file_that_cannot_be_read_leaves_nothing(hybrid_rt, data, tmp_path):
    (tmp_path / "bad.obj").write_text("f 1 2 3\n")
    assert "bad.obj" in hybrid_rt("import", tmp_path / "bad.obj", code=2)
    assert not data.exists()


def test_a_known_scene_is_filled_and_its_cameras_are_tried(hybrid_rt, data, tmp_path):
    absent = hybrid_rt("render", "sponza", "-o", tmp_path / "s.png", code=3)
    assert "hybrid-rt import FILE --name sponza" in absent
    said = hybrid_rt("import", write(tmp_path, "obj"), "--name", "sponza", "--scale", "0.01")
    assert "next to nothing" in said
    assert "262,267 triangles, metres" in said
    assert [p.name for p in data.iterdir()] == ["sponza.npz"]
    assert get_scene("sponza").missing() is None


def test_a_scene_that_reports_call_partial_says_so(hybrid_rt, data, tmp_path):
    said = hybrid_rt("import", write(tmp_path, "obj"), "--name", "bistro")
    assert "reports will call this scene partial" in said


def test_a_folder_that_cannot_be_written_is_said(hybrid_rt, data, tmp_path):
    data.parent.mkdir()
    data.write_text("a file in its place")
    assert "cannot be written" in hybrid_rt("import", write(tmp_path, "obj"), code=3)


def test_list_and_info_say_where_and_outlive_a_damaged_definition(hybrid_rt, data, tmp_path):
    hybrid_rt("import", write(tmp_path, "stl"))
    (data / "torn.toml").write_text("title = ")
    shown = hybrid_rt("list")
    assert "640 triangles, imported from balls.stl" in shown
    assert "scene 'torn' cannot be used: torn.toml" in shown
    assert str(data) in shown
    assert str(data) in hybrid_rt("info")


@pytest.mark.slow
def test_the_imported_scene_runs(hybrid_rt, data, tmp_path):
    hybrid_rt("import", write(tmp_path, "glb"))
    out = hybrid_rt(
        "run", "paper", "--scenes", "balls", "--cameras", "front", "--resolutions", "96x54",
        "--rounds", "1", "--threads", "1", "--out", tmp_path / "runs", "--json",
    )  # fmt: skip
    assert json.loads(out)["measured"] == 1
