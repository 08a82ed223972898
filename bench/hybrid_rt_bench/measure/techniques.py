"""What can be measured against the strongest Embree."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import hybrid_rt as hrt
from hybrid_rt.errors import UnknownNameError

Points = list[tuple[str, hrt.Mode]]


@dataclass(frozen=True)
class Technique:
    """A way of answering secondary rays.

    Attributes
    ----------
    name : str
    description : str
    reference : str
        Who published it.
    mode : Mode
        With the published default parameters.
    grid : callable
        Takes the diagonal of a scene's bounding box, world units; see `points`.
    """

    name: str
    description: str
    reference: str
    mode: hrt.Mode
    grid: Callable[[float], Points]

    def points(self, scene: hrt.Scene) -> Points:
        """Return the labels and modes to try on a scene, in the order of a curve.

        Thicknesses are fractions of the scene's diagonal; labels are short and say what differs.
        """
        return self.grid(scene.diagonal)

    @property
    def parameters(self) -> dict[str, str]:
        """The default parameters in words."""
        return {f.name: _words(self.mode, f.name) for f in dataclasses.fields(self.mode)}


def _words(mode: hrt.Mode, name: str) -> str:
    value = getattr(mode, name)
    if name == "thickness" and value is None:
        return _percent(hrt.DEFAULT_THICKNESS)
    if value is None:
        return "no limit"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}"


def _percent(fraction: float) -> str:
    return f"{100 * fraction:g} %"


THICKNESSES = (0.0002, 0.001, 0.005, 0.02)
LINEAR_REACH = hrt.Linear().stride * hrt.Linear().max_steps


def _paper(_: float) -> Points:
    return [(f"samples {n}", hrt.Paper(samples=n)) for n in (1, 2, 4, 8)]


def _slope(_: float) -> Points:
    return [(f"samples {n}", hrt.SlopeAware(samples=n)) for n in (1, 4)]


def _linear(diagonal: float) -> Points:
    # A finer stride gets more steps, so that all reach as far.
    points: Points = []
    for stride in (0.005, 0.02, 0.05):
        steps = round(LINEAR_REACH / stride)
        for share in THICKNESSES:
            label = f"thickness {_percent(share)}, stride {_percent(stride)}"
            points.append((label, hrt.Linear(share * diagonal, stride, max_steps=steps)))
    unrefined = hrt.Linear(hrt.DEFAULT_THICKNESS * diagonal, refinements=0)
    return [*points, (f"thickness {_percent(hrt.DEFAULT_THICKNESS)}, unrefined", unrefined)]


def _dda(diagonal: float) -> Points:
    return [
        (f"thickness {_percent(share)}, stride {stride}", hrt.PixelDDA(share * diagonal, stride))
        for stride in (1, 4, 16)
        for share in THICKNESSES
    ]


def _hiz(diagonal: float) -> Points:
    default = hrt.HiZ(hrt.DEFAULT_THICKNESS * diagonal)
    switches: dict[str, dict[str, Any]] = {
        "exhausted traced": {"exhausted_hits": False},
        "background traced": {"trace_background": True},
        "exhausted and background traced": {"exhausted_hits": False, "trace_background": True},
        "no vignette": {"border": 0.0},
        "threshold 0.5": {"threshold": 0.5},
        "128 steps": {"max_steps": 128},
    }
    label = f"thickness {_percent(hrt.DEFAULT_THICKNESS)}"
    return [
        *((f"thickness {_percent(share)}", hrt.HiZ(share * diagonal)) for share in THICKNESSES),
        *(
            (f"{label}, {words}", dataclasses.replace(default, **changes))
            for words, changes in switches.items()
        ),
    ]


TECHNIQUES = {
    technique.name: technique
    for technique in (
        Technique(
            "paper",
            "The paper's strict march through a nearest-depth pyramid, then Embree for the rest",
            "Pikulsky 2025",
            hrt.Paper(),
            _paper,
        ),
        Technique(
            "slope",
            "The paper's march over planes that bound tilted pixels: as strict, less often blocked",
            "this project",
            hrt.SlopeAware(),
            _slope,
        ),
        Technique(
            "linear",
            "Equal steps in the world and a thickness, then halving the last step",
            "Sousa et al. 2011, Stachowiak 2015",
            hrt.Linear(),
            _linear,
        ),
        Technique(
            "dda",
            "Every pixel, or every few, along the ray's line on the screen, and a thickness",
            "McGuire and Mara 2014",
            hrt.PixelDDA(),
            _dda,
        ),
        Technique(
            "hiz",
            "Nearest-depth pyramid, trusted by a confidence from a thickness and a vignette",
            "AMD FidelityFX hybrid reflections 2023",
            hrt.HiZ(),
            _hiz,
        ),
        Technique(
            "certified",
            "Exact tests against the few primitives that can touch a pixel: only what is proven",
            "this project",
            hrt.Certified(),
            lambda _: [("default", hrt.Certified())],
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
