"""Words and numbers of text files, found and parsed many at a time.

Text formats of meshes are regular enough for NumPy, and every word is checked before it is parsed,
so that nothing is read as something else.
"""

from __future__ import annotations

import re
import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybrid_rt.scene.io.fault import FormatError

U8 = NDArray[np.uint8]
I64 = NDArray[np.int64]
F64 = NDArray[np.float64]

_WHITE = bytes.maketrans(b"\t\v\f", b"   ")
_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_INTEGER = re.compile(rb"[+-]?\d+")
_LONGEST_INTEGER = 18  # digits that surely fit int64


def _table(letters: bytes) -> NDArray[np.bool_]:
    table = np.zeros(256, bool)
    table[list(letters)] = True
    return table


_FLOAT_LETTERS = _table(b" 0123456789+-.eE")
_INTEGER_LETTERS = _table(b" 0123456789+-")


class Words(NamedTuple):
    """Text and the offsets of its words: text[start:end]; a blank follows each of them."""

    text: U8
    start: I64
    end: I64

    def of_lines(self) -> tuple[I64, I64]:
        """Return, for each line with words, the index of its first and their number."""
        breaks = np.flatnonzero(self.text == 10)
        first = np.searchsorted(self.start, np.append(0, breaks + 1))
        length = np.diff(first, append=len(self.start))
        return first[length > 0], length[length > 0]

    def word(self, index: int) -> bytes:
        """Return one word."""
        return self.text[self.start[index] : self.end[index]].tobytes()


def plain_text(data: bytes) -> bytes:
    """Return text whose lines end in one newline and whose other white space is blanks.

    The byte order marks of UTF-8 and UTF-16 are understood; otherwise any encoding that has ASCII
    in it will do, as only names and comments hold other letters. Lines keep their numbers.
    """
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        try:
            data = data.decode("utf-16").encode("utf-8", "replace")
        except UnicodeDecodeError as error:
            raise FormatError(f"truncated or corrupt UTF-16 text ({error})") from error
    data = data.removeprefix(b"\xef\xbb\xbf")
    zero = data.find(b"\0")
    if zero >= 0:
        raise FormatError(f"not a text file: a zero byte at offset {zero} (UTF-16 needs its mark)")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data.translate(_WHITE) + b"\n"


def split(text: bytes | bytearray) -> Words:
    """Return the words of `plain_text`, which ends with a newline."""
    letters = np.frombuffer(text, np.uint8)
    blank = (letters == 32) | (letters == 10)
    edges = np.flatnonzero(np.diff(blank, prepend=True))
    return Words(letters, edges[0::2], edges[1::2])


def line_number(text: bytes, offset: int) -> int:
    """Return the number of the line, counted from 1, in which an offset lies."""
    return text.count(b"\n", 0, int(offset)) + 1


def _gather(text: U8, start: I64, end: I64) -> U8:
    """Return words side by side, with a blank after each."""
    length = end - start + 1
    after = np.cumsum(length)
    gathered: U8 = text[np.repeat(start - after + length, length) + np.arange(after[-1])]
    gathered[after - 1] = 32
    return gathered


def parse(text: U8, start: I64, end: I64, dtype: type[Any]) -> NDArray[Any] | None:
    """Return words as numbers of float64 or int64, or None unless all of them are."""
    if len(start) == 0:
        return np.empty(0, dtype)
    whole = dtype is np.int64
    if (end <= start).any() or (whole and int((end - start).max()) > _LONGEST_INTEGER):
        return None
    gathered = _gather(text, start, end)
    if not (_INTEGER_LETTERS if whole else _FLOAT_LETTERS)[gathered].all():
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            numbers = np.fromstring(gathered.tobytes(), dtype, sep=" ")
    except (ValueError, DeprecationWarning):
        return None
    # "1.2.3" comes as two numbers, and nothing ever as none: the count tells.
    if len(numbers) != len(start) or (not whole and not np.isfinite(numbers).all()):
        return None
    return numbers


def first_bad(text: U8, start: I64, end: I64, dtype: type[Any]) -> int:
    """Return the index of the first word that `parse` does not take."""
    pattern = _INTEGER if dtype is np.int64 else _NUMBER
    for k, (low, high) in enumerate(zip(start.tolist(), end.tolist(), strict=True)):
        word = text[low:high].tobytes()
        if not pattern.fullmatch(word) or not np.isfinite(float(word)):
            return k
        if dtype is np.int64 and len(word) > _LONGEST_INTEGER:
            return k
    return 0


def shown(word: bytes) -> str:
    """Return a word of a file for a message."""
    text = word.decode("utf-8", "backslashreplace")
    return repr(text if len(text) <= 40 else text[:37] + "...")
