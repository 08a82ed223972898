"""What can be measured against the strongest Embree."""

from __future__ import annotations

from dataclasses import dataclass

import hybrid_rt as hrt
from hybrid_rt.errors import UnknownNameError


@dataclass(frozen=True)
class Technique:
    """A way of answering secondary rays.

    Attributes
    ----------
    name : str
    description : str
    mode : Mode
        For `hybrid_rt.march` and `hybrid_rt.trace_hybrid`.
    """

    name: str
    description: str
    mode: hrt.Mode


TECHNIQUES = {
    technique.name: technique
    for technique in (
        Technique(
            "paper",
            "The paper's strict march through a nearest-depth pyramid, then Embree for the rest",
            hrt.Paper(),
        ),
    )
}


def get_technique(name: str) -> Technique:
    """Return a registered technique.

    Raises
    ------
    UnknownNameError
        No such technique; with the nearest known one.
    """
    if name not in TECHNIQUES:
        raise UnknownNameError("technique", name, TECHNIQUES)
    return TECHNIQUES[name]
