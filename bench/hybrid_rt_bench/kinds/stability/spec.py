"""Settings of experiments of kind "stability"."""

from __future__ import annotations

from typing import Literal

from hybrid_rt_bench.measure.experiment import (
    AnyExperiment,
    Names,
    Text,
)

Tracer = Literal["embree default", "embree robust"]


class StabilityExperiment(AnyExperiment):
    """The hard set over techniques and tracers.

    Attributes
    ----------
    techniques : list of str, optional
        Registered techniques. Default: all of them.
    tracers : list of str
        Exact tracers that stand beside them, held to exact answers.
    promised : list of str
        Those of the techniques that are held to exact answers; a case that one of them fails makes
        the run a failure.
    cases : list of str, optional
        Names of hard cases. Default: all of them.
    """

    kind: Literal["stability"] = "stability"
    techniques: Names | None = None
    tracers: list[Tracer]
    promised: list[Text]
    cases: Names | None = None
