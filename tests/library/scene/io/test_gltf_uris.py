"""Buffers of glTF files are found where they may be, and nowhere else."""

import base64
import os
from urllib.parse import quote

import pytest

import hybrid_rt as hrt
from support.gltf import HALVES, SQUARE, Gltf
from support.meshfiles import refused, triangles

WANTED = SQUARE[HALVES.reshape(2, 3)].tolist()


def square():
    """Return a file with one square."""
    g = Gltf()
    g.node(mesh=g.mesh())
    return g


@pytest.mark.parametrize("name", ["a b.bin", "ä.bin", "sub/x.bin", "100%.bin", "a+b.bin"])
@pytest.mark.parametrize("encoded", [True, False])
def test_buffers_beside_the_file(tmp_path, name, encoded):
    g = square()
    (tmp_path / "sub").mkdir()
    (tmp_path / name).write_bytes(g.blob + b"more")
    uri = quote(name) if encoded or "%" in name else name
    g.tree["buffers"] = [{"byteLength": len(g.blob), "uri": uri}]
    mesh = hrt.read_mesh(g.write(tmp_path / "m.gltf"))
    assert triangles(mesh) == WANTED


URIS = {
    "../secret.bin": "leads out of",
    "sub/../../secret.bin": "leads out of",
    "%2e%2e/secret.bin": "leads out of",
    "sub/..%2f..%2fsecret.bin": "leads out of",
    "/etc/passwd": "expected a relative path",
    "%2Fetc/passwd": "expected a relative path",
    "//server/x.bin": "expected a relative path",
    "C:\\x.bin": "no other scheme",
    "..\\secret.bin": "expected a relative path",
    "file:///etc/passwd": "no other scheme than data:",
    "http://example.org/x.bin": "no other scheme than data:",
    "link.bin": "leads out of",
    "folder/secret.bin": "leads out of",
    "absent.bin": "no such regular file",
    "sub": "no such regular file",
    "pipe": "no such regular file",
    "": "no such regular file",
    "a\0b": "expected a relative path",
    "x" * 5000: "buffers[0].uri",
    "data:application/octet-stream;base64,@@@": "corrupt base64",
    "data:application/octet-stream;base64": "without data",
    "data:;base64,AAAA": "truncated: it says",
}


@pytest.mark.parametrize("uri", list(URIS), ids=lambda u: u[:24].replace("\0", "0"))
def test_no_other_file_is_ever_opened(tmp_path, uri):
    folder = tmp_path / "inside"
    (folder / "sub").mkdir(parents=True)
    g = square()
    (tmp_path / "secret.bin").write_bytes(g.blob)
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    (folder / "folder").symlink_to(tmp_path)
    os.mkfifo(folder / "pipe")
    g.tree["buffers"] = [{"byteLength": len(g.blob), "uri": uri}]
    refused(g.write(folder / "m.gltf"), URIS[uri])


def test_data_uris_of_every_form(tmp_path):
    g = square()
    coded = base64.b64encode(g.blob).decode()
    for uri in (
        f"data:;base64,{coded}",
        f"DATA:x/y;BASE64,{coded.rstrip('=')}",
        f"data:,{quote(g.blob)}",
    ):
        g.tree["buffers"] = [{"byteLength": len(g.blob), "uri": uri}]
        mesh = hrt.read_mesh(g.write(tmp_path / "m.gltf"))
        assert triangles(mesh) == WANTED
