"""Compressed glTF is read where the libraries of its extras are, and refused by name else."""

import sys

import numpy as np
import pytest

import hybrid_rt as hrt
from support.gltf import HALVES, SQUARE, TYPES, Gltf
from support.meshfiles import refused, triangles

GRID = np.stack(np.meshgrid(np.arange(9), np.arange(7), [0]), axis=-1).reshape(-1, 3).astype("<f4")
CELLS = np.array([[a, a + 1, a + 9] for a in range(45)], "<u4")


def draco(positions=GRID, faces=CELLS, fallback=False, **more):
    """Return a file whose geometry Google's encoder packed."""
    library = pytest.importorskip("DracoPy")
    data = library.encode(positions, faces, preserve_order=True, quantization_bits=14)
    g = Gltf()
    code = {
        "componentType": TYPES[positions.dtype.str[1:]],
        "type": "VEC3",
        "count": len(positions),
    }
    k = g.accessor(positions) if fallback else g.add("accessors", **code, **more)
    g.node(mesh=g.mesh(k, None))
    g.primitive()["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": g.view(data), "attributes": {"POSITION": 0}}
    }
    if not fallback:
        g.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return g


def test_draco(tmp_path):
    mesh = hrt.read_mesh(draco().write(tmp_path / "m.glb"))
    np.testing.assert_allclose(triangles(mesh), GRID[CELLS], atol=8 / 2**13)


def test_draco_with_a_fallback_uses_that(tmp_path):
    g = draco(fallback=True)
    g.primitive()["indices"] = g.accessor(CELLS.ravel())
    assert triangles(hrt.read_mesh(g.write(tmp_path / "m.glb"))) == GRID[CELLS].tolist()


def test_broken_draco_is_named(tmp_path):
    g = draco()
    g.tree["bufferViews"][0]["byteLength"] = 40
    refused(g.write(tmp_path / "m.glb"), "corrupt Draco data")
    g = draco()
    g.primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 4
    refused(g.write(tmp_path / "m.glb"), "the Draco data has no attribute 4")
    g = draco()
    g.primitive()["mode"] = 5
    refused(g.write(tmp_path / "m.glb"), "Draco with another mode than triangles")


def meshopt(name="EXT_meshopt_compression", sequence=False):
    """Return a file whose buffer views meshoptimizer packed."""
    library = pytest.importorskip("meshoptimizer")
    g = Gltf()
    packed = [library.encode_vertex_buffer(SQUARE, 4, 12)]
    if sequence:
        packed.append(library.encode_index_sequence(HALVES.astype(np.uint32), 6, 4))
    else:
        packed.append(library.encode_index_buffer(HALVES.astype(np.uint32), 6, 4))
    modes = ("ATTRIBUTES", "INDICES" if sequence else "TRIANGLES")
    for data, mode, count, stride in zip(packed, modes, (4, 6), (12, 2), strict=True):
        k = g.view(bytes(data))
        view = dict(g.tree["bufferViews"][k])
        extension = {**view, "mode": mode, "count": count, "byteStride": stride}
        g.tree["bufferViews"][k] = {
            "buffer": 1, "byteOffset": 0, "byteLength": count * stride,
            "extensions": {name: extension},
        }  # fmt: skip
    g.add("accessors", bufferView=0, count=4, componentType=5126, type="VEC3")
    g.add("accessors", bufferView=1, count=6, componentType=5123, type="SCALAR")
    g.add("meshes", primitives=[{"attributes": {"POSITION": 0}, "indices": 1}])
    g.node(mesh=0)
    g.tree["buffers"] = [{"byteLength": len(g.blob)}, {"byteLength": 60}]
    g.tree["extensionsRequired"] = [name]
    return g


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
@pytest.mark.parametrize("sequence", [True, False])
def test_meshopt(tmp_path, name, sequence):
    mesh = hrt.read_mesh(meshopt(name, sequence).write(tmp_path / "m.glb"))
    assert sorted(map(sorted, triangles(mesh))) == sorted(
        map(sorted, SQUARE[HALVES.reshape(2, 3)].tolist())
    )


def test_meshopt_with_a_fallback_uses_that(tmp_path, monkeypatch):
    g = meshopt()
    plain = SQUARE.tobytes() + HALVES.tobytes()
    (tmp_path / "plain.bin").write_bytes(plain)
    g.tree["buffers"][1]["uri"] = "plain.bin"
    g.tree["bufferViews"][1]["byteOffset"] = 48
    monkeypatch.setitem(sys.modules, "meshoptimizer", None)
    mesh = hrt.read_mesh(g.write(tmp_path / "m.glb"))
    assert triangles(mesh) == SQUARE[HALVES.reshape(2, 3)].tolist()


WRONG = {"mode": ("X", "mode X"), "filter": ("OCTAHEDRAL", "filter OCTAHEDRAL"),
         "byteStride": (10, "byteStride 10"), "count": (10**12, "limit"),
         "byteLength": (8, "corrupt data")}  # fmt: skip


@pytest.mark.parametrize("key", list(WRONG))
def test_broken_meshopt_is_named(tmp_path, key):
    g = meshopt()
    g.tree["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = WRONG[key][0]
    refused(g.write(tmp_path / "m.glb"), "EXT_meshopt_compression", WRONG[key][1])


@pytest.mark.parametrize(
    ("library", "extra", "make"),
    [("DracoPy", "draco", draco), ("meshoptimizer", "meshopt", meshopt)],
)
def test_without_the_library_it_is_named(tmp_path, monkeypatch, library, extra, make):
    path = make().write(tmp_path / "m.glb")
    monkeypatch.setitem(sys.modules, library, None)
    refused(path, f'needs {library}: pip install "hybrid-rt[{extra}]"')
