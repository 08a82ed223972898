"""Every format round trips, and every broken file is named with what is wrong with it."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
import trimesh

import hybrid_rt as hrt

SUFFIXES = ("npz", "obj", "ply", "glb", "gltf", "stl")


def soup(n: int = 40, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Return n triangles with shared, duplicate and unused vertices and two of zero area."""
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(30, 3)).astype(np.float32)
    vertices[7] = vertices[3]
    faces = rng.integers(0, 29, (n, 3)).astype(np.int32)
    faces[0] = [0, 1, 2]
    faces[5] = [3, 7, 3]
    faces[6] = [4, 4, 5]
    faces[-1] = [0, 1, 28]
    return vertices, faces


def write(path, vertices, faces) -> None:
    suffix = path.suffix[1:]
    if suffix == "npz":
        np.savez(path, vertices=vertices, faces=faces)
        return
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if suffix == "gltf":
        for name, data in trimesh.exchange.export.export_mesh(mesh, None, "gltf").items():
            (path.parent / (path.name if name == "model.gltf" else name)).write_bytes(data)
    elif suffix == "obj":
        mesh.export(path, digits=9)
    else:
        mesh.export(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_format_gives_back_the_triangles_in_their_order(tmp_path, suffix):
    vertices, faces = soup()
    path = tmp_path / f"mesh.{suffix}"
    write(path, vertices, faces)
    mesh = hrt.read_mesh(path)
    assert mesh.vertices.dtype == np.float32
    assert mesh.faces.dtype == np.int32
    assert mesh.object_id.max() == 0
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], vertices[faces])
    np.testing.assert_array_equal(mesh.object_id, 0)
    scene = hrt.load_scene(str(path))
    assert scene.name == "mesh"
    assert len(scene) == len(faces)
    assert scene.zero_area >= 2


def test_the_suffix_may_be_in_capitals(tmp_path):
    vertices, faces = soup()
    write(tmp_path / "mesh.stl", vertices, faces)
    (tmp_path / "mesh.stl").rename(tmp_path / "MESH.STL")
    assert len(hrt.read_mesh(tmp_path / "MESH.STL").faces) == len(faces)


def test_npz_keeps_object_ids_and_takes_float64_and_int64(tmp_path):
    vertices, faces = soup()
    ids = np.arange(len(faces)) // 7
    np.savez_compressed(
        tmp_path / "m.npz", vertices=vertices.astype(np.float64), faces=faces.astype(np.int64),
        object_id=ids, other=np.zeros(3),
    )  # fmt: skip
    mesh = hrt.read_mesh(tmp_path / "m.npz")
    np.testing.assert_array_equal(mesh.object_id, ids)
    np.testing.assert_array_equal(mesh.vertices, vertices)


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_a_scene_graph_is_flattened_in_float64_and_its_instances_counted(tmp_path, suffix):
    vertices, faces = soup(10)
    part = trimesh.Trimesh(vertices, faces, process=False)
    scene = trimesh.Scene()
    far = trimesh.transformations.translation_matrix([1e6 + 0.0625, 0, -3])
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])
    mirror = np.diag([-1.0, 2.0, 1.0, 1.0])
    scene.add_geometry(part, node_name="a", geom_name="part", transform=far)
    scene.add_geometry(part, node_name="b", geom_name="part", parent_node_name="a", transform=turn)
    scene.add_geometry(part, node_name="c", geom_name="part", transform=mirror)
    path = tmp_path / f"scene.{suffix}"
    if suffix == "glb":
        scene.export(path)
    else:
        for name, data in scene.export(file_type="gltf").items():
            (tmp_path / (path.name if name == "model.gltf" else name)).write_bytes(data)
    mesh = hrt.read_mesh(path)
    assert mesh.object_id.max() == 2
    assert len(mesh.faces) == 30
    np.testing.assert_array_equal(np.bincount(mesh.object_id), [10, 10, 10])
    wanted = []
    for matrix in (far, far @ turn, mirror):
        world = vertices.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        wanted.append(world[faces].astype(np.float32))
    found = [mesh.vertices[mesh.faces[mesh.object_id == k]] for k in range(3)]
    for triangles in wanted:
        # one rounding: the last bit may differ where float64 sums in another order
        assert any(np.allclose(triangles, f, rtol=2e-7, atol=1e-6) for f in found)


