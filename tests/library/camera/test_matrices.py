"""Cameras from matrices and calibrations, against the formulas of those who make these."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybrid_rt as hrt

NEAR, FAR = 0.25, 40.0
SIZE = {"width": 320, "height": 200}
SEEN = hrt.Camera.look_at((1, 2, 3), (0.2, 0.5, -1), vfov_deg=50, near=NEAR, **SIZE)
POINTS = np.array([[0.3, 0.4, 0.1], [-0.7, 1.2, -3], [0.5, -0.3, -9], [0.1, 0.9, 1.2]])


def look_at(eye, target, up, left_handed=False):
    """Return the view matrix of glm::lookAtRH, or LH."""
    f = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    if left_handed:
        s = np.cross(up, f) / np.linalg.norm(np.cross(up, f))
        rows = [s, np.cross(f, s), f]
    else:
        s = np.cross(f, up) / np.linalg.norm(np.cross(f, up))
        rows = [s, np.cross(s, f), -f]
    view = np.eye(4)
    view[:3, :3] = rows
    view[:3, 3] = -np.array(rows) @ eye
    return view


def frustum(left, right, bottom, top, near, far):
    """Return the matrix of glFrustum."""
    return np.array(
        [
            [2 * near / (right - left), 0, (right + left) / (right - left), 0],
            [0, 2 * near / (top - bottom), (top + bottom) / (top - bottom), 0],
            [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
            [0, 0, -1, 0],
        ]
    )


def ortho(left, right, bottom, top, near, far):
    """Return the matrix of glOrtho."""
    return np.array(
        [
            [2 / (right - left), 0, 0, -(right + left) / (right - left)],
            [0, 2 / (top - bottom), 0, -(top + bottom) / (top - bottom)],
            [0, 0, -2 / (far - near), -(far + near) / (far - near)],
            [0, 0, 0, 1],
        ]
    )


def perspective(kind, near=NEAR, far=FAR):
    """Return a projection of 50 degrees by the formulas of glm and of Direct3D."""
    f = 1 / math.tan(math.radians(25))
    scales = f * SIZE["height"] / SIZE["width"], f
    rows = {  # of z and w
        "opengl": [-(far + near) / (far - near), -2 * far * near / (far - near), -1],
        "opengl reversed": [(far + near) / (far - near), 2 * far * near / (far - near), -1],
        "opengl infinite": [-1, -2 * near, -1],
        "opengl infinite reversed": [1, 2 * near, -1],
        "opengl infinite, moved by rounding": [-1 + 2.0**-22, -2 * near, -1],
        "d3d": [far / (near - far), near * far / (near - far), -1],
        "d3d reversed": [near / (far - near), near * far / (far - near), -1],
        "d3d infinite": [-1, -near, -1],
        "d3d infinite reversed": [0, near, -1],
        "d3d left-handed": [far / (far - near), -near * far / (far - near), 1],
        "d3d left-handed infinite reversed": [0, near, 1],
    }
    a, b, c = rows[kind]
    return np.array([[scales[0], 0, 0, 0], [0, scales[1], 0, 0], [0, 0, a, b], [0, 0, c, 0]])


KINDS = [
    "opengl", "opengl reversed", "opengl infinite", "opengl infinite reversed",
    "opengl infinite, moved by rounding", "d3d", "d3d reversed", "d3d infinite",
    "d3d infinite reversed",
]  # fmt: skip


def by_hand(projection, view, points, height=200, width=320, y_down=False):
    """Return where clip space puts points in the picture, x and y from the top left."""
    clip = np.column_stack([points, np.ones(len(points))]) @ view.T @ projection.T
    ndc = clip[:, :3] / clip[:, 3:]
    y = (1 + ndc[:, 1]) / 2 if y_down else (1 - ndc[:, 1]) / 2
    return np.column_stack([(ndc[:, 0] + 1) / 2 * width, y * height])


@pytest.mark.parametrize("kind", KINDS)
def test_a_look_at_camera_comes_back_from_its_matrices(kind):
    view = look_at(SEEN.eye, (0.2, 0.5, -1), (0, 1, 0))
    convention = kind.split()[0]
    camera = hrt.Camera.from_matrices(view, perspective(kind), convention=convention, **SIZE)
    assert isinstance(camera, hrt.Pinhole)
    np.testing.assert_allclose(hrt.project(camera, POINTS), hrt.project(SEEN, POINTS), rtol=1e-6)
    np.testing.assert_allclose(camera.near, NEAR, rtol=1e-6)
    if "infinite" in kind:
        assert camera.far == math.inf
    else:
        np.testing.assert_allclose(camera.far, FAR, rtol=1e-12)
    for name in ("eye", "right", "up", "forward", "vfov_deg", "shift_px"):
        np.testing.assert_allclose(getattr(camera, name), getattr(SEEN, name), atol=1e-12)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if "moved" not in kind])
@given(
    st.tuples(*[st.floats(-50, 50)] * 3), st.tuples(*[st.floats(-1, 1)] * 3),
    st.floats(5, 150), st.floats(1e-3, 1), st.floats(2, 1e4), st.floats(-0.9, 0.9),
)  # fmt: skip
def test_any_look_at_camera_comes_back_from_its_matrices(kind, eye, way, degrees, near, far, turn):
    target = np.add(np.add(eye, way), np.array((0, 0, -1.5)))
    up = (turn, 1, 0)
    seen = hrt.Camera.look_at(eye, target, up, vfov_deg=degrees, near=near, **SIZE)
    projection = perspective(kind, near, far)
    f = 1 / math.tan(math.radians(degrees) / 2)
    projection[0, 0], projection[1, 1] = f * SIZE["height"] / SIZE["width"], f
    convention = kind.split()[0]
    view = look_at(np.array(eye), target, up)
    camera = hrt.Camera.from_matrices(view, projection, convention=convention, **SIZE)
    for name in ("eye", "right", "up", "forward"):
        np.testing.assert_allclose(getattr(camera, name), getattr(seen, name), atol=1e-12)
    np.testing.assert_allclose(camera.vfov_deg, degrees, rtol=1e-12)
    # A finite far plane is one digit of the sum that it stands in: far / near digits are lost.
    slack = 1e-15 * far / near + 1e-14
    np.testing.assert_allclose(camera.near, near, rtol=slack)
    if "infinite" in kind:
        assert camera.far == math.inf
    else:
        np.testing.assert_allclose(camera.far, far, rtol=10 * slack)


def test_matrices_in_float32_are_taken():
    view = look_at(SEEN.eye, (0.2, 0.5, -1), (0, 1, 0)).astype(np.float32)
    camera = hrt.Camera.from_matrices(view, perspective("opengl").astype(np.float32), **SIZE)
    np.testing.assert_allclose(hrt.project(camera, POINTS), hrt.project(SEEN, POINTS), rtol=1e-5)
    axes = np.array([camera.right, camera.up, camera.forward])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)


@pytest.mark.parametrize("kind", ["d3d left-handed", "d3d left-handed infinite reversed"])
def test_a_left_handed_view_shows_what_it_shows_there(kind):
    view = look_at(SEEN.eye, (0.2, 0.5, -1), (0, 1, 0), left_handed=True)
    projection = perspective(kind)
    camera = hrt.Camera.from_matrices(view, projection, convention="d3d", **SIZE)
    there = hrt.project(camera, POINTS)
    np.testing.assert_allclose(there[:, :2], by_hand(projection, view, POINTS), rtol=1e-12)
    # The mirror image of what a right-handed view shows from there.
    mirrored = hrt.project(SEEN, POINTS)
    mirrored[:, 0] = SIZE["width"] - mirrored[:, 0]
    np.testing.assert_allclose(there, mirrored, rtol=1e-9)
    assert "mirrored" in repr(camera)


def test_vulkan_points_down_and_stays_upright():
    view, projection = look_at(SEEN.eye, (0.2, 0.5, -1), (0, 1, 0)), perspective("d3d")
    projection[1, 1] *= -1
    for convention in ("d3d", "vulkan"):
        camera = hrt.Camera.from_matrices(view, projection, convention=convention, **SIZE)
        np.testing.assert_allclose(
            hrt.project(camera, POINTS), hrt.project(SEEN, POINTS), rtol=1e-9
        )
    # A view that itself points down, as OpenCV's, under y down.
    view[[1, 2]] *= -1
    projection = perspective("d3d left-handed")
    camera = hrt.Camera.from_matrices(view, projection, convention="vulkan", **SIZE)
    np.testing.assert_allclose(hrt.project(camera, POINTS), hrt.project(SEEN, POINTS), rtol=1e-9)
    assert camera.hand == 1.0


@given(
    st.tuples(*[st.floats(-3, 3)] * 4),
    st.floats(0.01, 2),
    st.floats(3, 100),
    st.booleans(),
    st.booleans(),
    st.booleans(),
)
def test_any_frustum_projects_as_clip_space_does(sides, near, far, parallel, y_down, mirrored):
    (x0, x1), (y0, y1) = sorted(sides[:2]), sorted(sides[2:])
    make = ortho if parallel else frustum
    projection = make(x0, x1 + 0.1, y0, y1 + 0.1, near, far)
    projection[1] *= -1 if y_down else 1
    projection[0] *= -1 if mirrored else 1
    view = look_at((1, 2, 3), (0.2, 0.5, -9), (0.1, 1, 0))
    camera = hrt.Camera.from_matrices(view, projection, **SIZE)
    assert isinstance(camera, hrt.Orthographic if parallel else hrt.Pinhole)
    expected = by_hand(projection, view, POINTS, y_down=y_down)
    there = hrt.project(camera, POINTS)
    size = np.abs(expected).max() + 1e3
    np.testing.assert_allclose(there[:, :2], expected, rtol=0, atol=1e-11 * size)
    np.testing.assert_allclose((camera.near, camera.far), (near, far), rtol=1e-9)
    np.testing.assert_allclose(camera.z_view(there[:, 2]), -(POINTS @ view[2, :3] + view[2, 3]))


def test_an_orthographic_view_may_begin_behind_the_eye_where_the_way_is_known():
    view = look_at((0, 0, 5), (0, 0, 0), (0, 1, 0))
    camera = hrt.Camera.from_matrices(view, ortho(-2, 2, -1, 1, -3, 7), **SIZE)
    np.testing.assert_allclose((camera.near, camera.far), (-3, 7), rtol=1e-12)
    np.testing.assert_allclose(
        hrt.project(camera, [[0, 0, 8], [0, 0, -2]])[:, 2], [1, 0], atol=1e-12
    )
    projection = ortho(-2, 2, -1, 1, -3, 7)
    projection[2, 2:] = -1 / 10, 3 / 10
    with pytest.raises(hrt.ArgumentError, match=r"^projection: .*on one side of the eye"):
        hrt.Camera.from_matrices(view, projection, convention="d3d", **SIZE)


@pytest.mark.parametrize(
    ("convention", "row", "near", "far"),
    [
        ("d3d", [-1 / 9, -1 / 9], 1, 10),  # right-handed, standard
        ("d3d", [1 / 9, 10 / 9], 1, 10),  # right-handed, reversed
        ("opengl", [2 / 9, 11 / 9], 1, 10),  # reversed
    ],
)
def test_orthographic_views_look_where_their_planes_are(convention, row, near, far):
    view = look_at(SEEN.eye, (0.2, 0.5, -1), (0, 1, 0))
    projection = ortho(-2, 2, -1, 1, 1, 10)
    projection[2, 2:] = row
    camera = hrt.Camera.from_matrices(view, projection, convention=convention, **SIZE)
    np.testing.assert_allclose((camera.near, camera.far), (near, far), rtol=1e-12)
    np.testing.assert_allclose(camera.forward, SEEN.forward, atol=1e-12)
    assert camera.hand == 1.0


def changed(matrix, place, value):
    matrix = matrix.copy()
    matrix[place] = value
    return matrix


VIEW = look_at((1, 2, 3), (0, 0, -1), (0, 1, 0))
GOOD = perspective("opengl")
FLAT = ortho(-2, 2, -1, 1, 1, 10)


@pytest.mark.parametrize(
    ("view", "projection", "said"),
    [
        (VIEW.T, GOOD, "view: .*for row vectors: transpose it"),
        (VIEW, GOOD.T, "projection: .*for row vectors: transpose it"),
        (VIEW, FLAT.T, "projection: .*for row vectors: transpose it"),
        (np.diag([2, 2, 2, 1]) @ VIEW, GOOD, "view: expected orthonormal rows.*scales"),
        (np.diag([2, 1, 1, 1]) @ VIEW, GOOD, "view: expected orthonormal rows.*scales"),
        (VIEW @ changed(np.eye(4), (0, 1), 0.3), GOOD, "view: expected orthonormal.*shears"),
        (changed(VIEW, (3, 3), 2), GOOD, r"view: expected a last row of \(0, 0, 0, 1\)"),
        (np.zeros((4, 4)), GOOD, "view: expected a last row"),
        (changed(VIEW, (0, 0), np.nan), GOOD, "view: expected finite numbers"),
        (VIEW[:3], GOOD, r"view: expected an array of shape \(4, 4\)"),
        (VIEW, "P", r"projection: expected an array of shape \(4, 4\)"),
        (VIEW, changed(GOOD, (0, 1), 0.2), "projection: expected no shear of the screen"),
        (VIEW, changed(GOOD, (2, 0), 0.2), "projection: expected no oblique near plane"),
        (VIEW, changed(GOOD, (0, 3), 0.2), "projection: expected no translation"),
        (VIEW, changed(FLAT, (0, 2), 0.2), "projection: expected no oblique lines of sight"),
        (VIEW, changed(FLAT, (2, 2), 0.0), "projection: expected planes apart"),
        (VIEW, changed(GOOD, (0, 0), 0.0), "projection: .*a screen of no size"),
        (VIEW, changed(GOOD, (3, 3), 0.5), "projection: expected a last row"),
        (VIEW, np.eye(4) * 0.0, "projection: expected a last row"),
        (VIEW, perspective("d3d infinite reversed"), "projection: expected near and far.*opengl"),
    ],
)
def test_other_matrices_are_refused_by_name(view, projection, said):
    with pytest.raises(hrt.ArgumentError, match=f"^{said}"):
        hrt.Camera.from_matrices(view, projection, **SIZE)


def test_other_conventions_are_refused_by_name():
    with pytest.raises(hrt.ArgumentError, match=r"^convention: expected one of 'opengl', 'd3d'"):
        hrt.Camera.from_matrices(VIEW, GOOD, convention="metal", **SIZE)


def rodrigues(turn):
    """Return the rotation of a vector, as cv2.Rodrigues."""
    angle = np.linalg.norm(turn)
    x, y, z = turn / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * (k @ k)


@given(
    st.floats(50, 3000), st.floats(50, 3000), st.floats(-500, 900), st.floats(-500, 900),
    st.tuples(*[st.floats(-1, 1)] * 3),
)  # fmt: skip
def test_a_calibration_projects_as_opencv_does(fx, fy, cx, cy, turn):
    rotation, t = rodrigues(np.array(turn) + 0.1), np.array([0.2, -0.1, 4.0])
    k = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    camera = hrt.Camera.from_intrinsics(k, rotation, t, **SIZE)
    x, y, z = rotation @ POINTS.T + t[:, None]
    expected = np.column_stack([fx * x / z + cx, fy * y / z + cy])  # cv2.projectPoints
    there = hrt.project(camera, POINTS)
    assert (z != 0).all()
    size = np.abs(expected).max() + 1e3
    np.testing.assert_allclose(there[:, :2] - 0.5, expected, rtol=0, atol=1e-10 * size)
    np.testing.assert_allclose(camera.near / there[:, 2], z, rtol=1e-9, atol=1e-9)
    assert camera.hand == 1.0
    again = hrt.Camera.from_intrinsics(k, rotation, t.reshape(3, 1), **SIZE)
    assert again == camera


K = np.array([[500, 0, 300], [0, 480, 170], [0, 0, 1.0]])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"K": changed(K, (0, 1), 2)}, r"K: expected no skew, K\[0, 1\] = 0, got a skew of 2"),
        ({"K": changed(K, (2, 2), 2)}, r"K: expected \[\[fx, 0, cx\]"),
        ({"K": changed(K, (1, 1), -480)}, r"K: expected focal lengths .* > 0"),
        ({"K": K[:2]}, r"K: expected an array of shape \(3, 3\)"),
        ({"R": np.diag([1, 1, -1])}, "R: expected a rotation, got a rotation with a reflection"),
        ({"R": 2 * np.eye(3)}, "R: expected orthonormal rows"),
        ({"R": [0.1, 0.2, 0.3]}, r"R: expected an array of shape \(3, 3\)"),
        ({"t": [0, 0]}, "t: expected an array of shape"),
        ({"t": [0, 0, np.inf]}, "t: expected finite numbers"),
        ({"near": 0}, "near: "),
        ({"width": 0}, "width: "),
    ],
)
def test_other_calibrations_are_refused_by_name(changes, said):
    given = {"K": K, "R": np.eye(3), "t": np.zeros(3), **SIZE} | changes
    with pytest.raises(hrt.ArgumentError, match=f"^{said}"):
        hrt.Camera.from_intrinsics(**given)
