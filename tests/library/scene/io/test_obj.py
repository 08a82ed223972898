"""Every kind of .obj that people have is read as it is meant, or refused with its line."""

import time

import numpy as np
import pytest

import hybrid_rt as hrt
from support.meshfiles import area, refused, triangles

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"
FIRST, SECOND = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]
BOTH = CORNERS + "f 1 2 3\nf 2 4 3\n"

WRITTEN = {
    "plain": BOTH,
    "tabs": BOTH.replace(" ", "\t"),
    "many blanks": BOTH.replace(" ", " \t  "),
    "indented": "".join(f" \t {line}\n" for line in BOTH.splitlines()),
    "trailing blanks": BOTH.replace("\n", " \t \n"),
    "form feeds and vertical tabs": BOTH.replace(" ", "\f\v"),
    "no newline at the end": BOTH.rstrip("\n"),
    "empty lines": BOTH.replace("\n", "\n\n \n"),
    "lines of Windows": BOTH.replace("\n", "\r\n"),
    "lines of the old Mac": BOTH.replace("\n", "\r"),
    "relative": CORNERS + "f -4 -3 -2\nf -3 -1 -2\n",
    "relative, before later vertices": "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    "f -3 -2 -1\nv 1 1 0\nf -3 -1 -2\n",
    "relative texture": CORNERS + "vt 0 0\nf -4/-1 -3/-1 -2/-1\nf -3//-1 -1//-1 -2//-1\n",
    "continued": BOTH.replace("1 2 3", "1 \\\n 2\\\n 3").replace("v 1 1", "v \\\n1 \\\n1"),
    "continued, Windows": BOTH.replace("1 2 3", "1 \\\n2 \\\n3").replace("\n", "\r\n"),
    "continued names": "g a \\\n b\n" + BOTH,
    "a name that ends in a backslash": "mtllib C:\\models\\\n" + BOTH,
    "a comment that ends in a backslash": "# C:\\models\\\n" + BOTH,
    "a comment behind numbers, with backslash": BOTH.replace("v 1 1 0", "v 1 1 0 # \\"),
    "comments": "# f 1 2 3\n" + BOTH.replace("\n", "#1 2 3\n", 6),
    "indented comments": BOTH.replace("\n", "\n   # v 9 9 9\n"),
    "every optional column": CORNERS + "vt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1\nf 2 4/1/1 3\n",
    "trailing slashes": CORNERS + "f 1/ 2// 3/1/\nf 2 4 3\n",
    "weight": BOTH.replace(" 0\n", " 0 1.0\n", 4),
    "colour": BOTH.replace(" 0\n", " 0 0.5 0.25 1\n", 4),
    "colour of some": BOTH.replace(" 0\n", " 0 0.5 0.25 1\n", 1),
    "weight and colour": BOTH.replace(" 0\n", " 0 1 0.5 0.25 1\n", 4),
    "exponents": BOTH.replace("v 1 0 0", "v 1.0E+00 0e0 -0.").replace("v 0 1", "v .0 +1e-0"),
    "fo": BOTH.replace("f ", "fo "),
    "normals without use": "vn nan nan nan\nvt inf\n" + BOTH,
    "names with a #": "usemtl a#b\no # c\n" + BOTH,
    "smoothing, levels, materials": "s off\nlod 3\nmtllib absent.mtl\nusemtl x\n" + BOTH,
    "vertices after faces": "f 1 2 3\nf 2 4 3\n" + CORNERS,
}  # fmt: skip


@pytest.mark.parametrize("kind", list(WRITTEN))
def test_ways_of_writing(tmp_path, kind):
    (tmp_path / "m.obj").write_bytes(WRITTEN[kind].encode())
    assert triangles(hrt.read_mesh(tmp_path / "m.obj")) == [FIRST, SECOND]


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(tmp_path, encoding):
    text = "# Körper, größer\no Würfel\n" + BOTH
    (tmp_path / "m.obj").write_bytes(text.encode(encoding))
    assert triangles(hrt.read_mesh(tmp_path / "m.obj")) == [FIRST, SECOND]


def test_letters_that_no_encoding_has(tmp_path):
    (tmp_path / "m.obj").write_bytes(b"o \xff\xc3\x28\n# \xfe\n" + BOTH.encode())
    assert len(hrt.read_mesh(tmp_path / "m.obj")) == 2


BROKEN = {
    "v 1,5 0 0": "line 5: '1,5'",
    "v 1 0": "line 5: a vertex of 2 numbers",
    "v nan 0 0": "line 5: 'nan'",
    "v inf 0 0": "line 5: 'inf'",
    "v 1e999 0 0": "line 5: '1e999'",
    "v 1.2.3 0 0": "line 5: '1.2.3'",
    "v 0x10 0 0": "line 5: '0x10'",
    "v 1 2 3 4 5": "line 5: a vertex of 5 numbers",
    "v 1_0 0 0": "line 5: '1_0'",
    "f 1 2": "line 5: a face of fewer than 3 corners",
    "f 1 2 0": "line 5: a face takes vertex 0 of 4",
    "f 1 2 5": "line 5: a face takes vertex 5 of 4",
    "f 1 2 -5": "line 5: a face takes vertex 0 of 4",
    "f 1 2 1.5": "line 5: '1.5' is no corner",
    "f 1/1/1/1 2 3": "line 5: '1/1/1/1' is no corner",
    "f /1 2 3": "line 5: '/1' is no corner",
    "f 1/x 2 3": "line 5: '1/x' is no corner",
    "f 1 2 99999999999999999999999": "line 5: ",
    "f 1-2 3 4": "line 5: '1-2' is no corner",
    "surf 0 1 0 1 1 2 3": "line 5: free-form surfaces (surf)",
    "curv 0 1 1 2": "line 5: free-form curves (curv)",
    "curv2 1 2": "line 5: free-form curves (curv2)",
    "call other.obj": "line 5: other files called from within (call)",
    "bzp 1 2 3 4": "line 5: Bezier patches (bzp)",
    "V 1 1 1": "line 5: 'V' is no statement",
    "face 1 2 3": "line 5: 'face' is no statement",
}


