"""Frames of someone's own through `hybrid-rt run error --depth`: with the mesh and without."""

import json
import sys
import warnings

import numpy as np
import pytest
from PIL import Image

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench import cli
from hybrid_rt_bench.experiments import load_experiment
from hybrid_rt_bench.judged.columns import MAP_CLASSES
from hybrid_rt_bench.kinds.frame import figures
from hybrid_rt_bench.kinds.frame.cell import count
from hybrid_rt_bench.kinds.frame.columns import NOWHERE
from hybrid_rt_bench.measure.loaded import prepare
from hybrid_rt_bench.measure.screens import Screens
from hybrid_rt_bench.measure.workloads import MESHLESS, WORKLOADS, get_workload
from hybrid_rt_bench.runs import read_run

SIZE = {"width": 64, "height": 48}


@pytest.fixture(scope="module")
def drawn():
    spec = hrs.get_scene("cornell")
    return hrt.rasterize(spec.load(), spec.camera(next(iter(spec.cameras)), *SIZE.values()))


@pytest.fixture(scope="module")
def dump(drawn, tmp_path_factory):
    """Write the frame with its camera, upside down."""
    camera = drawn.camera
    path = tmp_path_factory.mktemp("frames") / "dump.npz"
    look = {
        "eye": camera.eye, "target": np.add(camera.eye, camera.forward),
        "vfov_deg": camera.vfov_deg, "near": camera.near,
    }  # fmt: skip
    np.savez(path, depth=drawn.depth[::-1], kind="reversed", origin="bottom", **look)
    return path


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    def call(*arguments):
        line = ["run", *map(str, arguments), "--out", str(tmp_path / "out"), "--threads", "1"]
        monkeypatch.setattr(sys, "argv", ["hybrid-rt", *line])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        return stopped.value.code, *capsys.readouterr()

    return call


def summary_of(done):
    code, out, err = done
    assert code == 0, err
    summary = json.loads(out)
    return summary, read_run(summary["folder"])


def test_with_the_mesh_it_counts_what_the_raster_counts(run, dump, drawn):
    done = run("error", "--depth", dump, "--scene", "cornell", "--json")
    summary, data = summary_of(done)
    rows = {row["technique"]: row for row in summary["results"]}
    assert list(rows) == list(load_experiment("frame").techniques)
    loaded = prepare(drawn.scene, 1)
    screens = Screens(drawn, 1)
    rays = hrt.mirror_rays(drawn)
    for name, row in rows.items():
        technique = hrt.TECHNIQUES[name]()
        expected = count(screens, rays, get_workload("mirror"), technique, loaded)
        assert {k: row[k] for k in expected.row} == expected.row
        assert row["judged"]
        assert 0 <= row["wrong_low"] <= row["wrong_rate"] <= row["wrong_high"] <= 1
    assert rows["certified"]["false_hit"] == rows["certified"]["false_miss"] == 0
    assert rows["linear"]["false_hit"] > 0
    frame = data.meta["frame"]
    assert (frame["mesh"], frame["unmatched"], frame["uncertain"]) == ("cornell", 0, 0)
    by_technique = data.verdicts.groupby("technique")["count"].sum()
    assert set(by_technique) == {len(rays)}
    names = {path.rpartition("/")[2] for path in summary["files"]}
    assert {"tables.md", "statuses.png", "statuses.svg", "errors.png", "errors.svg"} <= names


def test_without_the_mesh_it_tells_alpha_and_statuses_and_says_so(run, dump):
    summary, data = summary_of(run("error", "--depth", dump, "--json"))
    rows = {row["technique"]: row for row in summary["results"]}
    assert set(rows) == set(load_experiment("frame").techniques) - {"certified"}
    for row in rows.values():
        assert not row["judged"]
        assert row["wrong_rate"] is None
        assert 0 < row["alpha"] < 1
    assert "There is no mesh (--scene)" in summary["notes"][0]
    assert set(data.verdicts.verdict) == {"UNJUDGED", "UNRESOLVED"}
    tables = (data.folder / "tables.md").read_text()
    assert "nobody can tell which answers are right" in tables
    assert "wrong" not in tables.split("###")[1].split("\n")[2]
    assert not any(path.endswith("errors.png") for path in summary["files"])


def test_maps_show_each_ray_where_it_starts(drawn):
    screens, rays = Screens(drawn, 1), hrt.mirror_rays(drawn)
    technique = hrt.Paper()
    counted = count(screens, rays, get_workload("mirror"), technique, prepare(drawn.scene, 1))
    marched = hrt.march(rays, screens.of(technique))
    status, classes = counted.maps["status"], counted.maps["classes"]
    x, y = rays.pixel.T
    np.testing.assert_array_equal(status[y, x], marched.status)
    assert (status == NOWHERE).sum() == status.size - len(rays)
    np.testing.assert_array_equal(classes[y, x] == MAP_CLASSES["unresolved"], ~marched.resolved)
    image = figures.status_map(status)
    hit = np.argwhere(status == hrt.MarchStatus.HIT)[0]
    assert tuple(image[tuple(hit)]) == (0xC8, 0xC8, 0xC8)
    assert (image[status == NOWHERE] == 255).all()
    assert [s.name for s in hrt.MarchStatus] == figures.NAMES


