"""Settings of experiments of kind "peers"."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from hybrid_rt_bench.measure.experiment import (
    Names,
    ResolutionText,
    Rounds,
    SceneExperiment,
    Seconds,
    SelectionRays,
)


class PeersExperiment(SceneExperiment):
    """The same rays through other programs, and the same pictures.

    Attributes
    ----------
    peers : list of str
        Names registered in `hybrid_rt_bench.kinds.peers.programs`.
    resolutions : list of Resolution
    rounds : int
        Timed rounds of each peer.
    selection_rays : int
        As the comments in the TOML files say.
    sample_seconds : float
        A peer that is sampled gets about as many rays as it traces in this time.
    patience_seconds : float
        A peer that has not built a scene and answered a few rays by then is given up.
    """

    kind: Literal["peers"] = "peers"
    peers: Names
    resolutions: list[ResolutionText] = Field(min_length=1)
    rounds: Rounds
    selection_rays: SelectionRays = 131072
    sample_seconds: Seconds
    patience_seconds: Seconds
