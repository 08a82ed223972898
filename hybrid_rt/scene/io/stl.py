"""Stereolithography .stl files, binary and ASCII.

A reader of our own, since the format is one line of NumPy, and trimesh guesses the encoding of
names by a package that need not be there. A binary file is one whose length is what its header
says; any other that begins with "solid" and holds no zero byte is text.
"""

from __future__ import annotations

import re

import numpy as np

from hybrid_rt.scene.io import words
from hybrid_rt.scene.io.fault import FormatError
from hybrid_rt.scene.io.parts import Triangles, runs

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEAD = 84
_SOLID = re.compile(rb"^ *(end)?solid(?= |\n)[^\n]*$", re.MULTILINE | re.IGNORECASE)
_FACET = (
    b"facet normal . . . outer loop vertex . . . vertex . . . vertex . . . endloop endfacet"
).split()
_NUMBERS = [k for k, word in enumerate(_FACET) if word == b"." and k > 4]


def read(data: bytes) -> Triangles:
    """Return the triangles of an .stl file; the corners of each are its own three vertices."""
    stated = int.from_bytes(data[_HEAD - 4 : _HEAD], "little")
    if len(data) >= _HEAD and len(data) == _HEAD + stated * _RECORD.itemsize:
        return _binary(data)
    head = data[:512].removeprefix(b"\xef\xbb\xbf").lstrip()
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    if wide or (head[:5].lower() == b"solid" and b"\0" not in data):
        return _ascii(words.plain_text(data))
    if len(data) < _HEAD:
        raise FormatError(f"truncated: {len(data)} bytes, a binary header alone has {_HEAD}")
    raise FormatError(
        f"truncated or corrupt: the header says {stated} triangles, {_RECORD.itemsize} bytes each, "
        f"and {len(data) - _HEAD} bytes follow it"
    )


def _binary(data: bytes) -> Triangles:
    corners = np.frombuffer(data, _RECORD, offset=_HEAD)["corners"].astype(np.float64)
    return _soup(corners.reshape(-1, 3), np.zeros(len(corners), np.int64))


def _soup(vertices: words.F64, object_id: words.I64) -> Triangles:
    if len(vertices) == 0:
        raise FormatError("no triangles in it")
    return Triangles(vertices, np.arange(len(vertices)).reshape(-1, 3), object_id)


def _ascii(text: bytes) -> Triangles:
    """Return the triangles between `solid` and `endsolid`; each solid is an object."""
    vertices: list[words.F64] = []
    counts: list[int] = []
    begin = None
    for mark in _SOLID.finditer(text):
        ends = mark.group(1) is not None
        if ends == (begin is None):
            what = "endsolid without solid" if ends else "solid within a solid"
            raise FormatError(f"line {words.line_number(text, mark.start())}: {what}")
        if begin is not None:
            vertices.append(_facets(text, begin, mark.start()))
            counts.append(len(vertices[-1]) // 3)
        elif text[: mark.start()].strip() and not counts:
            raise FormatError("something stands before the first solid")
        begin = None if ends else mark.end()
        if ends:
            rest = _SOLID.search(text, mark.end())
            if text[mark.end() : rest.start() if rest else len(text)].strip():
                line = words.line_number(text, mark.end())
                raise FormatError(f"line {line}: something follows endsolid")
    if begin is not None:
        raise FormatError("truncated: the last solid has no endsolid")
    if not counts:
        raise FormatError("truncated or corrupt: no solid in it")
    object_id = runs(np.repeat(np.arange(len(counts)), counts)) if sum(counts) else np.empty(0)
    return _soup(np.concatenate(vertices), np.asarray(object_id, np.int64))


def _facets(text: bytes, begin: int, end: int) -> words.F64:
    """Return the corners (3 F, 3) of the facets in a part of the text."""
    piece = text[begin:end] + b"\n"
    found = words.split(piece)
    width = len(_FACET)

    def fault(word: int, what: str) -> FormatError:
        offset = begin + (int(found.start[word]) if word < len(found.start) else len(piece) - 1)
        line = words.line_number(text, offset)
        return FormatError(f"line {line}, facet {word // width} of its solid: {what}")

    usable = len(found.start) // width * width
    bad = len(found.start)
    for k, wanted in enumerate(_FACET):
        if wanted == b".":
            continue
        start, stop = found.start[k:usable:width], found.end[k:usable:width]
        same = stop - start == len(wanted)
        for j, letter in enumerate(wanted):
            at = np.minimum(start + j, len(found.text) - 1)
            same &= (found.text[at] | 32) == letter
        if not same.all():
            bad = min(bad, int(np.argmin(same)) * width + k)
    if bad < len(found.start):
        wanted = _FACET[bad % width]
        got = words.shown(found.word(bad))
        raise fault(bad, f"expected {wanted.decode()}, got {got}")
    if usable < len(found.start):
        raise fault(usable, f"truncated: {len(found.start) - usable} words of {width}")
    chosen = (np.arange(0, usable, width)[:, None] + np.array(_NUMBERS)).ravel()
    start, stop = found.start[chosen], found.end[chosen]
    numbers = words.parse(found.text, start, stop, np.float64)
    if numbers is None:
        k = words.first_bad(found.text, start, stop, np.float64)
        bad = int(chosen[k])
        raise fault(bad, f"{words.shown(found.word(bad))} is no finite number")
    return numbers.reshape(-1, 3)
