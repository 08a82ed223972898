"""Wavefront .obj files.

A reader of our own: trimesh and meshio, the best kept ones, lose or change tabs, relative indices,
faces with and without texture coordinates in one file, the order of polygons, concave polygons
(docs/results/corpus.md); the PyPI package of tinyobjloader is of 2019 and does not build any more.
Here each statement is read or refused with its line, many lines at a time.

Read: v (x y z, with a weight or a colour after it, which triangles do not need), f (and fo, its
old name). o, g and usemtl begin an object each. Without triangles and left out: l, p. Known and
without meaning for triangles: texture coordinates, normals, materials, smoothing. Refused:
free-form curves and surfaces, calls of other files, and statements that the format does not have.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from hybrid_rt.scene.io import words
from hybrid_rt.scene.io.fault import FormatError
from hybrid_rt.scene.io.parts import Triangles, runs
from hybrid_rt.scene.io.polygons import triangulate
from hybrid_rt.scene.io.words import F64, I64, U8, Words

_CHUNK = 1 << 23
_NAMES = (b"o", b"g", b"usemtl")
_TEXT = (*_NAMES, b"mtllib", b"usemap", b"maplib", b"shadow_obj", b"trace_obj")
_WITHOUT_SURFACE = (b"l", b"p")
_IGNORED = {
    b"vt", b"vn", b"vp", b"s", b"mg", b"mtllib", b"usemap", b"maplib", b"bevel", b"c_interp",
    b"d_interp", b"lod", b"shadow_obj", b"trace_obj", b"cstype", b"deg", b"bmat", b"step",
    b"parm", b"trim", b"hole", b"scrv", b"sp", b"end", b"con", b"ctech", b"stech", b"vw",
}  # fmt: skip
_REFUSED = {
    b"curv": "free-form curves", b"curv2": "free-form curves", b"surf": "free-form surfaces",
    b"bsp": "B-spline patches", b"bzp": "Bezier patches", b"cdc": "Cardinal curves",
    b"cdp": "Cardinal patches", b"call": "other files called from within",
    b"csh": "commands of a shell",
}  # fmt: skip
_KEYWORDS = {b"v", b"f", b"fo", *_TEXT, *_WITHOUT_SURFACE, *_IGNORED, *_REFUSED}
_FACE_LETTERS = np.isin(np.arange(256), list(b" 0123456789+-/"))


def _code(word: bytes) -> int:
    return word[0] + 256 * (word[1] if len(word) == 2 else 0)


_QUIET = np.array(sorted(_code(w) for w in _IGNORED if len(w) <= 2))


class _Part(NamedTuple):
    """What a part of the text holds."""

    vertices: F64
    corners: I64  # as written, relative ones already counted from the start of the file
    counts: I64
    offset: I64  # of each face's line
    change: I64  # how many names came before each face


def read(data: bytes) -> Triangles:
    """Return the triangles of an .obj file."""
    lines = words.plain_text(data)
    text = _joined(lines)
    state = _State(lines)
    parts, begin = [], 0
    while begin < len(text):
        end = text.find(b"\n", min(begin + _CHUNK, len(text) - 1)) + 1 or len(text)
        parts.append(state.part(_uncommented(text[begin:end]), begin))
        begin = end
    vertices = np.concatenate([part.vertices for part in parts])
    corners, counts, offset, change = (
        np.concatenate([part[k] for part in parts]) for k in range(1, 5)
    )
    skipped = "lines and points" if state.without_surface else ""
    if len(counts) == 0:
        raise FormatError(
            f"no triangles: no f statement in it{', only ' + skipped if skipped else ''}"
        )

    def where(polygon: int) -> str:
        return f"line {words.line_number(lines, offset[polygon])}"

    bad = np.flatnonzero((corners < 1) | (corners > len(vertices)))
    if bad.size:
        polygon = int(np.searchsorted(np.cumsum(counts), bad[0], side="right"))
        raise FormatError(
            f"{where(polygon)}: a face takes vertex {corners[bad[0]]} of {len(vertices)}"
            " (counted from 1)"
        )
    faces, polygon_id = triangulate(vertices, corners - 1, counts, where)
    return Triangles(vertices, faces, runs(change)[polygon_id], polygon_id, skipped)


class _State:
    """What is carried from one part of the text to the next."""

    def __init__(self, lines: bytes) -> None:
        self.lines = lines
        self.n_vertices = 0
        self.names: dict[bytes, bytes] = {}
        self.changes = 0
        self.without_surface = False

    def part(self, text: bytes | bytearray, begin: int) -> _Part:
        """Return what is in one part, whole lines that begin at an offset."""
        found = words.split(text)
        first, length = found.of_lines()
        letter = found.text[found.start[first]]
        size = found.end[first] - found.start[first]
        second = np.where(size == 2, found.text[found.start[first] + 1], 0)
        code = np.where(size <= 2, letter + 256 * second.astype(np.int64), -1)
        is_v, is_f = code == _code(b"v"), (code == _code(b"f")) | (code == _code(b"fo"))
        change_at = self._others(found, first[~(is_v | is_f | np.isin(code, _QUIET))], begin)

        vertex, face = first[is_v], first[is_f]
        vertices = self._vertices(found, vertex, length[is_v] - 1, begin)
        counts = length[is_f] - 1
        if (counts < 3).any():
            row = face[np.argmax(counts < 3)]
            raise self._fault(begin + found.start[row], "a face of fewer than 3 corners")
        corners = self._corners(found, face, counts, begin)
        before = np.repeat(np.searchsorted(vertex, face) + self.n_vertices, counts)
        relative = corners < 0
        corners[relative] += before[relative] + 1
        change = np.searchsorted(change_at, found.start[face], side="right") + self.changes
        self.n_vertices += len(vertex)
        self.changes += len(change_at)
        return _Part(vertices, corners, counts, found.start[face] + begin, change)

    def _fault(self, offset: int, what: str) -> FormatError:
        return FormatError(f"line {words.line_number(self.lines, offset)}: {what}")

    def _others(self, found: Words, rows: I64, begin: int) -> I64:
        """Go through all other statements; return where another object begins."""
        changes = []
        for row in rows.tolist():
            word = found.word(row)
            offset = int(found.start[row])
            if word in _NAMES:
                name = _rest(found.text, int(found.end[row]))
                if self.names.get(word) != name:
                    self.names[word] = name
                    changes.append(offset)
            elif word in _WITHOUT_SURFACE:
                self.without_surface = True
            elif word in _REFUSED:
                what = f"{_REFUSED[word]} ({word.decode()}) cannot be read"
                raise self._fault(begin + offset, what)
            elif word not in _IGNORED:
                what = f"{words.shown(word)} is no statement of the format"
                raise self._fault(begin + offset, what)
        return np.array(changes, np.int64)

    def _vertices(self, found: Words, rows: I64, counts: I64, begin: int) -> F64:
        fits = np.isin(counts, (3, 4, 6, 7))
        if not fits.all():
            k = int(np.argmin(fits))
            what = (
                f"a vertex of {counts[k]} numbers, expected 3, or 4, 6 or 7 with weight or colour"
            )
            raise self._fault(begin + found.start[rows[k]], what)
        chosen = (rows[:, None] + np.arange(1, 4)).ravel()
        start, end = found.start[chosen], found.end[chosen]
        numbers = words.parse(found.text, start, end, np.float64)
        if numbers is None:
            k = words.first_bad(found.text, start, end, np.float64)
            bad = words.shown(found.word(int(chosen[k])))
            raise self._fault(begin + start[k], f"{bad} is no finite number")
        return numbers.reshape(-1, 3)

    def _corners(self, found: Words, rows: I64, counts: I64, begin: int) -> I64:
        """Return the indices of vertices, as they are written."""
        last = np.cumsum(counts)
        chosen = np.repeat(rows + 1 - last + counts, counts) + np.arange(
            last[-1] if len(last) else 0
        )
        start, whole = found.start[chosen], found.end[chosen]
        slashes = np.flatnonzero(found.text == 47)
        end = whole
        good = np.ones(len(start), bool)
        if slashes.size:
            slash = np.searchsorted(slashes, start)
            cut = np.append(slashes, len(found.text))[slash]
            end = np.minimum(whole, cut)
            good = np.searchsorted(slashes, whole) - slash <= 2
        numbers = words.parse(found.text, start, end, np.int64)
        if good.all() and numbers is not None and _letters_fit(found.text, start, whole):
            return numbers
        for k in range(len(start)):
            word = found.word(int(chosen[k]))
            if not re.fullmatch(rb"[+-]?\d{1,18}(/[+-]?\d*){0,2}", word):
                what = f"{words.shown(word)} is no corner of a face (v, v/vt, v//vn or v/vt/vn)"
                raise self._fault(begin + start[k], what)
        raise FormatError("corners of faces that cannot be read")


def _letters_fit(text: U8, start: I64, end: I64) -> bool:
    """Return whether corners consist of digits, signs and slashes only."""
    inside = np.zeros(len(text) + 1, np.int8)
    inside[start] = 1
    inside[end] = -1
    words_of_faces = np.cumsum(inside[:-1], dtype=np.int8).view(bool)
    return bool(_FACE_LETTERS[text[words_of_faces]].all())


def _rest(text: U8, begin: int) -> bytes:
    """Return the words from an offset to the end of its line."""
    step = 64
    while True:
        piece = text[begin : begin + step].tobytes()
        end = piece.find(b"\n")
        if end >= 0 or begin + step >= len(text):
            return b" ".join(piece[: end if end >= 0 else None].split())
        step *= 4


def _uncommented(text: bytes) -> bytes | bytearray:
    """Return whole lines with blanks instead of comments; names may hold a #."""
    mark = text.find(b"#")
    if mark < 0:
        return text
    blanked = bytearray(text)
    while mark >= 0:
        end = text.find(b"\n", mark)
        line = text.rfind(b"\n", 0, mark) + 1
        head = text[line : min(mark, line + 256)].split(None, 1)
        if not head or head[0] not in _TEXT:
            blanked[mark:end] = b" " * (end - mark)
        mark = text.find(b"#", end)
    return blanked


