"""Public types check their arrays where they are made, own them, and are read-only from then on."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

import hybrid_rt as hrt
from support import synthetic


def records():
    """Return one of each record, with the arrays that it was made of."""
    vertices, faces = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
    scene = hrt.Scene(vertices, faces)
    camera = hrt.Camera.look_at((0, 0, 2), (0, 0, 0), width=4, height=3)
    image, ids = np.zeros((3, 4), np.float32), np.full((3, 4), -1, np.int32)
    ray, flat = np.ones((5, 3), np.float32), np.zeros(5, np.float32)
    cells = np.zeros(hrt.build_depth_pyramid(synthetic.gbuffer(image)).data.shape, np.float32)
    return {
        "Mesh": (hrt.Mesh(vertices, faces), [vertices, faces]),
        "Scene": (scene, [vertices, faces]),
        "GBuffer": (hrt.GBuffer(image, image, image, ids, scene, camera), [image, ids]),
        "Rays": (hrt.Rays(ray, ray, None, flat), [ray, flat]),
        "DepthPyramid": (hrt.DepthPyramid(cells, 4, 3), [cells]),
    }


@pytest.mark.parametrize("name", list(records()))
def test_arrays_are_owned_and_read_only(name):
    record, given = records()[name]
    held = [v for v in vars(record).values() if isinstance(v, np.ndarray)]
    assert held
    for array in held:
        assert not array.flags.writeable
        assert not any(np.shares_memory(array, other) for other in given)
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        record.vertices = 1


@pytest.mark.parametrize("name", list(records()))
def test_records_are_copied_and_pickled_whole(name):
    record, _ = records()[name]
    for twin in (pickle.loads(pickle.dumps(record)), copy.deepcopy(record)):
        assert type(twin) is type(record)
        for key, value in vars(record).items():
            if isinstance(value, np.ndarray):
                assert np.array_equal(getattr(twin, key), value)
                assert not getattr(twin, key).flags.writeable


def test_what_the_caller_does_to_his_arrays_later_changes_nothing():
    vertices, faces = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
    scene = hrt.Scene.from_arrays(vertices, faces)
    faces[0, 0] = 10**8
    vertices[:] = np.nan
    assert scene.faces[0, 0] == 0
    camera = hrt.Camera.look_at((0.3, 0.3, 2), (0.3, 0.3, 0), width=8, height=8)
    assert (hrt.rasterize(scene, camera).prim_id >= -1).all()


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("layout", ["plain", "strided", "fortran", "read-only", "unaligned"])
def test_arrays_of_any_layout_and_byte_order_are_read_right(order, layout):
    rng = np.random.default_rng(3)
    values = rng.normal(size=(6, 3)).astype(f"{order}f4")
    if layout == "strided":
        values = np.repeat(values, 2, axis=0)[::2]
    elif layout == "fortran":
        values = np.asfortranarray(values)
    elif layout == "read-only":
        values.flags.writeable = False
    elif layout == "unaligned":
        raw = np.zeros(values.nbytes + 1, np.uint8)
        raw[1:] = values.view(np.uint8).reshape(-1)
        values = raw[1:].view(f"{order}f4").reshape(6, 3)
    rays = hrt.Rays(values, values[::-1], t_far=np.full(6, 9.0))
    assert np.array_equal(rays.origin, values)
    assert np.array_equal(rays.direction, values[::-1])
    for array in rays.arrays:
        assert array.flags.c_contiguous
        assert array.flags.aligned
        assert array.dtype.isnative


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"depth": np.zeros((2, 4))}, r"^depth: expected an array of shape \(3, 4\)"),
        ({"depth": np.full((3, 4), -1.0)}, "^depth: expected values >= 0"),
        ({"depth": np.full((3, 4), np.nan)}, "^depth: expected finite"),
        ({"ddx": np.full((3, 4), np.inf)}, "^ddx: expected finite"),
        ({"prim_id": np.full((3, 4), 1)}, r"^prim_id: expected values from -1 to 0"),
        ({"prim_id": np.full((3, 4), 0)}, r"^prim_id: expected -1 where depth is 0"),
        ({"camera": None}, "^camera: expected a Camera"),
        ({"scene": "hall"}, "^scene: expected a Scene"),
    ],
)
def test_a_gbuffer_that_contradicts_itself_is_refused(changes, said):
    gbuffer, _ = records()["GBuffer"]
    with pytest.raises(hrt.ArgumentError, match=said):
        dataclasses.replace(gbuffer, **changes)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"width": 70000}, "^width: expected an integer >= 1 and <= 32768"),
        ({"eye": [0, np.nan, 0]}, "^eye: "),
        ({"eye": [0, 1e300, 0]}, "^eye: expected coordinates within float32"),
        ({"right": [2, 0, 0]}, "^right: expected an axis of length 1"),
        ({"up": [1, 0, 0]}, "^(right|up): expected an axis"),
        ({"near": 1e-300}, "^near: expected a length within float32"),
        ({"vfov_deg": 180}, "^vfov_deg: "),
    ],
)
def test_a_camera_that_sees_nothing_is_refused(changes, said):
    camera = hrt.Camera.look_at((0, 0, 2), (0, 0, 0), width=4, height=3)
    with pytest.raises(hrt.ArgumentError, match=said):
        dataclasses.replace(camera, **changes)


def test_a_pyramid_that_is_too_short_is_refused():
    with pytest.raises(hrt.ArgumentError, match=r"^data: expected .* cells, as many as 4 by 3"):
        hrt.DepthPyramid(np.zeros(5, np.float32), 4, 3)
