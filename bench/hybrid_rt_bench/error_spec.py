"""Experiments of kind "error": what every technique gets wrong, beside what it is worth in time."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.spec_base import Resolution, ResolutionText, SceneExperiment

Which = Literal["all", "default", "switches", "cheapest"]
"""Which points of a technique are measured; see `hybrid_rt_bench.points.points_of`."""


class WorkloadEntry(BaseModel):
    """One kind of rays of an experiment.

    Attributes
    ----------
    name : str
        Registered in `hybrid_rt_bench.workloads`.
    points : {"all", "default", "switches", "cheapest"}
        Which parameters of each technique are measured; see `hybrid_rt_bench.points.points_of`.
    cameras : int, optional
        Time only the first so many cameras of each scene; the others are counted. Default: all.
    seeds : int
        Number of sets of rays, each drawn anew. Only the first is timed.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(min_length=1)
    points: Which = "default"
    cameras: int | None = Field(default=None, ge=0)
    seeds: int = Field(default=1, ge=1)


class ErrorExperiment(SceneExperiment):
    """An experiment of kind "error".

    A cell is a scene, a camera, a resolution, a workload and a seed. A cell is *timed*, which means
    that all techniques are judged and timed, or *counted*: only some are judged, nothing is timed.

    Attributes
    ----------
    techniques : list of str
        Names registered in `hybrid_rt_bench.techniques`.
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
        As in ``experiments/paper.toml``.
    """

    options: ClassVar[frozenset[str]] = frozenset({"scenes", "cameras", "resolutions", "rounds"})

    kind: Literal["error"] = "error"
    techniques: list[str] = Field(min_length=1)
    counted: list[str] = Field(default_factory=list)
    workloads: list[WorkloadEntry] = Field(min_length=1)
    resolutions: list[ResolutionText] = Field(min_length=1)
    timed: list[ResolutionText] = Field(min_length=1)
    complete: list[ResolutionText] | None = None
    picture: ResolutionText | None = None
    rounds: int = Field(ge=1)
    selection_rays: int = Field(default=131072, ge=1024)

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

    def overridden(self, resolutions: list[Resolution] | None, rounds: int | None) -> Self:
        """Return the experiment with what the command line changes; None changes nothing."""
        changed = super().overridden(resolutions, rounds)
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
