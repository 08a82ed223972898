"""The geometry of glTF 2.0, feature by feature, from files written here."""

import json

import numpy as np
import pytest

import hybrid_rt as hrt
from support.gltf import HALVES, SQUARE, TYPES, Gltf
from support.meshfiles import refused, triangles


def square(**node):
    """Return a file with one square."""
    g = Gltf()
    g.node(mesh=g.mesh(), **node)
    return g


def read(g, tmp_path, suffix=".gltf"):
    """Write and read."""
    return hrt.read_mesh(g.write(tmp_path / f"m{suffix}"))


def corners(positions=SQUARE, indices=HALVES):
    """Return triangles as lists."""
    return np.asarray(positions, np.float32)[np.asarray(indices).reshape(-1, 3)].tolist()


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
@pytest.mark.parametrize("kind", ["u1", "u2", "u4", None])
def test_indices_of_all_types(tmp_path, suffix, kind):
    g = Gltf()
    indices = None if kind is None else HALVES.astype(kind)
    g.node(mesh=g.mesh(SQUARE if kind else SQUARE[HALVES], indices))
    assert triangles(read(g, tmp_path, suffix)) == corners()


def test_interleaved_and_padded_arrays(tmp_path):
    g = Gltf()
    rows = np.zeros(4, [("n", "<f4", 3), ("p", "<f4", 3), ("uv", "<f4", 2)])
    rows["p"] = SQUARE
    view = g.view(b"\1\1\1\1" + rows.tobytes(), byteStride=32)
    k = g.add("accessors", bufferView=view, byteOffset=16, count=4, componentType=5126, type="VEC3")
    g.node(mesh=g.mesh(k))
    # the last row need not be padded to the stride
    g.tree["bufferViews"][view]["byteLength"] = 16 + 3 * 32 + 12
    assert triangles(read(g, tmp_path)) == corners()
    g.tree["bufferViews"][view]["byteLength"] -= 1
    refused(
        g.write(tmp_path / "m.gltf"), "accessors[0]: it ends at byte 124 of a buffer view of 123"
    )


@pytest.mark.parametrize("dense", [True, False])
@pytest.mark.parametrize("kind", ["u1", "u2", "u4"])
def test_sparse_accessors(tmp_path, dense, kind):
    g = square()
    if not dense:
        del g.tree["accessors"][0]["bufferView"]
    where, what = np.array([0, 2], kind), np.array([[-1, 0, 5], [9, 9, 9]], "<f4")
    g.tree["accessors"][0]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": g.view(where.tobytes()), "componentType": TYPES[kind]},
        "values": {"bufferView": g.view(b"xxxx" + what.tobytes()), "byteOffset": 4},
    }  # fmt: skip
    wanted = SQUARE.copy() if dense else np.zeros_like(SQUARE)
    wanted[[0, 2]] = what
    assert triangles(read(g, tmp_path)) == corners(wanted)
    g.tree["accessors"][0]["count"] = 2
    refused(g.write(tmp_path / "m.gltf"), "sparse.indices", "ascending indices below 2")


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2"])
@pytest.mark.parametrize("normalized", [True, False])
def test_quantised_positions(tmp_path, kind, normalized):
    g = Gltf()
    top = np.iinfo(kind).max
    low = np.iinfo(kind).min
    stored = np.array([[0, 0, 0], [top, 0, 0], [top, top, 1], [low, top, 0]], kind)
    padded = np.zeros((4, 4), kind)
    padded[:, :3] = stored
    view = g.view(padded.tobytes(), byteStride=padded.itemsize * 4)
    code = {"componentType": TYPES[kind], "type": "VEC3", "count": 4}
    k = g.add("accessors", bufferView=view, normalized=normalized, **code)
    g.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    g.node(mesh=g.mesh(k), scale=[2, 2, 2])
    wanted = np.maximum(stored / top, -1.0) if normalized else stored.astype(float)
    assert triangles(read(g, tmp_path)) == corners(wanted * 2)


def test_normalised_floats_are_refused(tmp_path):
    g = square()
    g.tree["accessors"][0]["normalized"] = True
    refused(g.write(tmp_path / "m.gltf"), "accessors[0]: normalised values of float32")