def test_the_pictures_have_the_frames_pixels(run, dump):
    summary, _ = summary_of(run("error", "--depth", dump, "--techniques", "paper,hiz", "--json"))
    maps = next(path for path in summary["files"] if path.endswith("statuses"))
    for name in ("paper", "hiz"):
        assert Image.open(f"{maps}/{name}.png").size == (64, 48)
    sheet = Image.open(f"{maps}.png").convert("RGB")
    assert sheet.width >= 2 * 64


def test_pixels_that_are_not_as_in_the_mesh_are_a_warning(run, dump, tmp_path):
    with np.load(dump) as stored:
        arrays = {key: stored[key] for key in stored.files}
    arrays["depth"] = arrays["depth"].copy()
    arrays["depth"][20:24, 30:34] = 0.5
    np.savez(tmp_path / "other.npz", **arrays)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        summary, data = summary_of(
            run("error", "--depth", tmp_path / "other.npz", "--scene", "cornell", "--json")
        )
    assert data.meta["frame"]["unmatched"] == 16
    assert any("16 of 3072 pixels" in text for text in summary["warnings"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("frame",), "--depth: expected a depth buffer"),
        (("error", "--scene", "cornell"), "--scene: expected an option that kind 'error' has"),
        (("error", "--depth", "no.npz"), "--depth: expected an existing .npz"),
        (("error", "--depth", "{dump}", "--kind", "sideways"), "dump: kind: expected one of"),
        (("error", "--depth", "{dump}", "--rounds", "3"), "--rounds: expected an option that kind"),
        (("error", "--depth", "{dump}", "--techniques", "certified"), "--scene: expected a mesh"),
        (("error", "--depth", "{dump}", "--camera", "no.toml"), "an existing file of cameras"),
        (("paper", "--depth", "{dump}"), "--depth: expected an option that kind 'paper' has"),
    ],
)
def test_what_cannot_be_run_is_refused(run, dump, tmp_path, options, said):
    code, _, err = run(*(text.format(dump=dump) for text in options))
    assert code in (2, 3)
    assert said in " ".join(err.split())
    assert not (tmp_path / "out").exists()
    assert "Traceback" not in err


def test_which_rays_need_no_mesh(drawn):
    alone = hrt.GBuffer.from_arrays(drawn.camera, drawn.depth, kind="reversed")
    for name, workload in WORKLOADS.items():
        if name in MESHLESS:
            assert len(workload.make(None, alone, 0)) > 0
        else:
            with pytest.raises(hrt.ArgumentError, match="one that knows its triangles"):
                workload.make(None, alone, 0)


def rendered(monkeypatch, capsys, *arguments):
    """Call `hybrid-rt render`; return its exit code and what it says."""
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", "render", *map(str, arguments)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    return stopped.value.code, " ".join(capsys.readouterr().err.split())


def test_a_picture_of_a_frame(dump, tmp_path, monkeypatch, capsys):
    picture = tmp_path / "frame.png"
    code, said = rendered(monkeypatch, capsys, "--depth", dump, "-o", picture, "--what", "normals")
    assert code == 0, said
    assert "<GBuffer of a depth buffer alone: 64 x 48 pixels" in said
    alone = np.asarray(Image.open(picture).convert("RGB"))
    code, said = rendered(
        monkeypatch, capsys, "cornell", "--depth", dump, "-o", picture, "--what", "normals"
    )
    assert code == 0, said
    assert "<GBuffer of 'cornell': 64 x 48 pixels" in said
    by_mesh = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    assert alone.shape == by_mesh.shape
    assert (np.abs(alone - by_mesh).max(axis=2) <= 1).mean() > 0.95  # but along edges
    for what in ("depth", "status", "all"):
        code, said = rendered(monkeypatch, capsys, "--depth", dump, "-o", picture, "--what", what)
        assert code == 0, said
        assert len(Image.open(picture).convert("RGB").getcolors(1 << 16)) > 3


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--depth", "{dump}", "--what", "shaded"), "--what: expected depth, normals, status or"),
        (("--depth", "{dump}", "--size", "8x6"), "--size: expected none beside --depth"),
        (("cornell", "--far", "3"), "--far: expected none without --depth"),
        ((), "SCENE: expected a scene, a mesh file or --depth"),
    ],
)
def test_a_picture_that_cannot_be_made(dump, tmp_path, monkeypatch, capsys, options, said):
    arguments = [text.format(dump=dump) for text in options]
    code, told = rendered(monkeypatch, capsys, *arguments, "-o", tmp_path / "frame.png")
    assert code == 2
    assert said in told
