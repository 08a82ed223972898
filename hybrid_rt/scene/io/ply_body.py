"""The rows of a .ply file, whose lists make them of unequal length.

Binary and ASCII differ in the unit only: offsets are bytes of the one and words of the other.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybrid_rt.scene.io import words
from hybrid_rt.scene.io.fault import FormatError
from hybrid_rt.scene.io.words import F64, I64


class Property(NamedTuple):
    """A property: its name, NumPy type, and the type of its length if it is a list."""

    name: str
    type: str
    length: str | None


class Element(NamedTuple):
    """An element of the header."""

    name: str
    rows: int
    properties: list[Property]


class Lists(NamedTuple):
    """A list property: how many values each row has, and all values."""

    counts: I64
    values: NDArray[Any]


Column = NDArray[Any] | Lists
Body = dict[str, dict[str, Column]]


@dataclasses.dataclass
class _Source:
    """Where numbers come from, by offset and type."""

    end: int
    size: Callable[[str], int]
    take: Callable[[I64, str], NDArray[Any]]
    length: Callable[[int, str], float]
    breaks: I64 | None = None  # where each row begins, and the last ends, where lines tell


def binary_body(
    data: bytes, begin: int, elements: list[Element], wanted: frozenset[str], order: str
) -> Body:
    """Return the columns of a binary body that begins at an offset."""
    letters = np.frombuffer(data, np.uint8)

    def take(offsets: I64, kind: str) -> NDArray[Any]:
        width = int(kind[1])
        block: NDArray[Any] = letters[offsets[:, None] + np.arange(width)]
        return block.reshape(-1).view(order + kind)

    def length(offset: int, kind: str) -> int:
        piece = data[offset : offset + int(kind[1])]
        return int.from_bytes(piece, endian, signed=kind[0] == "i")

    endian: Literal["little", "big"] = "little" if order == "<" else "big"
    source = _Source(len(data), lambda kind: int(kind[1]), take, length)
    body, end = _rows(source, begin, elements, wanted)
    if data[end:].strip(b"\0 \t\r\n"):
        raise FormatError(f"{len(data) - end} bytes follow the last row that the header says")
    return body


def ascii_body(data: bytes, begin: int, elements: list[Element], wanted: frozenset[str]) -> Body:
    """Return the columns of an ASCII body that begins at an offset."""
    found = words.split(words.plain_text(data[begin:]))
    numbers = words.parse(found.text, found.start, found.end, np.float64)
    if numbers is None:
        numbers = np.array([_number(found.word(k)) for k in range(len(found.start))], np.float64)
    values: F64 = numbers
    source = _Source(
        len(values), lambda _: 1, lambda at, _: values[at], lambda at, _: float(values[at])
    )
    first, _ = found.of_lines()
    if len(first) == sum(e.rows for e in elements if e.properties):
        source.breaks = np.append(first, len(values))
    body, end = _rows(source, 0, elements, wanted)
    if end < len(values):
        raise FormatError(f"{len(values) - end} words follow the last row that the header says")
    return body


def _number(word: bytes) -> float:
    """Return a number, NaN for what is none: in columns that matter it is refused as not finite."""
    try:
        return float(word) if re.fullmatch(rb"[-+.0-9a-zA-Z]+", word) else np.nan
    except ValueError:
        return np.nan


def _rows(
    source: _Source, begin: int, elements: list[Element], wanted: frozenset[str]
) -> tuple[Body, int]:
    """Return all columns of elements that have rows, and where the last row ends."""
    body: Body = {}
    row = 0
    for element in elements:
        columns, begin = _element(source, begin, element, row, wanted)
        if element.rows:
            body[element.name] = columns
        row += element.rows if element.properties else 0
    return body, begin


def _element(
    source: _Source, begin: int, element: Element, row: int, wanted: frozenset[str]
) -> tuple[dict[str, Column], int]:
    lists = [p for p in element.properties if p.length]
    least = sum(source.size(p.length or p.type) for p in element.properties)
    if least * element.rows > source.end - begin:
        raise _truncated(element, (source.end - begin) // least)
    if least == 0:
        return {}, begin
    lengths = _equal_lengths(source, begin, element, lists)
    if lengths is None:
        lengths = _unequal_lengths(source, begin, element, lists, row)
    # lengths (rows, lists) fix where everything is
    widths = lengths @ np.array([source.size(p.type) for p in lists], np.int64)
    ends = begin + np.cumsum(widths + least)
    start = ends - widths - least
    if source.breaks is not None:
        told = source.breaks[row + 1 : row + 1 + element.rows]
        if (ends != told).any():
            raise _uneven(element, int(np.argmax(ends != told)))
    at, k = start.copy(), 0
    columns: dict[str, Column] = {}
    for p in element.properties:
        if p.length is None:
            if p.name in wanted:
                columns[p.name] = source.take(at, p.type)
            at += source.size(p.type)
            continue
        at += source.size(p.length)
        count, size = lengths[:, k], source.size(p.type)
        if p.name in wanted and element.rows:
            last = np.cumsum(count)
            offsets = np.repeat(at - (last - count) * size, count) + np.arange(last[-1]) * size
            columns[p.name] = Lists(count, source.take(offsets, p.type))
        at += count * size
        k += 1
    return columns, int(ends[-1]) if len(ends) else begin


def _uneven(element: Element, row: int) -> FormatError:
    what = "its line has more or fewer words than the header says"
    return FormatError(f"element {element.name}, row {row}: {what}")


def _truncated(element: Element, rows: int) -> FormatError:
    return FormatError(
        f"truncated: the header says {element.rows} rows of element {element.name}, "
        f"the file has {rows}"
    )


def _equal_lengths(
    source: _Source, begin: int, element: Element, lists: list[Property]
) -> I64 | None:
    """Return the lengths of lists if all rows have those of the first, else None."""
    if element.rows == 0 or not lists:
        return np.zeros((element.rows, len(lists)), np.int64)
    places, lengths, at = [], [], begin
    for p in element.properties:
        if p.length is None:
            at += source.size(p.type)
            continue
        if at + source.size(p.length) > source.end:
            return None
        places.append(at)
        length = source.length(at, p.length)
        if not 0 <= length < 2**62 or length != int(length):
            raise _bad_length(element, 0, length)
        lengths.append(int(length))
        at += source.size(p.length) + lengths[-1] * source.size(p.type)
    stride = at - begin
    if begin + stride * element.rows > source.end:
        return None
    rows = np.arange(element.rows) * stride
    for p, place, length in zip(lists, places, lengths, strict=True):
        if not (source.take(rows + place, p.length or "") == length).all():
            return None
    return np.tile(np.array(lengths, np.int64), (element.rows, 1))


def _bad_length(element: Element, row: int, length: float) -> FormatError:
    return FormatError(f"element {element.name}, row {row}: a list of length {length:g}")


def _unequal_lengths(
    source: _Source, begin: int, element: Element, lists: list[Property], first: int
) -> I64:
    """Return the lengths of lists (rows, lists), found one row after the other."""
    # for each list: bytes before its length, size of the length, size of an item, and its type
    steps, fixed = [], 0
    for p in element.properties:
        if p.length is None:
            fixed += source.size(p.type)
        else:
            steps.append((fixed, source.size(p.length), source.size(p.type), p.length))
            fixed = 0
    found, at = [], begin
    for row in range(element.rows):
        for before, head, item, kind in steps:
            at += before
            if at + head > source.end:
                raise _truncated(element, row)
            length = source.length(at, kind)
            if not 0 <= length < 2**62 or length != int(length):
                raise _bad_length(element, row, length)
            found.append(int(length))
            at += head + int(length) * item
        at += fixed
        if source.breaks is not None and at != source.breaks[first + row + 1]:
            raise _uneven(element, row)
        if at > source.end:
            raise _truncated(element, row)
    return np.array(found, np.int64).reshape(-1, len(lists))
