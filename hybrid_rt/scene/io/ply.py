"""Polygon files, .ply: ASCII and binary of either byte order.

A reader of our own. plyfile, the best kept one, refuses comments that are not ASCII, needs a Python
call for each row with a list, and allocates what a header claims; trimesh misreads files that mix
polygons. Here the header is checked against the bytes that are there, and rows are read together.
plyfile is an oracle of the tests.

Read: element vertex (x, y, z of any type), element face (polygons), element tristrips (with -1
between strips). Other elements and properties are passed over.
"""

from __future__ import annotations

import re

import numpy as np

from hybrid_rt.scene.io import words
from hybrid_rt.scene.io.fault import FormatError
from hybrid_rt.scene.io.parts import Triangles, strip
from hybrid_rt.scene.io.ply_body import Body, Element, Lists, Property, ascii_body, binary_body
from hybrid_rt.scene.io.polygons import triangulate
from hybrid_rt.scene.io.words import F64, I64

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDICES = ("vertex_indices", "vertex_index")
_WANTED = frozenset(("x", "y", "z", *_INDICES))


def read(data: bytes) -> Triangles:
    """Return the triangles of a .ply file."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    order, elements, begin = _header(data)
    if order:
        body = binary_body(data, begin, elements, _WANTED, order)
    else:
        body = ascii_body(data, begin, elements, _WANTED)
    vertices = _vertices(body)
    faces, polygons = _polygons(body, vertices)
    strips = _strips(body, len(vertices))
    if len(faces) + len(strips) == 0:
        held = ", ".join(f"{e.rows} rows of {e.name}" for e in elements) or "nothing"
        raise FormatError(f"no triangles in it: no face and no tristrips (it holds {held})")
    following = np.arange(len(strips)) + (polygons[-1] + 1 if len(polygons) else 0)
    return Triangles(
        vertices,
        np.concatenate([faces, strips]),
        polygon_id=np.concatenate([polygons, following]),
    )


def _header(data: bytes) -> tuple[str, list[Element], int]:
    """Return the byte order ("" for ASCII), the elements, and where the body begins."""
    mark = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    if mark is None:
        raise FormatError("truncated, or not a .ply file: the first line is not 'ply'")
    stop = re.search(rb"[\r\n][ \t]*end_header[ \t]*" + mark.group(1), data) or re.search(
        rb"[\r\n][ \t]*end_header[ \t]*(\r\n|\n|\r)", data
    )
    if stop is None:
        raise FormatError("truncated or corrupt: the header has no end_header")
    order = None
    elements: list[Element] = []
    for number, line in enumerate(data[mark.end() : stop.start()].splitlines(), 2):
        word = line.decode("latin-1").split()  # comments may be in any encoding
        match word:
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", form, "1.0"] if form in ORDERS and order is None:
                order = ORDERS[form]
            case ["element", name, count] if re.fullmatch(r"\d{1,18}", count):
                if name in [element.name for element in elements]:
                    raise FormatError(f"line {number}: a second element {name}")
                elements.append(Element(name, int(count), []))
            case ["property", "list", length, item, name] if (
                elements and item in TYPES and TYPES.get(length, "f")[0] != "f"
            ):
                elements[-1].properties.append(Property(name, TYPES[item], TYPES[length]))
            case ["property", kind, name] if elements and kind in TYPES:
                elements[-1].properties.append(Property(name, TYPES[kind], None))
            case _:
                raise FormatError(f"line {number}: {words.shown(line)} is no line of a .ply header")
    if order is None:
        raise FormatError("its header names no format")
    for element in elements:
        names = [p.name for p in element.properties]
        if len(set(names)) < len(names):
            raise FormatError(f"element {element.name}: two properties of one name")
    return order, elements, stop.end()


def _vertices(body: Body) -> F64:
    if "vertex" not in body:
        return np.empty((0, 3))
    columns = body["vertex"]
    missing = [axis for axis in "xyz" if not isinstance(columns.get(axis), np.ndarray)]
    if missing:
        raise FormatError(f"element vertex: no property {' '.join(missing)}")
    vertices = np.stack([np.asarray(columns[axis], np.float64) for axis in "xyz"], axis=1)
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        raise FormatError(f"element vertex, row {np.argmin(finite)}: not a finite position")
    return vertices


def _indices(body: Body, element: str) -> Lists | None:
    """Return the lists of vertices of an element, None where there is no such element."""
    if element not in body:
        return None
    for name in _INDICES:
        column = body[element].get(name)
        if isinstance(column, Lists):
            return column
    raise FormatError(f"element {element}: no property list {' or '.join(_INDICES)}")


def _check(lists: Lists, values: I64, element: str, n: int, least: int) -> None:
    """Raise at the first index that is no vertex."""
    bad = (values < least) | (values >= n) | (values != lists.values)
    if bad.any():
        at = int(np.argmax(bad))
        row = int(np.searchsorted(np.cumsum(lists.counts), at, side="right"))
        raise FormatError(
            f"element {element}, row {row}: no vertex {lists.values[at]:g}, there are {n}"
        )


def _polygons(body: Body, vertices: F64) -> tuple[I64, I64]:
    lists = _indices(body, "face")
    if lists is None:
        return np.empty((0, 3), np.int64), np.empty(0, np.int64)
    few = lists.counts < 3
    if few.any():
        row = int(np.argmax(few))
        raise FormatError(f"element face, row {row}: a face of {lists.counts[row]} corners")
    corners = _whole(lists)
    _check(lists, corners, "face", len(vertices), 0)
    return triangulate(vertices, corners, lists.counts, lambda k: f"element face, row {k}")


def _whole(lists: Lists) -> I64:
    with np.errstate(invalid="ignore"):
        return lists.values.astype(np.int64)


def _strips(body: Body, n: int) -> I64:
    lists = _indices(body, "tristrips")
    found = [np.empty((0, 3), np.int64)]
    if lists is not None:
        corners = _whole(lists)
        _check(lists, corners, "tristrips", n, -1)
        for row in np.split(corners, np.cumsum(lists.counts)[:-1]):
            for piece in np.split(row, np.flatnonzero(row < 0)):
                found.append(strip(piece[piece >= 0]))
    return np.concatenate(found)
