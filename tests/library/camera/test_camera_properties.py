"""Projection and its inverse, for any camera."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import hybrid_rt as hrt

coordinate = st.floats(-1e3, 1e3)
vector = st.tuples(coordinate, coordinate, coordinate)


def camera_or_skip(eye, target, **kwargs):
    view = np.subtract(target, eye)
    assume(np.linalg.norm(view) > 1e-3)
    assume(np.linalg.norm(np.cross(view, (0, 1, 0))) > 1e-3 * np.linalg.norm(view))
    return hrt.Camera.look_at(eye, target, **kwargs)


@given(
    vector,
    vector,
    st.floats(1, 170),
    st.integers(1, 8000),
    st.integers(1, 5000),
    st.floats(1e-3, 10),
    st.floats(-0.5, 1.5),
    st.floats(-0.5, 1.5),
    st.floats(1e-4, 1),
)
def test_project_undoes_unproject(eye, target, vfov_deg, width, height, near, x, y, depth):
    camera = camera_or_skip(eye, target, vfov_deg=vfov_deg, width=width, height=height, near=near)
    point_px = np.array([[x * width, y * height, depth]])
    back = hrt.project(camera, hrt.unproject(camera, point_px))
    # The eye is added and subtracted once: its rounding, seen from the distance of the point.
    slack = 1e-12 * (1 + np.abs(eye).max() / (near / depth)) * max(width, height) * 100
    np.testing.assert_allclose(back[0, :2], point_px[0, :2], rtol=0, atol=max(slack, 1e-9))
    np.testing.assert_allclose(back[0, 2], depth, rtol=max(slack, 1e-9))


@given(vector, vector)
def test_axes_are_orthonormal_and_right_handed(eye, target):
    camera = camera_or_skip(eye, target)
    axes = np.array([camera.right, camera.up, np.negative(camera.forward)])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(axes), 1.0, atol=1e-9)
    assert camera.up[1] >= 0


def test_directions_on_the_screen():
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=200, height=100, near=0.5)
    points = [[0, 0, -1], [1, 0, -1], [0, 1, -1], [0, 0, -2]]
    expected = [[100, 50, 0.5], [150, 50, 0.5], [100, 0, 0.5], [100, 50, 0.25]]
    np.testing.assert_allclose(hrt.project(camera, points), expected, atol=1e-12)


@pytest.mark.parametrize("factor", [0.25, 1.0, 1.5, 3.0])
def test_a_wider_view_shows_the_same_pixels(factor):
    camera = hrt.Camera.look_at((1, 2, 3), (0, 0, -1), vfov_deg=70, width=64, height=48)
    wide = camera.widened(factor)
    assert (wide.width, wide.height) == (64 * factor, 48 * factor)
    np.testing.assert_allclose(wide.focal_px, camera.focal_px, rtol=1e-14)
    points = np.random.default_rng(0).normal(size=(50, 3))
    border = 0.5 * np.array([wide.width - 64, wide.height - 48])
    there = hrt.project(camera, points)
    there[:, :2] += border
    np.testing.assert_allclose(hrt.project(wide, points), there, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan, np.inf, 1e6, "2"])
def test_a_view_is_not_widened_by(factor):
    with pytest.raises(hrt.ArgumentError, match=r"factor|width"):
        hrt.Camera.look_at((0, 0, 0), (0, 0, -1)).widened(factor)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"target": (0, 0, 0)}, "target: expected a point other than eye"),
        ({"up": (0, 0, 3)}, "up: expected a direction not parallel to the view"),
        ({"up": (0, 0, 0)}, "up: expected a direction of finite length"),
        ({"eye": (0, np.nan, 0)}, "eye: expected three finite numbers"),
        ({"eye": (0, 1)}, "eye: expected three finite numbers"),
        ({"near": 0.0}, "near: expected a finite number > 0, got 0.0"),
        ({"near": -1}, "near: "),
        ({"width": 0}, "width: expected an integer >= 1 and <= 32768, got 0"),
        ({"height": -5}, "height: "),
        ({"height": 2.5}, "height: "),
        ({"vfov_deg": 180}, "vfov_deg: expected a finite number > 1e-30 and < 180, got 180"),
        ({"vfov_deg": "60"}, "vfov_deg: "),
    ],
)
def test_bad_cameras(kwargs, message):
    arguments = {"eye": (0, 0, 0), "target": (0, 0, -1)} | kwargs
    with pytest.raises(hrt.ArgumentError, match="^" + message):
        hrt.Camera.look_at(**arguments)