def _joined(lines: bytes) -> bytes:
    r"""Return text as long as before whose continued lines are one.

    A \ at the end continues a statement. In a comment it is a letter; after a name it is one when
    what follows is a statement, for names such as C:\models\ occur.
    """
    if b"\\" not in lines:
        return lines
    text = bytearray(lines)
    joined, head, remark = -1, b"", False
    for mark in re.finditer(rb"\\ *\n", lines):
        begin, end = mark.start(), mark.end()
        if joined < 0 or lines.find(b"\n", joined, begin) >= 0:  # another statement begins
            joined = lines.rfind(b"\n", 0, begin) + 1
            head, remark = _first(lines, joined, begin), False
        remark = remark or lines.find(b"#", joined, begin) >= 0
        following = _first(lines, end, len(lines))
        a_name = head in _TEXT and (following in _KEYWORDS or following[:1] in (b"", b"#"))
        if a_name or (remark and head not in _TEXT):
            joined = -1
            continue
        text[begin:end] = b" " * (end - begin)
        joined = end
    return bytes(text)


def _first(lines: bytes, begin: int, end: int) -> bytes:
    """Return the first word of a line, empty if it has none."""
    stop = lines.find(b"\n", begin, end)
    piece = lines[begin : min(begin + 4096, stop if stop >= 0 else end)]
    return next(iter(piece.split(None, 1)), b"")