MODES = {
    4: [[0, 1, 2], [3, 4, 5]],
    5: [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]],
    6: [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]],
}


@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize("mode", list(MODES))
def test_modes_of_triangles(tmp_path, mode, indexed):
    g = Gltf()
    points = np.random.default_rng(1).normal(size=(6, 3)).astype("<f4")
    order = np.array([5, 3, 1, 0, 2, 4], "<u2")
    given = (points, order) if indexed else (points[order], None)
    g.node(mesh=g.mesh(*given, mode=mode))
    assert triangles(read(g, tmp_path)) == corners(points[order], MODES[mode])


def test_points_and_lines_are_left_out_with_a_word(tmp_path):
    g = square()
    for mode in range(4):
        g.tree["meshes"][0]["primitives"].append({**g.primitive(), "mode": mode})
    with pytest.warns(UserWarning, match=r"m\.gltf: its lines and points are left out"):
        assert len(read(g, tmp_path)) == 2
    del g.tree["meshes"][0]["primitives"][0]
    refused(g.write(tmp_path / "m.gltf"), "no triangles", "only lines and points")
    g.primitive()["mode"] = 7
    refused(g.write(tmp_path / "m.gltf"), "meshes[0].primitives[0].mode: there is no mode 7")


def test_transforms_of_nodes(tmp_path):
    g = Gltf()
    mesh = g.mesh()
    half = np.sqrt(0.5)
    child = g.node(False, mesh=mesh, translation=[1, 0, 0], scale=[2, 3, 1])
    g.node(rotation=[0, 0, half, half], children=[child], mesh=mesh)
    g.node(mesh=mesh, matrix=[1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 5, 6, 7, 1])
    found = read(g, tmp_path)
    turned = SQUARE[:, [1, 0, 2]] * [-1, 1, 1]
    inner = (SQUARE * [2, 3, 1] + np.array([1, 0, 0]))[:, [1, 0, 2]] * [-1, 1, 1]
    matrix = SQUARE[:, [0, 2, 1]] + [5, 6, 7]
    wanted = [*corners(turned), *corners(inner), *corners(matrix)]
    np.testing.assert_allclose(triangles(found), wanted, atol=1e-6)
    assert found.object_id.tolist() == [0, 0, 1, 1, 2, 2]


@pytest.mark.parametrize("below", [True, False])
def test_meshes_beside_and_below_cameras_and_lights(tmp_path, below):
    g = Gltf()
    g.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]
    light = {"KHR_lights_punctual": {"light": 0}}
    if below:
        g.node(
            camera=0,
            extensions=light,
            translation=[3, 0, 0],
            children=[g.node(False, mesh=g.mesh())],
        )
    else:
        g.node(camera=0, extensions=light, translation=[3, 0, 0], mesh=g.mesh())
    assert triangles(read(g, tmp_path)) == corners(SQUARE + np.array([3, 0, 0]))


def test_the_default_scene_alone(tmp_path):
    g = square()
    g.tree["nodes"].append({"mesh": 0, "translation": [0, 0, 4]})
    g.tree["scenes"].append({"nodes": [1]})
    assert triangles(read(g, tmp_path)) == corners()
    g.tree["scene"] = 1
    assert triangles(read(g, tmp_path)) == corners(SQUARE + np.array([0, 0, 4]))
    del g.tree["scene"]
    assert triangles(read(g, tmp_path)) == corners()
    del g.tree["scenes"]
    assert len(read(g, tmp_path)) == 4


def test_hidden_nodes_hide_what_is_below(tmp_path):
    g = square()
    hidden = {"KHR_node_visibility": {"visible": False}}
    g.node(mesh=0, extensions=hidden, children=[g.node(False, mesh=0)])
    g.tree["extensionsRequired"] = ["KHR_node_visibility"]
    assert len(read(g, tmp_path)) == 2


