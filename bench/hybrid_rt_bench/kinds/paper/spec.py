"""Experiments of kind "paper": scenes, cameras, resolutions; every technique timed on each."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field

from hybrid_rt_bench.kinds.paper import published
from hybrid_rt_bench.measure.experiment import (
    Names,
    Passes,
    Resolution,
    ResolutionText,
    Rounds,
    SceneExperiment,
    SelectionRays,
)


class PaperExperiment(SceneExperiment):
    """An experiment of kind "paper".

    Attributes
    ----------
    techniques : list of str
        Registered techniques.
    scenes, resolutions, picture, rounds, warmup, cameras, derivatives, selection_rays
        As the comments in ``paper.toml`` say. `cameras` limits the number of cameras a scene.
    """

    kind: Literal["paper"] = "paper"
    techniques: Names
    resolutions: list[ResolutionText] = Field(min_length=1)
    picture: ResolutionText
    rounds: Rounds
    warmup: Passes = 1
    derivatives: Literal["plane", "quad"] = "plane"
    selection_rays: SelectionRays = 131072

    def row_of(self, scene: str) -> str:
        """Return the paper's row for a scene given by name on the command line."""
        return super().row_of(scene) or published.ROWS.get(scene, "")

    def overridden(
        self,
        resolutions: list[Resolution] | None = None,
        rounds: int | None = None,
        techniques: list[str] | None = None,
    ) -> Self:
        """Return the experiment with what the command line changes; None changes nothing."""
        changed = super().overridden(resolutions, rounds, techniques)
        if resolutions is None or self.picture in resolutions:
            return changed
        # The figure is made at the middle one of the sizes measured.
        order = sorted(resolutions, key=lambda r: r.width * r.height)
        return changed.model_copy(update={"picture": order[len(order) // 2]})
