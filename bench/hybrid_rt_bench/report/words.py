"""Small parts of sentences."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

MOST_NAMED = 4
"""More names than this are counted in a sentence, and not listed."""


def listed(items: Iterable[str]) -> str:
    """Return items as a sentence names them: with commas, and "and" before the last one."""
    *others, last = list(items) or ["none"]
    return f"{', '.join(others)} and {last}" if others else last


def few(items: Sequence[str]) -> str:
    """Return the first items as `listed` does, and how many more there are."""
    more = len(items) - MOST_NAMED
    return listed(items) if more < 1 else listed([*items[:MOST_NAMED], f"{more} more"])


def counted(number: int, word: str) -> str:
    """Return a number of things, with an s where there is not one of them."""
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def named(items: Sequence[str], word: str) -> str:
    """Return items by their names where they are few, and else their number."""
    return listed(items) if len(items) <= MOST_NAMED else counted(len(items), word)


def how_many(some: Sequence[str], total: int, word: str) -> str:
    """Return how many of `total` things there are, and which, if they are few."""
    if not some:
        return f"none of {counted(total, word)}" if total > 1 else f"no {word}"
    if len(some) == total:
        return f"the only {word}" if total == 1 else f"{'both' if total == 2 else 'all'} {word}s"
    return f"{len(some)} of {counted(total, word)}" + (
        f" ({listed(some)})" if len(some) <= MOST_NAMED else ""
    )