GRAPHS = {
    "itself": ([{"children": [0], "mesh": 0}], [0], "nodes[0]: a cycle"),
    "cycle": ([{"children": [1], "mesh": 0}, {"children": [0]}], [0], "a cycle"),
    "cycle apart": ([{"mesh": 0}, {"children": [2]}, {"children": [1]}], [0], "nodes[1]: a cycle"),
    "two parents": ([{"children": [2]}, {"children": [2]}, {"mesh": 0}], [0, 1],
                    "is a child of 0 too"),
    "child as root": ([{"children": [1]}, {"mesh": 0}], [0, 1], "node 1 is below node 0"),
    "twice": ([{"mesh": 0}], [0, 0], "listed twice"),
    "no such node": ([{"children": [5]}], [0], "nodes[0].children[0]: there is no number 5"),
    "no such mesh": ([{"mesh": 3}], [0], "nodes[0].mesh: there is no number 3"),
    "both": ([{"mesh": 0, "matrix": np.eye(4).ravel().tolist(), "scale": [1, 1, 1]}], [0],
             "a matrix beside"),
    "projective": ([{"mesh": 0, "matrix": [1.0] * 16}], [0], "not affine"),
    "no rotation": ([{"mesh": 0, "rotation": [0, 0, 0, 0]}], [0], "a rotation of length 0"),
    "short": ([{"mesh": 0, "scale": [1, 1]}], [0], "nodes[0].scale: expected 3 numbers, got 2"),
    "words": ([{"mesh": 0, "scale": [1, 1, "x"]}], [0],
              'nodes[0].scale[2]: expected a finite number, got "x"'),
}  # fmt: skip


@pytest.mark.parametrize("name", list(GRAPHS))
def test_broken_graphs_are_named(tmp_path, name):
    g = Gltf()
    g.mesh()
    g.tree["nodes"], g.tree["scenes"][0]["nodes"], message = GRAPHS[name]
    refused(g.write(tmp_path / "m.gltf"), message)


def test_a_chain_of_nodes_deeper_than_any_stack(tmp_path):
    g = Gltf()
    g.mesh()
    n = 5000
    g.tree["nodes"] = [{"translation": [1, 0, 0], "children": [k + 1]} for k in range(n)]
    g.tree["nodes"].append({"mesh": 0})
    g.tree["scenes"][0]["nodes"] = [0]
    assert triangles(read(g, tmp_path)) == corners(SQUARE + np.array([n, 0, 0]))


@pytest.mark.parametrize("sparse", [True, False])
def test_morph_weights_of_mesh_and_node(tmp_path, sparse):
    g = square()
    first, second = np.zeros((2, 4, 3), "<f4")
    first[2] = [3, 3, 0]
    second[0] = [0, 0, 8]
    targets = [{"POSITION": g.accessor(t)} for t in (first, second)]
    if sparse:
        where, what = np.array([2], "<u2"), first[2:3]
        g.tree["accessors"][targets[0]["POSITION"]] = {
            "count": 4, "componentType": 5126, "type": "VEC3",
            "sparse": {"count": 1, "values": {"bufferView": g.view(what.tobytes())},
                       "indices": {"componentType": 5123, "bufferView": g.view(where.tobytes())}},
        }  # fmt: skip
    g.primitive()["targets"] = [*targets, {"NORMAL": 0}]
    assert triangles(read(g, tmp_path)) == corners()
    g.tree["meshes"][0]["weights"] = [1.0, 0.5, 1]
    assert triangles(read(g, tmp_path)) == corners(SQUARE + first + second / 2)
    g.tree["nodes"][0]["weights"] = [0.0, 1.0, 0]
    g.node(mesh=0, translation=[0, 5, 0])
    found = triangles(read(g, tmp_path))
    assert found == [
        *corners(SQUARE + second),
        *corners(SQUARE + first + second / 2 + np.array([0, 5, 0])),
    ]
    g.tree["nodes"][0]["weights"] = [0.0]
    refused(g.write(tmp_path / "m.gltf"), "meshes[0].primitives[0]: 3 targets, and 1 weights")


