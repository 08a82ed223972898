"""Depth buffers of someone's own from .npz, .exr and .png, each with its camera."""

import numpy as np
import pytest
from PIL import Image

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench.measure.frames import read_frame

LOOK = {"eye": [0.0, 2.75, 10.6], "target": [0.0, 2.75, 0.0], "vfov_deg": 40.0, "near": 0.05}


@pytest.fixture(scope="module")
def drawn():
    spec = hrs.get_scene("cornell")
    camera = hrt.Camera.look_at(**LOOK, width=64, height=48)
    return hrt.rasterize(spec.load(), camera)


@pytest.fixture
def cameras(tmp_path, drawn):
    path = tmp_path / "views.toml"
    other = hrt.Camera.look_at((0, 0, 9), (0, 0, 0), width=64, height=48)
    hrt.save_cameras(path, {"other": other, "mine": drawn.camera})
    return path


def linear(gbuffer):
    with np.errstate(divide="ignore"):
        return (gbuffer.camera.near / gbuffer.depth).astype(np.float32)


def same(found, drawn):
    assert found.camera == drawn.camera
    depth = found.gbuffer().depth
    np.testing.assert_array_equal(depth > 0, drawn.depth > 0)
    covered = drawn.depth > 0
    np.testing.assert_allclose(depth[covered], drawn.depth[covered], rtol=1e-3)


def test_npz_with_its_camera_in_each_form(tmp_path, drawn):
    camera = drawn.camera
    f = camera.focal_px
    axes = np.array([camera.right, -np.array(camera.up), camera.forward])
    matrix = np.eye(4)
    matrix[:3, :3] = [camera.right, camera.up, -np.array(camera.forward)]
    matrix[:3, 3] = -matrix[:3, :3] @ np.array(camera.eye)
    forms = {
        "look": LOOK,
        "intrinsics": {
            "K": [[f, 0, 31.5], [0, f, 23.5], [0, 0, 1]], "R": axes,
            "t": -axes @ np.array(camera.eye), "near": 0.05,
        },
        "matrices": {
            "view": matrix, "convention": "d3d",
            "projection": [[f / 32, 0, 0, 0], [0, f / 24, 0, 0], [0, 0, 0, 0.05], [0, 0, -1, 0]],
        },
    }  # fmt: skip
    for name, form in forms.items():
        path = tmp_path / f"{name}.npz"
        np.savez(path, depth=drawn.depth, kind="reversed", origin="top", **form)
        found = read_frame(path)
        assert found.name == name
        assert found.reading == {"kind": "reversed", "origin": "top"}
        depth = found.gbuffer().depth
        np.testing.assert_allclose(depth, drawn.depth, rtol=1e-6)
        at = hrt.project(found.camera, drawn.scene.vertices)
        np.testing.assert_allclose(at, hrt.project(camera, drawn.scene.vertices), rtol=1e-9)


def test_options_stand_in_place_of_what_the_file_says(tmp_path, drawn, cameras):
    path = tmp_path / "dump.npz"
    np.savez(path, depth=drawn.depth[::-1], kind="standard", bits=16, far=7.0, **LOOK)
    found = read_frame(
        path, kind="reversed", origin="bottom", far=np.inf, camera=f"{cameras}:mine", bits=None
    )
    assert found.reading == {"kind": "reversed", "bits": 16, "far": np.inf, "origin": "bottom"}
    assert found.camera == drawn.camera
    assert read_frame(path, camera=str(cameras)).camera.eye == (0, 0, 9)


def test_a_mask_of_the_background(tmp_path, drawn, cameras):
    path = tmp_path / "dump.npz"
    depth = np.where(drawn.depth > 0, linear(drawn), np.float32(3.0))
    np.savez(path, depth=depth, kind="linear", background=drawn.depth == 0)
    same(read_frame(path, camera=f"{cameras}:mine"), drawn)


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_exr(tmp_path, drawn, cameras, dtype):
    exr = pytest.importorskip("OpenEXR", reason="needs OpenEXR (pip install '.[exr]')")
    path = tmp_path / "dump.exr"
    z = linear(drawn).astype(dtype)
    for name, channels, wanted in (
        ("Z", {"Z": z, "RGB": np.zeros((*z.shape, 3), np.float16)}, None),
        ("ViewLayer.Depth.Z", {"ViewLayer.Depth.Z": z, "ViewLayer.Mist.V": z}, None),
        ("Y", {"Y": z}, None),
        ("deep", {"deep": z, "Z": z + dtype(1)}, "deep"),
    ):
        header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
        with exr.File(header, channels) as file:
            file.write(str(path))
        found = read_frame(path, camera=f"{cameras}:mine", channel=wanted)
        assert found.reading == {"kind": "linear"}, name
        assert found.depth.dtype == dtype
        same(found, drawn)


