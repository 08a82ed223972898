"""Both kinds of .stl, told apart by what they are and not by their first word."""

import numpy as np
import pytest

import hybrid_rt as hrt
from support.meshfiles import refused, triangles

FACET = (
    "facet normal 0 0 1\nouter loop\n"
    "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 {z}\nendloop\nendfacet\n"
)
TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def ascii_text(name=""):
    """Return two triangles."""
    return f"solid {name}\n" + FACET.format(z=0) + FACET.format(z=1) + f"endsolid {name}\n"


def binary(corners, head=b"", stated=None):
    """Return a binary file."""
    rows = np.zeros(len(corners), [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    rows["c"] = corners
    count = len(corners) if stated is None else stated
    return head.ljust(80, b" ") + np.uint32(count).tobytes() + rows.tobytes()


WAYS = {
    "plain": ascii_text("a b"),
    "tabs": ascii_text("x").replace("vertex ", "\t vertex\t").replace("\n", " \n\t"),
    "Windows": ascii_text("x").replace("\n", "\r\n"),
    "old Mac": ascii_text("x").replace("\n", "\r"),
    "capitals": ascii_text("x").upper(),
    "no name": ascii_text().replace("solid ", "solid"),
    "one line a facet": "solid\n" + (FACET.format(z=0).replace("\n", " ") + "\n")
    + FACET.format(z=1)
    + "endsolid",
    "normals that are none": ascii_text("x").replace("normal 0 0 1", "normal nan -nan(ind) 1.#IND"),
    "words of the format in its name": ascii_text("facet normal endsolid vertex"),
}  # fmt: skip


@pytest.mark.parametrize("way", list(WAYS))
def test_ascii(tmp_path, way):
    (tmp_path / "m.stl").write_text(WAYS[way])
    assert triangles(hrt.read_mesh(tmp_path / "m.stl")) == [TRIANGLE, [*TRIANGLE[:2], [0, 1, 1]]]


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8", "utf-8-sig", "utf-16"])
def test_names_of_any_encoding(tmp_path, encoding):
    (tmp_path / "m.stl").write_bytes(ascii_text("Körper").encode(encoding))
    assert len(hrt.read_mesh(tmp_path / "m.stl")) == 2


def test_solids_are_objects(tmp_path):
    (tmp_path / "m.stl").write_text(ascii_text("a") + "solid e\nendsolid\n\n" + ascii_text("b"))
    assert hrt.read_mesh(tmp_path / "m.stl").object_id.tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize("head", [b"", b"solid x", b"solid facet normal", b"\xff\xfe\0", b"COLOR="])
def test_binary_whatever_its_header(tmp_path, head):
    corners = np.random.default_rng(1).normal(size=(20, 3, 3)).astype("<f4")
    (tmp_path / "m.stl").write_bytes(binary(corners, head))
    assert triangles(hrt.read_mesh(tmp_path / "m.stl")) == corners.tolist()


def test_binary_of_another_length_than_it_says(tmp_path):
    corners = np.zeros((5, 3, 3))
    for stated in (0, 4, 6, 2**32 - 1):
        for head in (b"", b"solid x"):
            (tmp_path / "m.stl").write_bytes(binary(corners, head, stated))
            refused(tmp_path / "m.stl", f"the header says {stated} triangles")
    (tmp_path / "m.stl").write_bytes(binary(corners)[:70])
    refused(tmp_path / "m.stl", "truncated: 70 bytes")
    (tmp_path / "m.stl").write_bytes(binary(corners[:0]))
    refused(tmp_path / "m.stl", "no triangles")


def test_binary_that_is_not_finite(tmp_path):
    (tmp_path / "m.stl").write_bytes(binary(np.full((1, 3, 3), np.nan)))
    refused(tmp_path / "m.stl", "vertices: expected finite")


BROKEN = {
    ("vertex 1 0 0", "vertex 1 0"): "line 6, facet 0 of its solid",
    ("vertex 1 0 0", "vertex 1 0 0 0"): "line 5, facet 0 of its solid: expected vertex",
    ("vertex 1 0 0", "vertex 1 0,5 0"): "line 5, facet 0 of its solid: '0,5' is no finite number",
    ("vertex 1 0 0", "vertex 1 nan 0"): "line 5, facet 0 of its solid: 'nan'",
    ("endloop", "vertex 1 1 0\nendloop"): "line 7, facet 0 of its solid: expected endloop",
    ("endfacet\nendsolid", "endsolid"): "facet 1 of its solid: truncated",
    ("endsolid", "end solid"): "the last solid has no endsolid",
    ("endsolid x\n", ""): "the last solid has no endsolid",
    ("endsolid x\n", "endsolid x\nfacet"): "line 16: something follows endsolid",
    ("endsolid x\n", "solid y\nendsolid"): "line 16: solid within a solid",
}


@pytest.mark.parametrize("change", list(BROKEN))
def test_broken_text_is_named(tmp_path, change):
    text = ascii_text("x")
    assert change[0] in text
    (tmp_path / "m.stl").write_text(text.replace(*change, 1))
    refused(tmp_path / "m.stl", BROKEN[change])


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_every_cut_of_text_is_noticed(tmp_path, encoding):
    data = ascii_text("Körper" if encoding == "latin-1" else "x").encode(encoding)
    whole = data.rindex(b"endsolid") + len("endsolid")
    for size in range(0, whole, 3):
        (tmp_path / "m.stl").write_bytes(data[:size])
        refused(tmp_path / "m.stl")