def skinned(kind="f4", sets=1):
    """Return a file with a square whose right side follows a joint."""
    g = Gltf()
    top = 1 if kind == "f4" else np.iinfo(kind).max
    joints, weights = np.zeros((4, 4), "u1"), np.zeros((4, 4), kind)
    joints[:, 0] = [0, 1, 1, 0]
    weights[:, 0] = top
    attributes = {"JOINTS_0": joints, "WEIGHTS_0": weights}
    if sets == 2:
        attributes["WEIGHTS_0"] = weights / 2
        attributes |= {"JOINTS_1": joints.astype("<u2"), "WEIGHTS_1": weights / 2}
    attributes = {k: v.astype(kind) if k[0] == "W" else v for k, v in attributes.items()}
    mesh = g.mesh(attributes=attributes)
    for name, k in g.primitive()["attributes"].items():
        if name[0] == "W" and kind != "f4":
            g.tree["accessors"][k]["normalized"] = True
    tip = g.node(False, translation=[0, 0, 2])
    root = g.node(translation=[10, 0, 0], children=[tip])
    binds = np.stack([np.eye(4), np.eye(4)])
    binds[1, 2, 3] = -1
    inverse = g.accessor(binds.swapaxes(1, 2).reshape(2, 16).astype("<f4"))
    g.add("skins", joints=[root, tip], inverseBindMatrices=inverse)
    # a skinned mesh stands where its joints are, not where its node is
    g.node(children=[g.node(False, mesh=mesh, skin=0)], translation=[100, 100, 100])
    return g


@pytest.mark.parametrize(("kind", "sets"), [("f4", 1), ("f4", 2), ("u1", 1), ("u2", 1)])
def test_skins_stand_as_their_joints_do(tmp_path, kind, sets):
    wanted = SQUARE + np.array([10, 0, 0])
    wanted[1:3, 2] += 1
    assert triangles(read(skinned(kind, sets), tmp_path)) == corners(wanted)
    g = skinned()
    del g.tree["skins"][0]["inverseBindMatrices"]
    wanted[1:3, 2] += 1
    assert triangles(read(g, tmp_path)) == corners(wanted)


def test_broken_skins_are_named(tmp_path):
    g = skinned()
    g.tree["skins"][0]["joints"].pop()
    refused(g.write(tmp_path / "m.gltf"), "skins[0]: a vertex is moved by joint 1 of 1")
    g = skinned()
    del g.primitive()["attributes"]["JOINTS_0"]
    refused(g.write(tmp_path / "m.gltf"), "no JOINTS_0")
    g = skinned()
    g.tree["skins"][0]["joints"].append(0)
    refused(g.write(tmp_path / "m.gltf"), "2 matrices of 3 joints")
    g = skinned("u1")
    weights = g.tree["accessors"][g.primitive()["attributes"]["WEIGHTS_0"]]
    weights["normalized"] = False
    refused(g.write(tmp_path / "m.gltf"), "weights of a vertex sum to 255")


@pytest.mark.parametrize("turn", [None, "f4", "i1"])
def test_instancing(tmp_path, turn):
    g = square(translation=[0, 0, 7])
    move = np.array([[0, 0, 0], [5, 0, 0], [0, 5, 0]], "<f4")
    size = np.array([[1, 1, 1], [2, 2, 2], [1, 3, 1]], "<f4")
    attributes = {
        "TRANSLATION": g.accessor(move),
        "SCALE": g.accessor(size),
        "_ID": g.accessor(move),
    }
    if turn:
        about_z = np.tile([0, 0, 1, 0], (3, 1)) * (127 if turn == "i1" else 1)
        attributes["ROTATION"] = g.accessor(about_z.astype(turn), normalized=turn == "i1")
    g.tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    mesh = read(g, tmp_path)
    sign = [-1, -1, 1] if turn else [1, 1, 1]
    wanted = [t for m, s in zip(move, size, strict=True)
              for t in corners(SQUARE * s * sign + m + np.array([0, 0, 7]))]  # fmt: skip
    np.testing.assert_allclose(triangles(mesh), wanted, atol=1e-6)
    assert mesh.object_id.tolist() == [0, 0, 1, 1, 2, 2]


