"""The one palette of all figures and pictures, and which technique looks how.

The colours are those of Okabe and Ito, two added for techniques from outside. Whatever common
colour vision they are seen with, any two that stand side by side are told apart; markers and
hatches say the same once more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

BLUE, ORANGE, GREEN, SKY, PURPLE, AMBER, YELLOW, BLACK = (
    "#0072B2", "#D55E00", "#009E73", "#56B4E9", "#CC79A7", "#E69F00", "#F0E442", "#000000",
)  # fmt: skip
GREY, WINE = "#6E6E6E", "#6B2A3A"
PALE, WHITE = "#C8C8C8", "#FFFFFF"


class Look(NamedTuple):
    """How something is drawn: a colour, and a marker or a hatch that doubles it."""

    colour: str
    marker: str
    hatch: str


TECHNIQUES = {
    "certified": Look(BLUE, "o", ""),
    "paper": Look(ORANGE, "s", "//"),
    "slope": Look(GREEN, "^", ".."),
    "hiz": Look(PURPLE, "D", "\\\\"),
    "dda": Look(SKY, "v", "xx"),
    "linear": Look(AMBER, "P", "--"),
    "embree": Look(BLACK, "*", ""),
}
"""The look of each technique that the project knows, the same in every figure."""

OUTSIDE = (
    Look(WINE, "X", "++"), Look(GREY, "<", "||"), Look(WINE, ">", "oo"), Look(GREY, "d", "**"),
)  # fmt: skip
"""The looks of techniques from outside, in the order in which a run names them."""

SERIES = (
    Look(BLUE, "o", ""), Look(ORANGE, "s", "//"), Look(GREEN, "^", ".."), Look(PURPLE, "D", "\\\\"),
    Look(SKY, "v", "xx"), Look(AMBER, "P", "--"), Look(BLACK, "X", "++"),
)  # fmt: skip
"""The looks of what is no technique, such as the series of a run, in order."""

STAGES = {
    "embree": Look(BLACK, "*", ""),
    "march": Look(GREEN, "^", ".."),
    "compaction": Look(PURPLE, "D", "\\\\"),
    "fallback": Look(AMBER, "P", ""),
    "merge": Look(SKY, "v", "xx"),
}
"""The looks of the stages of a hybrid, and of Embree beside it."""

VERDICTS = {
    "background": WHITE,
    "unresolved": BLUE,
    "false_hit": ORANGE,
    "false_miss": BLACK,
    "wrong_primitive": YELLOW,
}
"""What the pixels of a map of errors say, over greys where the answer is right."""

GREYS = (90, 210)
"""The darkest and the lightest grey of a picture on which colours mean something."""

MIDDLE = "#969696"
"""The grey that stands for all of them in a legend."""

STATUSES = {
    "HIT": PALE,
    "MISS": SKY,
    "OFFSCREEN": AMBER,
    "HIDDEN": BLUE,
    "NEAR": GREEN,
    "EXHAUSTED": PURPLE,
    "INVALID": ORANGE,
    "UNDECIDED": YELLOW,
    "SKIPPED": BLACK,
    "": WHITE,
}
"""The colours of a map of how marches ended; "" is where no ray starts."""


def looks(techniques: Sequence[str]) -> dict[str, Look]:
    """Return the look of each technique of a run, given in the order of the run.

    A technique that the project does not know takes the next of `OUTSIDE`; from the fifth on they
    begin again.
    """
    outside = [name for name in dict.fromkeys(techniques) if name not in TECHNIQUES]
    return {
        name: TECHNIQUES[name]
        if name in TECHNIQUES
        else OUTSIDE[outside.index(name) % len(OUTSIDE)]
        for name in techniques
    }


def rgb(colour: str) -> tuple[int, int, int]:
    """Return a colour, ``#RRGGBB``, as three bytes."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
