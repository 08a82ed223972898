"""Experiments of kind "frame"."""

from __future__ import annotations

from typing import Literal

from hybrid_rt_bench.measure.experiment import AnyExperiment, Names


class FrameExperiment(AnyExperiment):
    """What the screen answers in a frame of someone's own; nothing is timed.

    Attributes
    ----------
    techniques : list of str
        Registered techniques, each with its default parameters.
    workloads : list of str
        Which rays. Those that need the mesh are left out where it is not given.
    """

    kind: Literal["frame"] = "frame"
    techniques: Names
    workloads: Names
