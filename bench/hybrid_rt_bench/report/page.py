"""Text that is no wider than a page: paragraphs, and tables whose columns are dealt out to several.

A table that is too wide is not cut: its columns go to as many tables as it takes, each of which
names its rows again. The source of a table is set in columns too, so that it is read as it stands.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence

PAGE = 100
"""Signs in a line."""

NARROW = 16
"""A column is not broken to fewer signs than this."""

NAMES = (48, 40, 32)
"""To so many signs the names of rows are broken where that saves a table."""

HELD = "\x00"
"""Stands for a blank at which no line ends."""

BREAK = "<br>"
"""What begins a new line inside a cell."""

Rows = Sequence[Sequence[str]]


def paragraph(text: str, indent: str = "") -> str:
    """Return text broken into lines of a page, all but the first after `indent`."""
    # A line that begins with one of these signs would begin a list or a heading.
    held = re.sub(r" (?=(?:[-+*>#=]|\d+[.)]) )", HELD, _held(" ".join(text.split())))
    lines = textwrap.wrap(
        held, PAGE, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return "\n".join(lines).replace(HELD, " ")


def bullets(texts: Sequence[str]) -> str:
    """Return texts as a list."""
    return "\n".join(paragraph(f"- {text}", "  ") for text in texts)


def table_text(columns: Sequence[str], rows: Rows, width: int = PAGE) -> str:
    """Return a table as GitHub-flavoured Markdown, as several where it would be wider than a page.

    Parameters
    ----------
    columns : sequence of str
        The first one is set left, the others right.
    rows : sequence of sequence of str
        A row of one cell is a heading; one of too few cells is filled up.
    width : int
        Signs of a line.
    """
    head = [cell_text(text) for text in columns]
    body = [[cell_text(text) for text in row] for row in rows]
    body = [row + [""] * (len(head) - len(row)) if len(row) > 1 else row for row in body]
    widths = _widths(head, [row for row in body if len(row) > 1], width)
    parts = _dealt(widths, width)
    return "\n\n".join(_one(head, body, widths, [0, *part], width) for part in parts) + "\n"


def cell_text(text: str) -> str:
    """Return text as it may stand in a cell."""
    return " ".join(text.replace("|", "\\|").split())


def _widths(head: list[str], body: list[list[str]], width: int) -> list[int]:
    """Return the widths of columns: those of their cells, or less where that saves tables."""
    cells = [max([3, *(len(row[at]) for row in body)]) for at in range(len(head))]
    whole = [max(cell, len(text)) for cell, text in zip(cells, head, strict=True)]
    if len(head) == 1:
        return [min(whole[0], width - 4)]
    # A heading is broken to lines no wider than its column, as far as its words allow.
    narrow = [max(c, _narrowest(text)) for c, text in zip(cells, head, strict=True)]
    room = width - 7
    tried = []
    for others in (whole[1:], narrow[1:]):
        first = min(whole[0], max(room - max(others), room // 2, NARROW))
        tried += [
            [at_most, *(min(other, room - at_most) for other in others)]
            for at_most in (first, *(names for names in NAMES if names < first))
        ]
    return min(tried, key=lambda found: len(_greedy(found, width)))


def _narrowest(heading: str) -> int:
    """Return the width of a heading's longest word, or of a third of it."""
    return max([-(-len(heading) // 3), *(len(word) for word in _held(heading).split(" "))])


def _dealt(widths: list[int], width: int) -> list[list[int]]:
    """Return which columns beside the first one go together: few parts, and of one width."""
    fewest = len(_greedy(widths, width))
    least = min(w for w in range(1, width + 1) if len(_greedy(widths, w)) <= fewest)
    return _greedy(widths, least)


def _greedy(widths: list[int], width: int) -> list[list[int]]:
    parts: list[list[int]] = [[]]
    used = widths[0] + 4
    for at in range(1, len(widths)):
        if parts[-1] and used + widths[at] + 3 > width:
            parts.append([])
            used = widths[0] + 4
        parts[-1].append(at)
        used += widths[at] + 3
    return parts


def _one(
    head: list[str], body: list[list[str]], widths: list[int], taken: list[int], width: int
) -> str:
    def line(row: list[str]) -> str:
        cells = []
        for at in taken:
            text = BREAK.join(_broken(row[at], widths[at]))
            cells.append(text.rjust(widths[at]) if at else text.ljust(widths[at]))
        return f"| {' | '.join(cells)} |"

    def heading(text: str) -> str:
        broken = BREAK.join(_broken(text, width - 5 - 3 * len(taken)))
        return f"| **{broken}** |{' |' * (len(taken) - 1)}"

    rule = "".join(f"{'-' * (widths[at] + 1)}:|" if at else f"{'-' * (widths[0] + 2)}|"
                   for at in taken)  # fmt: skip
    lines = [line(head), f"|{rule}"]
    return "\n".join(lines + [line(row) if len(row) > 1 else heading(row[0]) for row in body])


def _broken(text: str, width: int) -> list[str]:
    """Return the lines of a cell."""
    if len(text) <= width:
        return [text]
    # Between parts where that does, else between words, else anywhere.
    for held in (re.sub("(?<!,) ", HELD, text), _held(text)):
        lines = textwrap.wrap(held, width, break_on_hyphens=False, break_long_words=False)
        if max(map(len, lines)) <= width:
            break
    else:
        lines = textwrap.wrap(_held(text), max(width, 3), break_on_hyphens=False)
    return [line.replace(HELD, " ") for line in lines]


def _held(text: str) -> str:
    """Return text with the blanks replaced at which no line is to end: before a unit of a share."""
    return text.replace(" %", f"{HELD}%")
