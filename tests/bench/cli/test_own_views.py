"""Meshes, definitions and files of cameras of someone's own, through `info`, `render` and `run`."""

import sys

import pytest
from PIL import Image

import hybrid_rt as hrt
from hybrid_rt_bench import cli
from hybrid_rt_bench.experiments import load_experiment
from hybrid_rt_bench.measure import viewpoints
from hybrid_rt_bench.measure.plan import make_plan
from support.gltf import Gltf


@pytest.fixture
def files(tmp_path):
    g = Gltf()
    g.node(mesh=g.mesh())
    g.add("cameras", type="perspective", perspective={"yfov": 0.8, "znear": 0.1})
    g.node(camera=0, translation=[0.5, 0.5, 2], name="door")
    g.write(tmp_path / "model.glb")
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"
    (tmp_path / "bare.obj").write_text(square)
    definition = (
        '[[mesh]]\nfile = "bare.obj"\n[cameras.near]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n'
    )
    (tmp_path / "hall.toml").write_text(definition)
    views = {
        "wide": hrt.Camera.look_at((0.5, 0.5, 3), (0.5, 0.5, 0), vfov_deg=80),
        "plan": hrt.Camera.orthographic((0, 0, 3), (0, 0, 0), view_height=3, far=5),
    }
    hrt.save_cameras(tmp_path / "views.toml", views)
    return tmp_path


@pytest.fixture
def called(monkeypatch, capsys):
    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["hybrid-rt", *map(str, arguments)])
        monkeypatch.setenv("COLUMNS", "140")
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        return stopped.value.code, *capsys.readouterr()

    return call


def test_info_lists_triangles_bounds_and_cameras(files, called):
    code, out, _ = called("info", files / "model.glb")
    assert code == 0
    for text in ("triangles     2", "from          0, 0, 0", "to            1, 1, 0", "door"):
        assert text in out
    assert "automatically" not in out
    code, out, _ = called("info", files / "bare.obj")
    assert "cameras, placed automatically" in out
    code, out, _ = called("info", files / "hall.toml")
    assert code == 0
    assert "near" in out
    code, out, _ = called("info", files / "views.toml")
    assert code == 0
    assert "triangles" not in out
    for text in ("wide", "80 degrees high", "plan", "orthographic", "3 high"):
        assert text in out
    code, _, err = called("info", files / "no.glb")
    assert code != 0
    assert "no such file" in err


@pytest.mark.parametrize(
    ("scene", "camera"),
    [("model.glb", None), ("model.glb", "views.toml:plan"), ("hall.toml", "model.glb:door"),
     ("bare.obj", "views.toml")],
)  # fmt: skip
def test_render_by_cameras_of_files(files, called, scene, camera):
    options = () if camera is None else ("--camera", files / camera)
    picture = files / "out.png"
    code, _, err = called(
        "render", files / scene, "-o", picture, "--size", "60x40", "--what", "normals", *options
    )
    assert code == 0, err
    colours = Image.open(picture).convert("RGB").getcolors(1 << 24)
    counts = {colour: count for count, colour in colours}
    assert counts[128, 128, 255] > 20  # the square faces +z
    assert counts[255, 255, 255] > 20


def test_a_camera_that_a_file_does_not_have_is_named(files, called):
    code, _, err = called(
        "render", files / "bare.obj", "-o", files / "o.png", "--camera", f"{files}/views.toml:pla"
    )
    assert code == 2
    assert "unknown camera of views.toml 'pla'; did you mean 'plan'" in " ".join(err.split())


def test_runs_take_files_for_scenes_and_cameras(files):
    experiment = load_experiment("paper", quick=True)
    scenes = [str(files / name) for name in ("model.glb", "hall.toml", "bare.obj")]
    plan = make_plan(experiment, scenes)
    assert [p.name for p in plan.scenes] == ["model", "hall", "bare"]
    assert [p.cameras for p in plan.scenes][:2] == [("door",), ("near",)]
    plan = make_plan(experiment, scenes, ["door", str(files / "views.toml")])
    assert [p.cameras for p in plan.scenes] == [
        ("door", "wide", "plan"), ("wide", "plan"), ("wide", "plan")
    ]  # fmt: skip
    camera = plan.scenes[2].spec.camera("plan", 30, 20)
    assert camera == hrt.load_cameras(files / "views.toml")["plan"].resized(30, 20)
    plan = make_plan(experiment, scenes, [f"{files}/views.toml:wide"])
    assert {p.cameras for p in plan.scenes} == {("wide",)}
    with pytest.raises(hrt.ArgumentError, match="cameras of different names"):
        make_plan(experiment, scenes, [f"{files}/views.toml:wide", str(files / "views.toml")])


def test_files_of_cameras_are_told_from_names():
    for text in ("a.toml", "a.TOML:x", "b/c.glb:left wing", "d.gltf", "C:/x.toml:y", "C:/x.glb"):
        assert viewpoints.is_file(text), text
    for text in ("nave", "a.obj", "nave_2.1", "x:y"):
        assert not viewpoints.is_file(text), text
