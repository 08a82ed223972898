"""Experiments of kind "lists"."""

from __future__ import annotations

from typing import Literal

from hybrid_rt_bench.judged.spec import JudgedExperiment


class ListsExperiment(JudgedExperiment):
    """How long a list of primitives pays: an experiment of kind "lists"."""

    kind: Literal["lists"] = "lists"
