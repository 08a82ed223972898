"""Archives that claim more than they hold, or more than is allowed, are refused unopened."""

import io
import tracemalloc
import zipfile

import numpy as np
import pytest

import hybrid_rt as hrt
from support.meshfiles import refused

VERTICES = np.eye(3, dtype=np.float32)
FACES = np.array([[0, 1, 2]], np.int32)


def member(array):
    """Return an array as .npy bytes."""
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def claiming(shape, dtype="<f4", data=b"\0" * 36):
    """Return a .npy whose header is written by hand."""
    head = f"{{'descr': {dtype!r}, 'fortran_order': False, 'shape': {shape}, }}"
    head = head.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode() + data


def write(path, **members):
    """Write an archive of raw members."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return path


CLAIMS = {
    "(1000000000000, 3)": "12000000000000 bytes, and 36 bytes follow",
    f"({10**30}, 3)": "bytes, and 36 bytes follow",
    "(-3, 3)": "truncated or corrupt",
    "(2, 3)": "24 bytes, and 36 bytes follow",
    "(4, 3)": "48 bytes, and 36 bytes follow",
    "'x'": "not a plain numeric array",
}


@pytest.mark.parametrize("shape", list(CLAIMS))
def test_claims_are_checked_before_memory_is_taken(tmp_path, shape):
    path = write(tmp_path / "m.npz", vertices=claiming(shape), faces=member(FACES))
    tracemalloc.start()
    refused(path, "vertices.npy", CLAIMS[shape])
    assert tracemalloc.get_traced_memory()[1] < 10 << 20
    tracemalloc.stop()


def test_a_zip_bomb_is_refused_and_the_limit_can_be_raised(tmp_path, monkeypatch):
    size = 40 << 20
    bomb = claiming(f"({size // 12}, 3)", data=b"\0" * (size // 12 * 12))
    path = write(tmp_path / "m.npz", vertices=bomb, faces=member(FACES))
    assert path.stat().st_size < size // 100
    with pytest.raises(hrt.MeshFileError, match=f"limit of {10 << 20}; raise max_bytes"):
        hrt.read_mesh(path, max_bytes=10 << 20)
    monkeypatch.setenv("HYBRID_RT_MAX_MESH_BYTES", str(20 << 20))
    refused(path, f"limit of {20 << 20}", "HYBRID_RT_MAX_MESH_BYTES")
    assert len(hrt.read_mesh(path, max_bytes=100 << 20)) == 1
    monkeypatch.setenv("HYBRID_RT_MAX_MESH_BYTES", "much")
    with pytest.raises(hrt.MeshFileError, match=r"HYBRID_RT_MAX_MESH_BYTES.*'much'"):
        hrt.load_scene(path)
    with pytest.raises(hrt.ArgumentError, match="max_bytes"):
        hrt.read_mesh(path, max_bytes=0)


def test_the_limit_holds_for_every_format(tmp_path):
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(hrt.MeshFileError, match=r"m\.obj: the file: 32 bytes .* limit of 31"):
        hrt.read_mesh(tmp_path / "m.obj", max_bytes=31)
    assert len(hrt.load_scene(tmp_path / "m.obj", max_bytes=32)) == 1


def test_encrypted_members_are_refused(tmp_path):
    path = write(tmp_path / "m.npz", vertices=member(VERTICES), faces=member(FACES))
    data = bytearray(path.read_bytes())
    for mark, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        data[data.index(mark) + at] |= 1
    path.write_bytes(data)
    refused(path, "vertices.npy: encrypted")


def test_objects_are_never_unpickled(tmp_path):
    faces = member(np.array([[0, 1, 2], None], dtype=object))
    path = write(tmp_path / "m.npz", vertices=member(VERTICES), faces=faces)
    refused(path, "faces.npy: holds Python objects", "allow_pickle")


def test_polygon_ids_are_kept(tmp_path):
    np.savez(tmp_path / "m.npz", vertices=VERTICES, faces=[[0, 1, 2]] * 4, polygon_id=[0, 0, 1, 5])
    assert hrt.load_scene(tmp_path / "m.npz").polygon_id.tolist() == [0, 0, 1, 5]
    np.savez(tmp_path / "m.npz", vertices=VERTICES, faces=[[0, 1, 2]] * 4, polygon_id=[0, 0])
    refused(tmp_path / "m.npz", "polygon_id: expected 4 rows")


def test_arrays_in_either_order_and_byte_order(tmp_path):
    vertices = np.asfortranarray(np.random.default_rng(1).normal(size=(9, 3)).astype(">f8"))
    faces = np.arange(9).reshape(3, 3).astype(">u2")
    np.savez_compressed(tmp_path / "m.npz", vertices=vertices, faces=faces)
    mesh = hrt.read_mesh(tmp_path / "m.npz")
    np.testing.assert_array_equal(mesh.vertices, vertices.astype(np.float32))
    np.testing.assert_array_equal(mesh.faces, faces)
