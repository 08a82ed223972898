"""Every kind of .ply is read as plyfile reads it, or refused with the element and row."""

import numpy as np
import plyfile
import pytest

import hybrid_rt as hrt
from support.meshfiles import area, refused, triangles

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
HEAD = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face {n}\nproperty list uchar int vertex_indices\nend_header\n"
)
ROWS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
FORMS = {"ascii": {"text": True}, "little": {"byte_order": "<"}, "big": {"byte_order": ">"}}


def write(path, form, *elements, comments=()):
    """Write by plyfile."""
    plyfile.PlyData(list(elements), comments=list(comments), **FORMS[form]).write(str(path))
    return path


def vertex(points, kind="f4", **others):
    """Return the element vertex, with other properties around x, y and z."""
    names = [("a", "u1"), ("x", kind), ("y", kind), ("nan", "f4"), ("z", kind), ("b", "f8")]
    data = np.zeros(len(points), names)
    for k, axis in enumerate("xyz"):
        data[axis] = np.asarray(points)[:, k]
    data["nan"] = np.nan
    return plyfile.PlyElement.describe(data, "vertex")


def face(polygons, name="vertex_indices", kind="i4", length="u1", element="face"):
    """Return the element face, with other properties and lists around that of the vertices."""
    fields = [("flag", "u1"), ("uv", object), (name, object), ("area", "f4")]
    data = np.empty(len(polygons), fields)
    for k, polygon in enumerate(polygons):
        uv = np.arange(len(polygon), dtype="f4")
        data[k] = (k % 256, uv, np.array(polygon, kind), 0.5)
    types = {"uv": "f4", name: kind}
    return plyfile.PlyElement.describe(
        data, element, val_types=types, len_types={"uv": "u1", name: length}
    )


@pytest.mark.parametrize("form", list(FORMS))
@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"])
def test_all_types(tmp_path, form, kind):
    index = "i4" if kind[0] == "f" else kind
    length = index if index[0] == "u" else "u1"
    path = write(tmp_path / "m.ply", form, vertex(SQUARE, kind),
                 face([[0, 1, 2], [0, 2, 3]], kind=index, length=length))  # fmt: skip
    assert triangles(hrt.read_mesh(path)) == [
        [SQUARE[k] for k in f] for f in ([0, 1, 2], [0, 2, 3])
    ]


@pytest.mark.parametrize("form", list(FORMS))
@pytest.mark.parametrize("seed", range(4))
def test_mixed_polygons_beside_other_elements_in_any_order(tmp_path, form, seed):
    rng = np.random.default_rng(seed)
    points, polygons = [], []
    for k in range(60):
        n = int(rng.integers(3, 7))
        angle = 2 * np.pi * np.arange(n) / n
        polygons.append((np.arange(n) + len(points)).tolist())
        points += np.column_stack([np.cos(angle), np.sin(angle), 0 * angle + k]).tolist()
    points = np.asarray(points, np.float32)
    edge = plyfile.PlyElement.describe(np.zeros(7, [("vertex1", "i4"), ("vertex2", "i4")]), "edge")
    notes = face([[1], [2, 3], []], name="stuff", element="notes")
    elements = [
        vertex(points),
        edge,
        notes,
        face(polygons, ["vertex_indices", "vertex_index"][seed % 2]),
    ]
    rng.shuffle(elements)
    mesh = hrt.read_mesh(write(tmp_path / "m.ply", form, *elements, comments=["one"]))
    wanted = [[p[0], p[k], p[k + 1]] for p in polygons for k in range(1, len(p) - 1)]
    np.testing.assert_array_equal(mesh.faces, wanted)
    np.testing.assert_array_equal(mesh.vertices, points)
    counts = [len(p) - 2 for p in polygons]
    np.testing.assert_array_equal(mesh.polygon_id, np.repeat(np.arange(60), counts))


@pytest.mark.parametrize("form", list(FORMS))
def test_strips(tmp_path, form):
    points = [[k // 2, k % 2, 0] for k in range(8)]
    strips = face([[0, 1, 2, 3, 4, -1, 7, 6, 5, -1], [2, 3, 4]], element="tristrips")
    mesh = hrt.read_mesh(write(tmp_path / "m.ply", form, vertex(points), strips))
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2], [2, 3, 4], [7, 6, 5], [2, 3, 4]]


def test_concave_faces(tmp_path):
    points = [(0, 0, 0), (4, 0, 0), (4, 1, 0), (1, 1, 0), (1, 4, 0), (0, 4, 0)]
    path = write(tmp_path / "m.ply", "little", vertex(points), face([[1, 2, 3, 4, 5, 0]]))
    assert area(hrt.read_mesh(path)) == 7


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("comment", [b"K\xf6rper", "Körper".encode(), b"end_header of it", b""])
def test_comments_of_any_encoding_and_lines_of_any_end(tmp_path, ends, comment):
    text = (HEAD.format(n=1) + ROWS + "4 0 1 2 3\n").encode()
    text = text.replace(b"element v", b"comment " + comment + b"\nobj_info x\nelement v", 1)
    (tmp_path / "m.ply").write_bytes(text.replace(b"\n", ends.encode()))
    assert len(hrt.read_mesh(tmp_path / "m.ply")) == 2
    binary = write(tmp_path / "b.ply", "little", vertex(SQUARE), face([[0, 1, 2, 3]])).read_bytes()
    head, mark, body = binary.partition(b"end_header\n")
    head = head.replace(b"element v", b"comment " + comment + b"\nelement v", 1)
    (tmp_path / "b.ply").write_bytes((head + mark).replace(b"\n", ends.encode()) + body)
    assert len(hrt.read_mesh(tmp_path / "b.ply")) == 2


