"""Experiments of kind "error"."""

from __future__ import annotations

from typing import Literal

from hybrid_rt_bench.judged.spec import JudgedExperiment


class ErrorExperiment(JudgedExperiment):
    """What every technique gets wrong: an experiment of kind "error"."""

    kind: Literal["error"] = "error"
