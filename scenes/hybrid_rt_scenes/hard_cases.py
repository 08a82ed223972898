"""The hard set: rays and small scenes on which tracers through a depth buffer go wrong.

Each case has a name, a sentence on what goes wrong, and a builder of a scene, a camera and rays.
What is true of every ray comes from exact arithmetic over the case's few triangles
(`hybrid_rt_scenes.hard.truth`); `grade` counts what a technique's answers are worth. Any tracer may
be run on it::

    from hybrid_rt_scenes.hard_cases import get_hard_case, grade, hard_case_names

    for name in hard_case_names():
        case = get_hard_case(name).build()
        print(grade(case, my_tracer(case.gbuffer, case.rays)))
"""

from __future__ import annotations

import hybrid_rt as hrt
from hybrid_rt_scenes.hard import directions, surfaces, views
from hybrid_rt_scenes.hard.case import BuiltCase, HardCase
from hybrid_rt_scenes.hard.grade import CaseResult, grade
from hybrid_rt_scenes.hard.truth import Truth, truth

__all__ = [
    "BuiltCase",
    "CaseResult",
    "HardCase",
    "Truth",
    "get_hard_case",
    "grade",
    "hard_case_names",
    "truth",
]

_CASES = {case.name: case for case in (*directions.CASES, *surfaces.CASES, *views.CASES)}


def hard_case_names() -> list[str]:
    """Return the names of all hard cases, in the order of their kinds."""
    return list(_CASES)


def get_hard_case(name: str) -> HardCase:
    """Return a hard case; nothing is built yet.

    Raises
    ------
    UnknownNameError
        No such case; with the nearest name.
    """
    if name not in _CASES:
        raise hrt.UnknownNameError("hard case", name, _CASES)
    return _CASES[name]