def test_reading_a_scene_graph_twice_gives_the_same_arrays(tmp_path):
    scene = trimesh.Scene()
    for k in range(12):
        box = trimesh.creation.box(extents=[1, 1, 1 + k])
        scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([3 * k, 0, 0]))
    scene.export(tmp_path / "s.glb")
    first, second = hrt.read_mesh(tmp_path / "s.glb"), hrt.read_mesh(tmp_path / "s.glb")
    assert first.object_id.max() == 11
    np.testing.assert_array_equal(first.vertices, second.vertices)
    np.testing.assert_array_equal(first.faces, second.faces)


def test_obj_polygons_become_triangles_and_materials_keep_the_order_of_the_file(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text(
        "mtllib absent.mtl\n"
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 0\n"
        "usemtl b\nf 1 2 3 4\nusemtl a\nf 3 4 5\nusemtl b\nf 1 2 5\n"
    )
    mesh = hrt.read_mesh(path)
    assert len(mesh.faces) == 4
    np.testing.assert_array_equal(mesh.object_id, [0, 0, 1, 2])
    triangles = mesh.vertices[mesh.faces]
    np.testing.assert_array_equal(triangles[2], [[1, 1, 0], [0, 1, 0], [2, 2, 0]])
    np.testing.assert_array_equal(triangles[3], [[0, 0, 0], [1, 0, 0], [2, 2, 0]])
    area = np.linalg.norm(
        np.cross(triangles[:2, 1] - triangles[:2, 0], triangles[:2, 2] - triangles[:2, 0]), axis=1
    ).sum()
    assert area == 2.0


def test_obj_negative_indices_count_back_from_where_they_stand(tmp_path):
    # trimesh alone would count them from the last vertex of the file.
    path = tmp_path / "m.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf -3/-1 -2/-1 -1/-1\n"
        "v 5 5 5\nv 6 5 5\nv 5 6 5\nf -3 -2 -1\n"
    )
    mesh = hrt.read_mesh(path)
    triangles = mesh.vertices[mesh.faces]
    np.testing.assert_array_equal(triangles[0], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(triangles[1], [[5, 5, 5], [6, 5, 5], [5, 6, 5]])


def test_ply_quads_become_triangles(tmp_path):
    path = tmp_path / "q.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
    )
    assert len(hrt.read_mesh(path).faces) == 2


def bad(path, *words: str) -> None:
    with pytest.raises(hrt.MeshFileError) as caught:
        hrt.read_mesh(path)
    text = str(caught.value)
    assert path.name in text
    for word in words:
        assert word in text, text


def test_absent_folder_and_unknown_suffix_are_said(tmp_path):
    bad(tmp_path / "absent.glb", "no such file")
    bad(tmp_path, "folder")
    for name in ("mesh.xyz", "mesh"):
        (tmp_path / name).write_bytes(b"x")
        bad(tmp_path / name, "unknown mesh format", ".npz .obj .ply .glb .gltf .stl")


# An .obj has no length: cut after a whole face it is a smaller .obj; so it is cut before its faces.
CUTS = [
    (s, k) for s in SUFFIXES for k in (0.0, 0.02, 0.3, 0.6, 0.9, 0.995) if s != "obj" or k < 0.5
]


@pytest.mark.parametrize(("suffix", "kept"), CUTS)
def test_a_truncated_file_is_an_error_and_never_a_smaller_mesh(tmp_path, suffix, kept):
    vertices, faces = soup()
    path = tmp_path / f"mesh.{suffix}"
    write(path, vertices, faces)
    data = path.read_bytes()
    path.write_bytes(data[: int(kept * len(data))])
    bad(path)


@pytest.mark.parametrize("kind", ["vertices", "faces"])
def test_truncated_ascii_files_are_noticed(tmp_path, kind):
    vertices, faces = soup()
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    ply = mesh.export(file_type="ply", encoding="ascii")
    ply = ply if isinstance(ply, bytes) else ply.encode()
    lines = ply.splitlines(keepends=True)
    cut = 20 if kind == "vertices" else len(lines) - 3
    (tmp_path / "m.ply").write_bytes(b"".join(lines[:cut]))
    bad(tmp_path / "m.ply", "rows")
    stl = mesh.export(file_type="stl_ascii").splitlines()
    cut = 30 if kind == "vertices" else len(stl) - 3
    (tmp_path / "m.stl").write_text("\n".join(stl[:cut]))
    bad(tmp_path / "m.stl")


