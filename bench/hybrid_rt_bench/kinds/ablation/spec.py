"""Experiments of kind "ablation"."""

from __future__ import annotations

from typing import Literal

from hybrid_rt_bench.judged.spec import JudgedExperiment


class AblationExperiment(JudgedExperiment):
    """The switches of the certified march: an experiment of kind "ablation"."""

    kind: Literal["ablation"] = "ablation"
