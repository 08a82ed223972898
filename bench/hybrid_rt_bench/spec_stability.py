"""Settings of experiments of kind "stability"."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from hybrid_rt_bench.spec_base import AnyExperiment

Tracer = Literal["embree default", "embree robust"]


class StabilityExperiment(AnyExperiment):
    """The hard set over techniques and tracers.

    Attributes
    ----------
    techniques : list of str, optional
        Names registered in `hybrid_rt_bench.techniques`. Default: all of them.
    tracers : list of str
        Exact tracers that stand beside them, held to exact answers.
    promised : list of str
        Those of the techniques that are held to exact answers; a case that one of them fails makes
        the run a failure.
    cases : list of str, optional
        Names of hard cases. Default: all of them.
    """

    options: ClassVar[frozenset[str]] = frozenset({"cases"})

    kind: Literal["stability"] = "stability"
    techniques: list[str] | None = Field(default=None, min_length=1)
    tracers: list[Tracer]
    promised: list[str]
    cases: list[str] | None = Field(default=None, min_length=1)
