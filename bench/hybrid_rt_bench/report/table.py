"""A table of text, as markdown or for the terminal."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass, field

from rich.table import Table as RichTable
from rich.text import Text

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.report.page import bullets, table_text

ABSENT = "not measured"
"""What stands in a cell of which there is no measurement."""

QUOTED = "the paper's"
"""How a row begins that quotes the paper."""

DASH = "–"
"""What stands in a cell that has no meaning in its row."""


@dataclass
class Table:
    """A titled table of text.

    Attributes
    ----------
    title : str
    columns : list of str
        The first column is set left, the others right.
    rows : list of list of str
        A row of one cell is a heading for the rows that follow.
    notes : list of str
        Sentences printed beneath.
    detail : bool
        Whether a terminal that is too narrow may do without it.
    sentences : bool
        Whether the last column holds sentences: a document sets them as a list.
    """

    title: str
    columns: list[str]
    rows: list[list[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    detail: bool = False
    sentences: bool = False

    def markdown(self) -> str:
        """Return the table as GitHub-flavoured Markdown, no line of it wider than a page."""
        parts = [f"### {self.title}"]
        if not self.sentences:
            parts.append(table_text(self.columns, self.rows).rstrip("\n"))
        else:
            if len(self.columns) > 2:
                rows = [row[:-1] if len(row) > 1 else row for row in self.rows]
                parts.append(table_text(self.columns[:-1], rows).rstrip("\n"))
            parts.append(f"{self.columns[-1][:1].upper()}{self.columns[-1][1:]}:")
            parts.append(bullets([f"**{r[0]}**: {r[-1]}" for r in self.rows if len(r) > 1]))
        if self.notes:
            parts.append(bullets(self.notes))
        return "\n\n".join(parts) + "\n"

    def rich(self) -> RichTable:
        """Return the table for a rich console."""
        table = RichTable(
            title=Text(self.title, style="bold"),
            title_justify="left",
            caption=Text("\n".join(self.notes), style="dim") if self.notes else None,
            caption_justify="left",
            header_style="bold",
        )
        for number, column in enumerate(self.columns):
            # A heading is broken where the column below it is narrower.
            widest = max(
                (len(row[number]) for row in self.rows if len(row) > number > 0), default=0
            )
            lines = textwrap.wrap(column, max(widest, *map(len, column.split() or [""]), 1))
            table.add_column("\n".join(lines), justify="right" if number else "left")
        for row in self.rows:
            style = "bold" if len(row) == 1 else "italic" if paper(row) else ""
            table.add_row(*(Text(cell, style=style) for cell in row))
        return table


def paper(row: list[str]) -> bool:
    """Tell whether a row quotes the paper."""
    return row[0].startswith(QUOTED)


def number(value: float, digits: int = 3) -> str:
    """Return `value` with that many significant digits and no exponent; a dash for NaN."""
    if not math.isfinite(value):
        return DASH
    if value == 0:
        return "0"
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, decimals):.{max(0, decimals)}f}"


def threads_text(count: int) -> str:
    """Return a number of threads in words."""
    return f"{count} thread{'s' if count != 1 else ''}"


def interval(value: float, low: float, high: float, digits: int = 3) -> str:
    """Return ``value [low, high]``."""
    return f"{number(value, digits)} [{number(low, digits)}, {number(high, digits)}]"


def percent(value: float) -> str:
    """Return a share in per cent; zero stays visible as 0 %."""
    return f"{number(100 * value)} %" if math.isfinite(value) else DASH


def share_text(value: float, low: float, high: float) -> str:
    """Return a share in per cent, without the sign, with its interval.

    A zero stays a zero, with its upper bound; NaN is a dash.
    """
    if not math.isfinite(value):
        return DASH
    if value == 0:
        return f"0 [at most {number(100 * high, 2)}]"
    return f"{number(100 * value)} [{number(100 * low, 2)}, {number(100 * high, 2)}]"


def rate_text(rate: Rate) -> str:
    """Return `share_text` of a rate."""
    return share_text(rate.value, rate.low, rate.high)


def rate_words(rate: Rate) -> str:
    """Return a rate in a sentence: with its sign, none of how many where it is zero."""
    if not rate.total:
        return "none of no rays"
    if not rate.count:
        return f"none of {rate.total:,} rays [at most {number(100 * rate.high, 2)} %]"
    bounds = f"[{number(100 * rate.low, 2)}, {number(100 * rate.high, 2)}]"
    return f"{number(100 * rate.value)} % {bounds} of {rate.total:,} rays"