def test_ascii_rows_may_be_broken_anywhere(tmp_path):
    words = (ROWS + "4 0 1 2 3\n").split()
    for text in (" ".join(words), "\n".join(words), "\t".join(words) + "\n\n"):
        (tmp_path / "m.ply").write_text(HEAD.format(n=1) + text)
        assert len(hrt.read_mesh(tmp_path / "m.ply")) == 2


BROKEN = {
    "4 0 1 2\n": "element face, row 0: its line has more or fewer words",
    "4 0 1 2 3 7\n": "element face, row 0: its line has more or fewer words",
    "4 0 1 2 4\n": "element face, row 0: no vertex 4, there are 4",
    "4 0 1 2 -1\n": "element face, row 0: no vertex -1",
    "4 0 1 2 1.5\n": "element face, row 0: no vertex 1.5",
    "4 0 1 2 x\n": "element face, row 0: no vertex nan",
    "2 0 1\n": "element face, row 0: a face of 2 corners",
    "-1 0 1\n": "element face, row 0: a list of length -1",
    "1.5 0 1\n": "element face, row 0: a list of length 1.5",
    "": "truncated: the header says 1 rows of element face, the file has 0",
    "4 0 1 2 3\n0\n": "1 words follow the last row",
}


@pytest.mark.parametrize("row", list(BROKEN))
def test_broken_rows_are_named(tmp_path, row):
    (tmp_path / "m.ply").write_text(HEAD.format(n=1) + ROWS + row)
    refused(tmp_path / "m.ply", BROKEN[row])


def test_broken_vertices_are_named(tmp_path):
    for bad in ("nan", "inf", "a", "1e999", "1_0"):
        rows = ROWS.replace("1 1 0", f"1 {bad} 0")
        (tmp_path / "m.ply").write_text(HEAD.format(n=1) + rows + "4 0 1 2 3\n")
        refused(tmp_path / "m.ply", "element vertex, row 2: not a finite position")


HEADERS = {
    ("format ascii 1.0\n", "format ascii 2.0\n"): "line 2: 'format ascii 2.0'",
    ("format ascii 1.0\n", ""): "names no format",
    ("format ascii 1.0\n", "format ascii 1.0\nformat ascii 1.0\n"): "line 3",
    ("property float x", "property float16 x"): "line 4",
    ("property float x\n", ""): "element vertex, row 0: its line has more or fewer words",
    ("property float x\n", "property float w\n"): "element vertex: no property x",
    ("property float x", "property list uchar float x"): "element vertex, row 1: its line",
    ("property float x", "property float y"): "two properties of one name",
    ("vertex_indices", "corners"): "no property list vertex_indices",
    ("list uchar int", "list float int"): "line 8",
    ("element vertex 4", "element vertex -4"): "line 3",
    ("element vertex 4", "element vertex 1e3"): "line 3",
    ("element vertex 4", "element vertex 1000000000000"): "truncated",
    ("element face 1", "element face 1000000000000"): "truncated",
    ("element face 1", "element vertex 1"): "a second element vertex",
    ("end_header", "end"): "no end_header",
    ("ply\n", "PLY\n"): "not a .ply file",
}


@pytest.mark.parametrize("change", list(HEADERS))
def test_broken_headers_are_named(tmp_path, change):
    text = (HEAD.format(n=1) + ROWS + "4 0 1 2 3\n").replace(*change, 1)
    (tmp_path / "m.ply").write_text(text)
    refused(tmp_path / "m.ply", HEADERS[change])


@pytest.mark.parametrize("form", list(FORMS))
def test_every_cut_is_noticed(tmp_path, form):
    path = write(
        tmp_path / "m.ply", form, vertex(SQUARE), face([[0, 1, 2], [0, 1, 2, 3], [1, 2, 3]])
    )
    data = path.read_bytes()
    for size in range(0, len(data) - 5 if form == "ascii" else len(data), 3):
        path.write_bytes(data[:size])
        refused(path)


def test_more_bytes_than_the_header_says_are_refused(tmp_path):
    path = write(tmp_path / "m.ply", "little", vertex(SQUARE), face([[0, 1, 2]]))
    path.write_bytes(path.read_bytes() + b"\r\n")
    assert len(hrt.read_mesh(path)) == 1
    path.write_bytes(path.read_bytes() + b"x")
    refused(path, "bytes follow the last row")


def test_points_and_range_grids_are_no_triangles(tmp_path):
    refused(write(tmp_path / "m.ply", "little", vertex(SQUARE)), "no triangles", "4 rows of vertex")
    grid = face([[0], [1], []], element="range_grid")
    refused(write(tmp_path / "m.ply", "big", vertex(SQUARE), grid), "no triangles", "range_grid")
