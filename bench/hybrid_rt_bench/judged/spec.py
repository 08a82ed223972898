"""Experiments that judge every answer and time some of them beside the strongest Embree."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.measure.experiment import (
    MOST_ROUNDS,
    Names,
    Resolution,
    ResolutionText,
    Rounds,
    SceneExperiment,
    SelectionRays,
    Text,
)

Which = Literal["all", "default", "switches", "cheapest"]
"""Which points of a technique are measured; see `hybrid_rt_bench.measure.screens.points_of`."""


class WorkloadEntry(BaseModel):
    """One kind of rays of an experiment.

    Attributes
    ----------
    name : str
        Registered in `hybrid_rt_bench.measure.workloads`.
    points : {"all", "default", "switches", "cheapest"}
        Which parameters of each technique are measured; see `measure.screens.points_of`.
    cameras : int, optional
        Time only the first so many cameras of each scene; the others are counted. Default: all.
    seeds : int
        Number of sets of rays, each drawn anew. Only the first is timed.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Text
    points: Which = "default"
    cameras: int | None = Field(default=None, strict=True, ge=0)
    seeds: int = Field(default=1, strict=True, ge=1, le=MOST_ROUNDS)


class JudgedExperiment(SceneExperiment):
    """An experiment of a kind that judges.

    A cell is a scene, a camera, a resolution, a workload and a seed. A cell is *timed*, which means
    that all techniques are judged and timed, or *counted*: only some are judged, nothing is timed.

    Attributes
    ----------
    techniques : list of str
        Registered techniques.
    counted : list of str
        Those that are judged, with their default parameters, in the cells that are not timed; and
        the only ones in timed cells that are not `complete`.
    workloads : list of WorkloadEntry
    resolutions : list of Resolution
    timed : list of Resolution
        At which cells are timed.
    complete : list of Resolution, optional
        At which timed cells all techniques are measured, and Embree's two modes beside them; some
        of `timed`. Default: all of them.
    picture : Resolution, optional
        At which mirror cells keep error maps and the error of the image; one of `timed`.
    rounds : int
        Timed rounds of a point; the round in which it is judged is their warm-up.
    scenes, cameras, selection_rays
        As the comments in the TOML files say.
    """

    techniques: Names
    counted: list[Text] = Field(default_factory=list)
    workloads: list[WorkloadEntry] = Field(min_length=1)
    resolutions: list[ResolutionText] = Field(min_length=1)
    timed: list[ResolutionText] = Field(min_length=1)
    complete: list[ResolutionText] | None = None
    picture: ResolutionText | None = None
    rounds: Rounds
    selection_rays: SelectionRays = 131072

    @field_validator("counted", "timed", "complete", "picture")
    @classmethod
    def _is_known(cls, value: Any, info: ValidationInfo) -> Any:
        name = str(info.field_name)
        of = {"counted": "techniques", "timed": "resolutions"}.get(name, "timed")
        known = info.data.get(of, [])
        for item in value if isinstance(value, list) else [value]:
            if known and item not in known:
                listed = ", ".join(str(k) for k in known)
                raise ArgumentError(name, f"one of {of} ({listed})", str(item))
        return value

    def overridden(
        self,
        resolutions: list[Resolution] | None = None,
        rounds: int | None = None,
        techniques: list[str] | None = None,
    ) -> Self:
        """Return the experiment with what the command line changes; None changes nothing."""
        changed = super().overridden(resolutions, rounds, techniques)
        if techniques is not None:
            # What comes with the experiment is counted as before; what is new is counted as well.
            counted = [n for n in techniques if n in self.counted or n not in self.techniques]
            changed = changed.model_copy(update={"counted": counted})
        if resolutions is None:
            return changed
        order = sorted(resolutions, key=lambda r: r.width * r.height)
        timed = [r for r in order if r in self.timed] or order[:1]
        changes: dict[str, Any] = {"timed": timed}
        if self.picture is not None:
            changes["picture"] = self.picture if self.picture in timed else timed[-1]
        if self.complete is not None:
            changes["complete"] = [r for r in timed if r in self.complete] or timed
        return changed.model_copy(update=changes)