def test_a_shared_array_is_not_copied_for_every_mesh(tmp_path):
    g = Gltf()
    n = 3000
    points = g.accessor(np.random.default_rng(1).normal(size=(n, 3)).astype("<f4"))
    for k in range(n // 3):
        g.node(mesh=g.mesh(points, np.arange(3 * k, 3 * k + 3, dtype="<u2")))
    assert len(read(g, tmp_path).vertices) == n
    g = Gltf()
    points = g.accessor(SQUARE)
    mesh = g.mesh(points)
    g.tree["meshes"][mesh]["primitives"] *= 50
    g.node(mesh=mesh)
    found = read(g, tmp_path)
    assert len(found.vertices) == 4
    assert found.object_id.max() == 49


def test_a_byte_order_mark_is_passed_over(tmp_path):
    path = square().write(tmp_path / "m.gltf")
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert len(hrt.read_mesh(path)) == 2


def test_required_extensions_are_honoured(tmp_path):
    g = square()
    g.tree["extensionsUsed"] = ["ACME_voxels", "KHR_materials_unlit"]
    g.tree["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform"]
    assert len(read(g, tmp_path)) == 2
    g.tree["extensionsRequired"].append("ACME_voxels")
    refused(g.write(tmp_path / "m.gltf"), "it requires ACME_voxels, which cannot be read")


CHANGES = {
    "asset": (None, "no asset"),
    "asset.version": ("1.0", "glTF '1.0' cannot be read"),
    "asset.minVersion": ("2.1", "glTF '2.1' cannot be read"),
    "accessors.0.count": (10**12, "limit"),
    "accessors.0.byteOffset": (4, "accessors[0]: it ends at"),
    "accessors.0.componentType": (5130, "5130 is no component type"),
    "accessors.0.type": ("VEC2", "expected an accessor of type VEC3, got VEC2"),
    "accessors.0.bufferView": (9, "there is no number 9"),
    "accessors.1.componentType": (5126, "expected unsigned integers"),
    "accessors.1.count": (5, "triangles of 5 corners"),
    "bufferViews.0.byteLength": (10**9, "it ends at byte"),
    "bufferViews.0.byteStride": (4, "byteStride 4 is less than an element"),
    "bufferViews.0.buffer": (1, "there is no number 1"),
    "buffers.0.byteLength": (10**9, "truncated: it says"),
    "meshes.0.primitives.0.attributes": ({}, "no POSITION"),
    "meshes.0.primitives.0.indices": (True, "expected an integer"),
    "scene": (3, "scene: there is no number 3"),
    "nodes.0": ([], "nodes[0]: expected an object, got []"),
}


@pytest.mark.parametrize("key", list(CHANGES))
def test_broken_trees_are_named(tmp_path, key):
    path = square().write(tmp_path / "m.gltf")
    tree = json.loads(path.read_text())
    *way, last = (int(word) if word.isdigit() else word for word in key.split("."))
    at = tree
    for word in way:
        at = at[word]
    value, message = CHANGES[key]
    if value is None:
        del at[last]
    else:
        at[last] = value
    if key == "accessors.0.count":
        del tree["accessors"][0]["bufferView"]
    path.write_text(json.dumps(tree))
    refused(path, message)


def test_indices_and_positions_that_make_no_sense(tmp_path):
    g = Gltf()
    g.node(mesh=g.mesh(indices=np.array([0, 1, 4], "<u2")))
    refused(g.write(tmp_path / "m.gltf"), "primitives[0].indices: takes vertex 4 of 4")
    g = Gltf()
    g.node(mesh=g.mesh(SQUARE * np.float32(np.nan)))
    refused(g.write(tmp_path / "m.gltf"), "attributes.POSITION: position 0 is not finite")
    g = square(scale=[1e300, 1e300, 1e300])
    refused(g.write(tmp_path / "m.gltf"), "vertices: expected finite")


def test_every_cut_of_a_binary_file_is_noticed(tmp_path):
    path = square().write(tmp_path / "m.glb")
    data = path.read_bytes()
    for size in range(0, len(data), 7):
        path.write_bytes(data[:size])
        refused(path)
    path.write_bytes(data[:4] + b"\1\0\0\0" + data[8:])
    refused(path, "version 1")


def test_deeply_nested_json_is_refused(tmp_path):
    (tmp_path / "m.gltf").write_text('{"asset": ' + "[" * 100000)
    refused(tmp_path / "m.gltf", "JSON")
    (tmp_path / "m.gltf").write_text('{"asset": {"version": ' + "[" * 800 + "]" * 800 + "}}")
    refused(tmp_path / "m.gltf", "asset.version: expected a string")