@pytest.mark.parametrize("line", list(BROKEN))
def test_broken_lines_are_named(tmp_path, line):
    (tmp_path / "m.obj").write_text(f"{CORNERS}{line}\nf 1 2 3\n")
    refused(tmp_path / "m.obj", BROKEN[line])


def test_the_line_is_right_behind_continued_ones(tmp_path):
    (tmp_path / "m.obj").write_text(CORNERS + "f 1 \\\n2 \\\n3\n\nf 1 2 9\n")
    refused(tmp_path / "m.obj", "line 9: a face takes vertex 9")


def test_what_is_no_text_is_refused(tmp_path):
    (tmp_path / "m.obj").write_bytes(BOTH.encode("utf-16-le"))
    refused(tmp_path / "m.obj", "zero byte at offset 1")
    (tmp_path / "m.obj").write_bytes(b"\xff\xfe" + BOTH.encode("utf-16-le")[:-1])
    refused(tmp_path / "m.obj", "UTF-16")


def test_lines_and_points_are_left_out_with_a_word(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text(BOTH + "l 1 2\np 3\n")
    with pytest.warns(UserWarning, match="lines and points are left out"):
        assert len(hrt.read_mesh(path)) == 2
    path.write_text(CORNERS + "l 1 2\n")
    refused(path, "no f statement in it, only lines and points")
    path.write_text(CORNERS)
    refused(path, "no f statement")


def test_objects_groups_and_materials_begin_objects(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text(
        CORNERS + "o a\nf 1 2 3\nf 1 2 4\no a\nf 1 2 3\ng x\nusemtl red\nf 1 2 3\nf 1 2 4\n"
        "usemtl blue\nusemtl red\nf 1 2 3\ng  x \nf 2 3 4\no b\nf 1 2 3\n"
    )
    assert hrt.read_mesh(path).object_id.tolist() == [0, 0, 0, 1, 1, 2, 2, 3]


def test_polygons_keep_their_order_and_their_ids(tmp_path):
    path = tmp_path / "m.obj"
    ring = "".join(f"v {np.cos(k)} {np.sin(k)} 1\n" for k in range(6))
    path.write_text(CORNERS + ring + "f 5 6 7 8 9 10\nf 1 2 3\nf 1 2 4 3\nf 5 6 7\nf 3 4 2 1\n")
    scene = hrt.load_scene(path)
    assert scene.polygon_id.tolist() == [0, 0, 0, 0, 1, 2, 2, 3, 4, 4]
    assert scene.faces[[4, 7]].tolist() == [[0, 1, 2], [4, 5, 6]]
    joined = hrt.Scene.from_meshes([hrt.read_mesh(path)] * 2)
    assert joined.polygon_id.tolist() == [*scene.polygon_id, *(scene.polygon_id + 5)]


def test_mixed_columns_of_one_length(tmp_path):
    points = [(0, 0), (1, 0), (1, 1), (0, 1), (5, 0), (6, 0), (7, 1), (6, 2), (5, 2), (4, 1)]
    path = tmp_path / "m.obj"
    path.write_text(
        "".join(f"v {x} {y} 0\n" for x, y in points) + "vt 0 0\nvn 0 0 1\n"
        "f 1/1/1 2/1/1 3/1/1 4/1/1\nf 5//1 6//1 7//1 8//1 9//1 10//1\n"
    )
    mesh = hrt.read_mesh(path)
    assert len(mesh) == 6
    assert area(mesh) == 5.0


@pytest.mark.parametrize("switch", ["usemtl m{}", "g m{}", "o m{}"])
def test_many_objects_copy_no_vertices_and_take_no_time(tmp_path, switch):
    n = 30000
    lines = [f"v {k} {k % 7} {k % 3}\n" for k in range(n)]
    for k in range(1, n - 1):
        lines.append(f"{switch.format(k)}\nf {k} {k + 1} {k + 2}\n")
    (tmp_path / "m.obj").write_text("".join(lines))
    start = time.process_time()
    mesh = hrt.read_mesh(tmp_path / "m.obj")
    assert time.process_time() - start < 10  # quadratic work takes minutes
    assert len(mesh.vertices) == n
    assert mesh.object_id.tolist() == list(range(n - 2))


def test_a_file_longer_than_one_part_is_read_whole(tmp_path, monkeypatch):
    from hybrid_rt.scene.io import obj

    monkeypatch.setattr(obj, "_CHUNK", 64)
    rng = np.random.default_rng(5)
    vertices = rng.normal(size=(50, 3)).astype(np.float32)
    faces = rng.integers(0, 50, (80, 3))
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in vertices]
    for k, (a, b, c) in enumerate(faces + 1):
        relative = f"f {a - 51} \\\n{b - 51} {c - 51}\n"
        lines.append(
            relative if k % 3 else f"# comment \\\ng {k // 6}\nf {a}/1 {b}/2/3 {c}//4 # a\n"
        )
    (tmp_path / "m.obj").write_text("".join(lines))
    mesh = hrt.read_mesh(tmp_path / "m.obj")
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)
    np.testing.assert_array_equal(mesh.object_id, np.arange(80) // 6)
    (tmp_path / "m.obj").write_text("".join(lines) + "f 1 2 51\n")
    refused(tmp_path / "m.obj", f"line {''.join(lines).count(chr(10)) + 1}: a face takes vertex 51")
