"""Meshes, scenes and errors: what is refused, what is kept, and what the message says."""

import numpy as np
import pytest

import hybrid_rt as hrt

TRIANGLE = np.eye(3)
FACES = np.array([[0, 1, 2]])


BAD_MESHES = [
    (
        TRIANGLE[:, :2],
        FACES,
        None,
        r"vertices: expected an array of shape \(V, 3\) and dtype float32",
    ),
    (TRIANGLE[:, :2], FACES, None, r"got an array of shape \(3, 2\) and dtype float64"),
    ("triangle", FACES, None, "vertices: expected an array"),
    (np.eye(3, dtype=complex), FACES, None, "vertices: .*complex128"),
    ([[0, 0], [1]], FACES, None, "vertices: expected an array"),
    (
        [[0, 0, 0], [1, np.nan, 0], [np.inf, 1, 0]],
        FACES,
        None,
        r"vertices: .* got 2 not finite, the first at index 1: \(1, nan, 0\)",
    ),
    (np.eye(3) * 1e39, FACES, None, "vertices: expected finite float32"),
    (TRIANGLE, np.empty((0, 3), int), None, "faces: expected at least one triangle, got none"),
    (TRIANGLE, [[0, 1, 3]], None, r"faces: expected values from 0 to 2 \(there are 3 vertices\)"),
    (TRIANGLE, [[0, 1, 3]], None, r"got 1 out of range, the first, at \(0, 2\), is 3"),
    (TRIANGLE, [[0, 1, 2], [0, -1, 2]], None, r"faces: .* first, at \(1, 1\), is -1"),
    (TRIANGLE, [[0, 1, 2, 0]], None, r"faces: expected an array of shape \(F, 3\)"),
    (TRIANGLE, FACES.astype(float), None, "faces: .* dtype int32, got .* dtype float64"),
    (TRIANGLE, np.array([[0, 1, 2**40]]), None, "faces: expected integers that fit int32"),
    (TRIANGLE, FACES, [0, 1], "object_id: expected 1 rows, as many as faces, got 2 rows"),
    (TRIANGLE, FACES, [0.5], "object_id: "),
]


@pytest.mark.parametrize(("vertices", "faces", "object_id", "message"), BAD_MESHES)
def test_bad_meshes(vertices, faces, object_id, message):
    with pytest.raises(hrt.ArgumentError, match=message):
        hrt.Scene.from_arrays(vertices, faces, object_id)


def test_an_argument_error_is_a_value_error_and_ours():
    error = hrt.ArgumentError("near", "a number > 0", "0")
    assert isinstance(error, ValueError)
    assert isinstance(error, hrt.HybridRTError)
    assert str(error) == "near: expected a number > 0, got 0"
    assert (error.argument, error.expected, error.got) == ("near", "a number > 0", "0")


def test_an_unknown_name_suggests_the_nearest():
    error = hrt.UnknownNameError("scene", "sponzza", ["bistro", "sponza"])
    assert str(error) == "unknown scene 'sponzza'; did you mean 'sponza'? (known: bistro, sponza)"
    assert str(hrt.UnknownNameError("scene", "x", [])) == "unknown scene 'x' (known: none)"


def test_zero_area_triangles_are_kept_counted_and_never_hit():
    vertices = np.concatenate([TRIANGLE, [[2, 2, 2], [0.5, 0.5, 0]]])
    faces = [[0, 1, 2], [0, 0, 1], [3, 3, 3], [0, 4, 1]]  # the last: three points on a line
    scene = hrt.Scene.from_arrays(vertices, faces)
    assert len(scene) == 4
    assert scene.zero_area == 3
    middle = np.array([[1 / 3, 1 / 3, 1 / 3], [0.25, 0.75, 0.0], [2.0, 2.0, 2.0]])
    rays = hrt.Rays.from_arrays(middle - (1, 1, 1), np.ones((3, 3)))
    for tracer in (hrt.BruteForceTracer(scene), hrt.EmbreeTracer(scene)):
        assert set(tracer.intersect(rays).prim_id) <= {-1, 0}
    camera = hrt.Camera.look_at((3, 3, 3), (0, 0, 0), width=50, height=50)
    assert set(np.unique(hrt.rasterize(scene, camera).prim_id)) == {-1, 0}


def test_polygon_ids_are_each_triangles_own_unless_given():
    faces = [[0, 1, 2], [2, 1, 0], [1, 2, 0]]
    assert hrt.Mesh(TRIANGLE, faces).polygon_id.tolist() == [0, 1, 2]
    mesh = hrt.Mesh(TRIANGLE, faces, polygon_id=[4, 4, 7])
    assert mesh.polygon_id.dtype == np.int32
    assert not mesh.polygon_id.flags.writeable
    joined = hrt.Scene.from_meshes([mesh, hrt.Mesh(TRIANGLE, faces)])
    assert joined.polygon_id.tolist() == [4, 4, 7, 8, 9, 10]
    assert hrt.Scene(TRIANGLE, faces, None, "name", [0, 0, 0]).polygon_id.tolist() == [0, 0, 0]
    for bad in ([0, 0], [0.5, 1, 2], [[0], [1], [2]], [2**31, 0, 0]):
        with pytest.raises(hrt.ArgumentError, match="polygon_id: expected"):
            hrt.Scene.from_arrays(TRIANGLE, faces, polygon_id=bad)


def test_meshes_are_joined_in_order_with_their_objects_apart():
    one = hrt.Mesh.from_arrays(TRIANGLE, FACES, [2])
    two = hrt.Mesh.from_arrays(TRIANGLE + 5, FACES, [0])
    scene = hrt.Scene.from_meshes([one, two], name="pair")
    np.testing.assert_array_equal(scene.faces, [[0, 1, 2], [3, 4, 5]])
    np.testing.assert_array_equal(scene.object_id, [2, 3])
    np.testing.assert_array_equal(scene.bounds, [[0, 0, 0], [6, 6, 6]])
    assert scene.vertices.dtype == np.float32
    assert scene.name == "pair"
    with pytest.raises(hrt.ArgumentError, match="meshes: expected a sequence of at least one Mesh"):
        hrt.Scene.from_meshes([])


def test_bounds_leave_out_vertices_that_no_face_uses():
    scene = hrt.Scene.from_arrays(np.concatenate([TRIANGLE, [[99, 99, 99]]]), FACES)
    np.testing.assert_array_equal(scene.bounds, [[0, 0, 0], [1, 1, 1]])


def test_inputs_are_not_written():
    vertices, faces = TRIANGLE.astype(np.float32), FACES.astype(np.int32)
    before = vertices.copy(), faces.copy()
    scene = hrt.Scene.from_arrays(vertices, faces)
    camera = hrt.Camera.look_at((2, 2, 2), (0, 0, 0), width=20, height=20)
    buffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(buffer)
    held = [buffer.depth, buffer.prim_id, rays.origin, rays.direction, rays.t_near, rays.t_far]
    copies = [a.copy() for a in held]
    hrt.trace_hybrid(rays, hrt.prepare(buffer, "paper"), hrt.EmbreeTracer(scene))
    np.testing.assert_array_equal(vertices, before[0])
    np.testing.assert_array_equal(faces, before[1])
    for a, b in zip(held, copies, strict=True):
        np.testing.assert_array_equal(a, b)
