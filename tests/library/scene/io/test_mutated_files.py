"""Random files are read back exactly, and damaged ones give a mesh or a named error."""

import os
import zlib

import numpy as np
import plyfile
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybrid_rt as hrt
from hybrid_rt.scene.io import read_cameras
from support.gltf import Gltf

ROUNDS = 2000 if os.environ.get("HYBRID_RT_FUZZ") else 60


def soup(rng, n_vertices, n_faces):
    """Return float32 vertices of all magnitudes, and triangles."""
    scale = 10.0 ** rng.integers(-6, 7)
    vertices = (rng.normal(size=(n_vertices, 3)) * scale).astype(np.float32)
    return vertices, rng.integers(0, n_vertices, (n_faces, 3))


def write_obj(path, vertices, faces, rng):
    """Write vertices and faces in turns, with indices of either sign."""
    blank = rng.choice([" ", "\t", "  ", " \\\n"])
    lines, done = [], 0
    for k, corners in enumerate(faces):
        need = int(corners.max()) + 1
        for v in vertices[done:need]:
            lines.append(f"v{blank}" + blank.join(f"{x:.9g}" for x in v))
        done = max(done, need)
        form = ("{0}", "{0}/1", "{0}//1", "{0}/1/1")[k % 4]
        written = corners - done if rng.random() < 0.5 else corners + 1
        lines.append(f"f{blank}" + blank.join(form.format(i) for i in written))
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices[done:]]
    path.write_text(rng.choice(["\n", "\r\n"]).join(lines) + "\n", newline="")


def write_ply(path, vertices, faces, rng):
    """Write by plyfile."""
    points = np.array(list(map(tuple, vertices)), [(a, "f4") for a in "xyz"])
    rows = np.empty(len(faces), [("vertex_indices", "i4", 3)])
    rows["vertex_indices"] = faces
    elements = [
        plyfile.PlyElement.describe(points, "vertex"),
        plyfile.PlyElement.describe(rows, "face"),
    ]
    rng.shuffle(elements)
    form = ({"text": True}, {"byte_order": "<"}, {"byte_order": ">"})[rng.integers(3)]
    plyfile.PlyData(elements, **form).write(str(path))


def write_stl(path, vertices, faces, rng):
    """Write either form."""
    corners = vertices[faces]
    if rng.random() < 0.5:
        rows = np.zeros(len(faces), [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
        rows["c"] = corners
        path.write_bytes(b"solid".ljust(80) + np.uint32(len(faces)).tobytes() + rows.tobytes())
        return
    lines = ["solid s"]
    for triangle in corners:
        lines += ["facet normal 0 0 0", " outer loop"]
        lines += ["  vertex {:.9g} {:.9g} {:.9g}".format(*p) for p in triangle]
        lines += [" endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid s"]))


def write_gltf(path, vertices, faces, rng):
    """Write one node, with a camera."""
    g = Gltf()
    kind = rng.choice(["u2", "u4"])
    g.node(mesh=g.mesh(vertices, faces.ravel().astype(kind)), camera=0)
    g.add("cameras", type="perspective", perspective={"yfov": 1.0, "znear": 0.1})
    g.write(path)


def write_npz(path, vertices, faces, rng):
    """Write by NumPy."""
    save = np.savez if rng.random() < 0.5 else np.savez_compressed
    save(path, vertices=vertices, faces=faces)


WRITERS = {".obj": write_obj, ".ply": write_ply, ".stl": write_stl, ".gltf": write_gltf,
           ".glb": write_gltf, ".npz": write_npz}  # fmt: skip


@pytest.mark.parametrize("suffix", list(WRITERS))
@settings(max_examples=ROUNDS // 2, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n_vertices=st.integers(1, 60), n_faces=st.integers(1, 90))
def test_what_was_written_is_read(tmp_path_factory, suffix, seed, n_vertices, n_faces):
    rng = np.random.default_rng(seed)
    vertices, faces = soup(rng, n_vertices, n_faces)
    path = tmp_path_factory.getbasetemp() / f"written{suffix}"
    WRITERS[suffix](path, vertices, faces, rng)
    mesh = hrt.read_mesh(path)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], vertices[faces])


def mutated(rng, data):
    """Return bytes with some changed, taken out, doubled or cut off."""
    data = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        at, n = int(rng.integers(len(data) + 1)), int(rng.integers(1, 9))
        match rng.integers(6):
            case 0:
                data[at : at + n] = rng.bytes(n)
            case 1:
                del data[at : at + n]
            case 2:
                data[at:at] = data[at : at + n]
            case 3:
                data[at : at + 1] = bytes(
                    rng.choice(list(b'0123456789-+.eE/ \n"[]{},#\\'), 1).tolist()
                )
            case 4 if len(data):
                data[at % len(data)] ^= 1 << int(rng.integers(8))
            case 5 if rng.random() < 0.1:
                del data[at:]
    return bytes(data)


@pytest.mark.parametrize("suffix", list(WRITERS))
def test_damaged_files_give_a_mesh_or_a_named_error(tmp_path, suffix):
    rng = np.random.default_rng(zlib.crc32(suffix.encode()))
    path = tmp_path / f"m{suffix}"
    refusals = []
    for _ in range(ROUNDS):
        WRITERS[suffix](path, *soup(rng, 9, 7), rng)
        path.write_bytes(mutated(rng, path.read_bytes()))
        for reader in (hrt.read_mesh, *([read_cameras] if suffix.startswith(".gl") else [])):
            try:
                reader(path, max_bytes=1 << 24)
            except hrt.MeshFileError as error:
                refusals.append(str(error))
    assert refusals
    assert all(str(path) in text for text in refusals)
    assert not [text for text in refusals if "no check foresaw" in text]
