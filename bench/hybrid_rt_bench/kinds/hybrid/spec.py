"""Experiments of kind "hybrid"."""

from __future__ import annotations

from typing import Literal

from hybrid_rt_bench.judged.spec import JudgedExperiment


class HybridExperiment(JudgedExperiment):
    """The certified hybrid, end to end: an experiment of kind "hybrid"."""

    kind: Literal["hybrid"] = "hybrid"