def test_a_truncated_buffer_of_a_gltf_is_an_error(tmp_path):
    write(tmp_path / "m.gltf", *soup())
    buffers = [p for p in tmp_path.iterdir() if p.suffix == ".bin"]
    assert buffers
    for path in buffers:
        path.write_bytes(path.read_bytes()[:-16])
    bad(tmp_path / "m.gltf")
    buffers[0].unlink()
    bad(tmp_path / "m.gltf")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_noise_is_an_error(tmp_path, suffix):
    path = tmp_path / f"noise.{suffix}"
    path.write_bytes(np.random.default_rng(1).bytes(5000))
    bad(path)


def test_an_npz_without_the_arrays_or_with_objects_is_refused(tmp_path):
    vertices, faces = soup()
    np.savez(tmp_path / "a.npz", vertices=vertices)
    bad(tmp_path / "a.npz", "'faces'", "holds vertices")
    np.savez(tmp_path / "b.npz", verts=vertices, tris=faces)
    bad(tmp_path / "b.npz", "'vertices' nor 'faces'")
    np.savez(tmp_path / "c.npz", vertices=vertices, faces=np.array([1, "x"], dtype=object))
    bad(tmp_path / "c.npz", "allow_pickle")
    np.save(tmp_path / "d.npy", vertices)
    (tmp_path / "d.npy").rename(tmp_path / "d.npz")
    bad(tmp_path / "d.npz", "not an .npz archive")
    np.savez(tmp_path / "e.npz", vertices=vertices, faces=faces)
    data = bytearray((tmp_path / "e.npz").read_bytes())
    data[300] ^= 0xFF
    (tmp_path / "e.npz").write_bytes(data)
    bad(tmp_path / "e.npz", "corrupt", "CRC")


def test_what_the_mesh_itself_refuses_names_the_file_too(tmp_path):
    vertices, faces = soup()
    far = faces.copy()
    far[4, 1] = 99
    np.savez(tmp_path / "far.npz", vertices=vertices, faces=far)
    bad(tmp_path / "far.npz", "faces", "at (4, 1), is 99")
    nan = vertices.copy()
    nan[2, 0] = np.nan
    np.savez(tmp_path / "nan.npz", vertices=nan, faces=faces)
    bad(tmp_path / "nan.npz", "vertices", "index 2")
    np.savez(tmp_path / "float.npz", vertices=vertices, faces=faces.astype(float))
    bad(tmp_path / "float.npz", "faces", "int32")


def test_a_point_cloud_or_an_empty_scene_has_no_triangles(tmp_path):
    cloud = trimesh.PointCloud(np.random.default_rng(1).normal(size=(9, 3)))
    for suffix in ("ply", "glb"):
        cloud.export(tmp_path / f"points.{suffix}")
        bad(tmp_path / f"points.{suffix}", "no triangles")
    (tmp_path / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    bad(tmp_path / "points.obj")
    (tmp_path / "empty.gltf").write_text(json.dumps({"asset": {"version": "2.0"}}))
    bad(tmp_path / "empty.gltf")


def test_a_gltf_that_would_lose_its_geometry_silently_is_refused(tmp_path):
    write(tmp_path / "m.glb", *soup())
    data = (tmp_path / "m.glb").read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    tree = json.loads(data[20 : 20 + length])

    def rewrite(name: str) -> None:
        text = json.dumps(tree).encode()
        text += b" " * (-len(text) % 4)
        rest = data[20 + length :]
        head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
        (tmp_path / name).write_bytes(head + text + rest)

    rewrite("same.glb")
    assert len(hrt.read_mesh(tmp_path / "same.glb").faces) == 40
    tree["extensionsRequired"] = ["ACME_voxels"]
    rewrite("voxels.glb")
    bad(tmp_path / "voxels.glb", "requires ACME_voxels")
    del tree["extensionsRequired"]
    position = tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    tree["accessors"][position]["normalized"] = True
    rewrite("short.glb")
    bad(tmp_path / "short.glb", "normalised")
