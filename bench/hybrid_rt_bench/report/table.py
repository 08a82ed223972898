"""A table of text, as markdown or for the terminal."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass, field

from rich.table import Table as RichTable
from rich.text import Text


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
    """

    title: str
    columns: list[str]
    rows: list[list[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    detail: bool = False

    def markdown(self) -> str:
        """Return the table as GitHub-flavoured markdown."""
        lines = [f"### {self.title}", ""]
        lines.append("| " + " | ".join(_escape(c) for c in self.columns) + " |")
        lines.append("|" + "|".join(["---"] + ["---:"] * (len(self.columns) - 1)) + "|")
        for row in self.rows:
            cells = [_escape(c) for c in row] if len(row) > 1 else [f"**{_escape(row[0])}**"]
            cells += [""] * (len(self.columns) - len(cells))
            lines.append("| " + " | ".join(cells) + " |")
        if self.notes:
            lines += ["", *[f"{note}  " for note in self.notes]]
        return "\n".join(lines) + "\n"

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
    return row[0].startswith("paper")


def number(value: float, digits: int = 3) -> str:
    """Return `value` with that many significant digits and no exponent; a dash for NaN."""
    if not math.isfinite(value):
        return "–"
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


def percent(value: float, low: float = math.nan, high: float = math.nan) -> str:
    """Return a share in per cent with its interval if there is one; zero stays visible as 0 %."""
    if not math.isfinite(value):
        return "–"
    text = f"{number(100 * value)} %"
    if math.isfinite(low) and math.isfinite(high):
        text += f" [{number(100 * low)}, {number(100 * high)}]"
    return text


def _escape(text: str) -> str:
    return text.replace("|", "\\|")
