"""Settings of experiments of kind "peers"."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from hybrid_rt_bench.spec_base import ResolutionText, SceneExperiment


class PeersExperiment(SceneExperiment):
    """The same rays through other programs, and the same pictures.

    Attributes
    ----------
    peers : list of str
        Names registered in `hybrid_rt_bench.peers`.
    resolutions : list of Resolution
    rounds : int
        Timed rounds of each peer.
    selection_rays : int
        As in ``experiments/paper.toml``.
    sample_seconds : float
        A peer that is sampled gets about as many rays as it traces in this time.
    patience_seconds : float
        A peer that has not built a scene and answered a few rays by then is given up.
    """

    options: ClassVar[frozenset[str]] = frozenset({"scenes", "cameras", "resolutions", "rounds"})

    kind: Literal["peers"] = "peers"
    peers: list[str] = Field(min_length=1)
    resolutions: list[ResolutionText] = Field(min_length=1)
    rounds: int = Field(ge=1)
    selection_rays: int = Field(default=131072, ge=1024)
    sample_seconds: float = Field(gt=0)
    patience_seconds: float = Field(gt=0)