def test_png_of_16_bits(tmp_path, drawn, cameras):
    path = tmp_path / "dump.png"
    n, f = drawn.camera.near, 30.0
    standard = (1 - drawn.depth.astype(float)) / (1 - n / f)
    Image.fromarray(
        np.round(65535 * np.where(drawn.depth > 0, standard, 1)).astype(np.uint16)
    ).save(path)
    found = read_frame(path, camera=f"{cameras}:mine", far=f)
    assert found.depth.dtype == np.uint16
    covered = drawn.depth > 0
    depth = found.gbuffer().depth
    assert np.abs(depth - drawn.depth)[covered].max() <= 0.51 / 65535


def test_a_camera_of_another_size_and_the_same_shape_is_resized(tmp_path, drawn, cameras):
    path = tmp_path / "half.npz"
    half = drawn.camera.resized(32, 24)
    np.savez(path, depth=linear(hrt.rasterize(drawn.scene, half)), kind="linear")
    assert read_frame(path, camera=f"{cameras}:mine").camera == half


def refused(tmp_path, cameras, said, path, error=hrt.ArgumentError, **options):
    options.setdefault("camera", f"{cameras}:mine")
    with pytest.raises(error, match=said):
        read_frame(path, **options)


def test_files_that_are_no_frames(tmp_path, drawn, cameras):
    npz = tmp_path / "a.npz"

    def check(said, path=npz, error=hrt.ArgumentError, **options):
        refused(tmp_path, cameras, said, path, error, **options)

    check("an existing .npz, .exr or .png", tmp_path / "no.npz")
    (tmp_path / "a.txt").write_text("x")
    check("ends in .npz, .exr or .png", tmp_path / "a.txt")
    npz.write_bytes(b"junk")
    check("an .npz of plain arrays")
    np.savez(npz, depth=np.array([None, {}], object))
    check("an .npz of plain arrays")
    np.savez(npz, z=drawn.depth)
    check("unknown key of a.npz 'z'", error=hrt.UnknownNameError)
    np.savez(npz, kind="linear")
    check("a.npz: depth: expected an array")
    np.savez(npz, depth=np.zeros(5))
    check("a.npz: depth: expected an array")
    np.savez(npz, depth=drawn.depth, eye=[0, 0, 1])
    check("a.npz.target: expected a value", camera=None)
    np.savez(npz, depth=drawn.depth)
    check("--camera: expected a file of cameras", camera=None)
    check("unknown camera of views.toml 'min'; did you mean 'mine'", error=hrt.UnknownNameError,
          camera=f"{cameras}:min")  # fmt: skip
    check("--channel: expected none but for an .exr", channel="Z")
    np.savez(npz, depth=drawn.depth[:, :40])
    check("--camera: expected a camera of the depth buffer's shape, 40x48")
    Image.new("L", (64, 48)).save(tmp_path / "a.png")
    check("a PNG of 16 bits of grey", tmp_path / "a.png")
    (tmp_path / "b.png").write_bytes(b"junk")
    check("a readable PNG", tmp_path / "b.png")
    np.savez(npz, depth=np.full((48, 64), np.nan), kind="linear")
    with pytest.raises(hrt.ArgumentError, match="a: depth: expected z along the view"):
        read_frame(npz, camera=f"{cameras}:mine").gbuffer()


def test_exr_that_cannot_be_read(tmp_path, drawn, cameras):
    exr = pytest.importorskip("OpenEXR", reason="needs OpenEXR (pip install '.[exr]')")
    path = tmp_path / "a.exr"

    def check(said, error=hrt.ArgumentError, **options):
        refused(tmp_path, cameras, said, path, error, **options)

    path.write_bytes(b"junk")
    check("a readable OpenEXR file")
    z = np.ones((48, 64), np.float32)
    header = {"type": exr.scanlineimage}
    with exr.File(header, {"A": z, "B": z}) as file:
        file.write(str(path))
    check("--channel: expected the channel of a.exr that holds depth, got none .* A, B")
    check("unknown channel of a.exr 'Z'", hrt.UnknownNameError, channel="Z")
    window = (np.array([1, 1], np.int32), np.array([64, 48], np.int32))
    screen = (np.array([0, 0], np.int32), np.array([99, 99], np.int32))
    with exr.File({**header, "dataWindow": window, "displayWindow": screen}, {"Z": z}) as file:
        file.write(str(path))
    check("an image of the whole picture, .*64x48 of 100x100 pixels")
