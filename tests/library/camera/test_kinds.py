"""What cameras of all kinds have in common: there and back, other sizes, what is refused."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybrid_rt as hrt

EYE, TARGET = (0.5, 1.0, 4.0), (-0.2, 0.3, -2.0)


def pinhole(**lens):
    return dataclasses.replace(
        hrt.Camera.look_at(EYE, TARGET, vfov_deg=55, width=64, height=48, near=0.2), **lens
    )


def parallel(**lens):
    camera = hrt.Camera.orthographic(
        EYE, TARGET, view_height=4.0, width=64, height=48, near=1.0, far=11.0
    )
    return dataclasses.replace(camera, **lens)


CAMERAS = {
    "pinhole": pinhole(),
    "off the middle": pinhole(shift_px=(20.5, -7.25)),
    "far off the middle": pinhole(shift_px=(-900.0, 400.0)),
    "wide pixels": pinhole(aspect=0.4, shift_px=(3.0, 1.0)),
    "mirrored": pinhole(right=tuple(-x for x in pinhole().right), shift_px=(5.0, 2.0)),
    "orthographic": parallel(),
    "orthographic, off the middle": parallel(shift_px=(11.0, -30.5), aspect=2.5),
    "orthographic, from behind the eye": parallel(near=-3.0),
    "orthographic, mirrored": parallel(up=tuple(-x for x in parallel().up)),
}
each = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)


@each
@given(x=st.floats(-100, 200), y=st.floats(-100, 200), depth=st.floats(0.01, 1))
def test_project_undoes_unproject(camera, x, y, depth):
    point = np.array([[x, y, depth]])
    back = hrt.project(camera, hrt.unproject(camera, point))
    np.testing.assert_allclose(back, point, rtol=1e-10, atol=1e-9)


@each
def test_depth_is_1_on_the_near_plane_and_falls_along_the_view(camera):
    z = np.array([camera.near, camera.near + 1, camera.near + 5])
    points = np.array(camera.eye) + z[:, None] * np.array(camera.forward)
    depth = hrt.project(camera, points)[:, 2]
    np.testing.assert_allclose(depth[0], 1.0, rtol=1e-12)
    assert (np.diff(depth) < 0).all()
    np.testing.assert_allclose(camera.z_view(depth), z, rtol=1e-12)
    np.testing.assert_allclose(camera.depth_at(z), depth, rtol=1e-12)
    a, b = camera.receding(2.0)
    farther = hrt.project(camera, points + 2.0 * np.array(camera.forward))[:, 2]
    np.testing.assert_allclose((depth - b) / (1 + a * depth), farther, rtol=1e-12, atol=1e-15)


@each
def test_the_inverse_that_kernels_take_is_one(camera):
    view = camera.arrays
    screen = np.random.default_rng(1).uniform([0, 0, 0.01], [64, 48, 1], (50, 3))
    x, y, w, d = view.frame
    p = view.sigma * ((screen[:, :1] - 32) * x + (screen[:, 1:2] - 24) * y + w)
    p = p + screen[:, 2:] * d
    q = np.column_stack([p[:, :3] / p[:, 3:], np.ones(50)]) @ view.m.T
    np.testing.assert_allclose(q[:, :2] / q[:, 2:3], screen[:, :2], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(q[:, 3] / q[:, 2], screen[:, 2], rtol=1e-9)


@each
def test_lines_of_sight_run_through_their_places(camera):
    x, y = np.random.default_rng(2).uniform(0, 48, (2, 30))
    origin, direction = camera.views(x, y)
    z = np.linspace(0.7, 9, 30)
    there = hrt.project(camera, origin + z[:, None] * direction)
    np.testing.assert_allclose(there[:, :2], np.column_stack([x, y]), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(there[:, 2], camera.depth_at(z), rtol=1e-10)
    start, along, t_near, t_far = camera.primary(x, y)
    depth = hrt.project(camera, start + t_near * along)[:, 2]
    np.testing.assert_allclose(depth, 1.0, rtol=1e-9)
    if math.isfinite(t_far):
        np.testing.assert_allclose(hrt.project(camera, start + t_far * along)[:, 2], 0, atol=1e-9)
    np.testing.assert_allclose(
        np.cross(camera.towards(origin + direction), direction), 0, atol=1e-9
    )


@each
def test_a_finer_view_shows_the_same(camera):
    fine = camera.resized(128, 96)
    points = hrt.unproject(camera, np.random.default_rng(3).uniform([0, 0, 0.1], 1, (20, 3)) * 40)
    there, finer = hrt.project(camera, points), hrt.project(fine, points)
    np.testing.assert_allclose(finer[:, :2], 2 * there[:, :2], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(finer[:, 2], there[:, 2], rtol=1e-12)
    assert dataclasses.replace(fine, width=64, height=48, shift_px=camera.shift_px) == camera


@each
@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_a_wider_view_shows_the_same_pixels_and_more(camera, factor):
    wide = camera.widened(factor)
    border = 0.5 * np.array([wide.width - 64, wide.height - 48])
    assert wide.shift_px == camera.shift_px
    points = hrt.unproject(camera, np.random.default_rng(4).uniform([0, 0, 0.1], 1, (20, 3)) * 40)
    there = hrt.project(camera, points)
    there[:, :2] += border
    np.testing.assert_allclose(hrt.project(wide, points), there, rtol=1e-9, atol=1e-8)


def test_what_cameras_say_they_are():
    assert repr(CAMERAS["off the middle"]).endswith(
        "64 x 48 pixels, 55 degrees high, centre shifted by (20.5, -7.25) pixels, near 0.2>"
    )
    assert repr(CAMERAS["orthographic"]) == (
        "<Orthographic camera at (0.5 1 4) along (-0.1151 -0.1151 -0.9867): 64 x 48 pixels, 4 high,"
        " near 1, far 11>"
    )
    assert repr(CAMERAS["mirrored"]).endswith("near 0.2, mirrored>")
    assert CAMERAS["pinhole"].far == math.inf


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"shift_px": 3}, "shift_px: expected two numbers, pixels"),
        ({"shift_px": (0, np.nan)}, "shift_px: expected a finite number"),
        ({"shift_px": (2.0**31, 0)}, "shift_px: expected at most 1073741824 pixels"),
        ({"aspect": 0}, "aspect: expected a finite number > 1e-09"),
        ({"aspect": "1"}, "aspect: "),
        ({"far": 0.1}, "far: expected more than near"),
        ({"far": np.nan}, "far: "),
    ],
)
def test_lenses_are_checked(changes, said):
    for camera in (pinhole(), parallel()):
        with pytest.raises(hrt.ArgumentError, match=f"^{said}"):
            dataclasses.replace(camera, **changes)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"view_height": 0}, "view_height: expected a finite number > 0"),
        ({"view_height": 1e-300}, "view_height: expected a length within float32"),
        ({"near": np.inf}, "near: "),
        ({"near": 12.0}, "far: expected more than near, 12, by what float32 can tell"),
        ({"near": 1e9, "far": 1e9 + 1}, "far: expected more than near"),
        ({"far": 1e39}, "far: expected a distance within float32"),
        ({"target": EYE}, "target: expected a point other than eye"),
        ({"up": np.subtract(TARGET, EYE)}, "up: expected a direction not parallel"),
        ({"height": 40000}, "height: expected an integer >= 1 and <= 32768"),
    ],
)
def test_an_orthographic_camera_is_checked(changes, said):
    given = {"eye": EYE, "target": TARGET, "view_height": 4.0, "near": 1.0, "far": 11.0} | changes
    with pytest.raises(hrt.ArgumentError, match=f"^{said}"):
        hrt.Camera.orthographic(**given)
