"""Experiments of kind "scaling": time and memory along one axis, all else fixed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from hybrid_rt.errors import ArgumentError, UnknownNameError
from hybrid_rt_bench.measure.experiment import (
    MOST_TRIANGLES,
    AnyExperiment,
    Name,
    Names,
    Passes,
    Resolution,
    ResolutionText,
    Rounds,
    Seconds,
    SelectionRays,
    Text,
)

Axis = Literal["triangles", "pixels", "threads"]


class BruteForce(BaseModel):
    """How far the tracer that tests every triangle is taken along.

    Attributes
    ----------
    rays : int
        A sample of the mirror rays, in a few runs of neighbours.
    seconds : float
        It is left out of a cell where one pass over the sample would take longer.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    rays: int = Field(default=2048, strict=True, ge=64, le=2**27, multiple_of=8)
    seconds: Seconds = 2.0


class Series(BaseModel):
    """Cells that differ in one thing.

    Attributes
    ----------
    name : str
        Unique in the experiment.
    axis : {"triangles", "pixels", "threads"}
        What they differ in.
    scene : str
        A registered scene, or a path to a mesh file.
    camera : str, optional
        Default: the scene's first.
    triangles : list of int or str, optional
        Of the axis "triangles": numbers asked of the scene's generator, also "2^10..2^23" for every
        power of two between. On another axis: one number, or none for the scene's own.
    resolutions : list of Resolution
        Of the axis "pixels": all of them; on another axis the one that all cells have.
    threads : list of int, optional
        Of the axis "threads"; those that the machine does not have are left out. Default: 1 to all,
        thinned out above 8. No other axis has it.
    build : bool
        Whether Embree's structure is built anew, and timed, in every round.
    brute_force : BruteForce, optional
        Default: none.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Name
    axis: Axis
    scene: Text
    camera: Text | None = None
    triangles: list[int] = Field(default_factory=list)
    resolutions: list[ResolutionText] = Field(min_length=1)
    threads: list[int] | None = Field(default=None, min_length=1)
    build: bool = True
    brute_force: BruteForce | None = None

    @field_validator("triangles", mode="before")
    @classmethod
    def _ranges(cls, value: Any) -> Any:
        return parse_counts("triangles", value if isinstance(value, list) else [value])

    @field_validator("threads")
    @classmethod
    def _at_least_one(cls, value: list[int] | None) -> list[int] | None:
        if value is not None and min(value) < 1:
            raise ArgumentError("threads", "integers >= 1", str(min(value)))
        return value

    @model_validator(mode="after")
    def _one_axis(self) -> Self:
        if self.axis == "triangles" and not self.triangles:
            raise ArgumentError("triangles", "at least one number on axis 'triangles'", "none")
        for name, most in (("triangles", 1), ("resolutions", 1), ("threads", 0)):
            own = "pixels" if name == "resolutions" else name
            given = getattr(self, name) or []
            if self.axis != own and len(given) > most:
                raise ArgumentError(
                    name, f"at most {most} of them on axis {self.axis!r}", str(len(given))
                )
        return self


class ScalingExperiment(AnyExperiment):
    """An experiment of kind "scaling".

    A cell is one place of one series. The cells of a series are measured in turn, round after
    round.

    Attributes
    ----------
    techniques : list of str
        Registered techniques, with their default parameters.
    series : list of Series
    rounds : int
        Measured rounds.
    warmup : int
        Passes of a cell that are thrown away before the measured one, in every round.
    selection_rays : int
        Rays on which the candidates for the strongest Embree compete in each cell.
    """

    kind: Literal["scaling"] = "scaling"
    techniques: Names
    series: list[Series] = Field(min_length=1)
    rounds: Rounds
    warmup: Passes = 1
    selection_rays: SelectionRays = 131072

    @field_validator("series")
    @classmethod
    def _names_differ(cls, value: list[Series]) -> list[Series]:
        names = [series.name for series in value]
        for name in names:
            if names.count(name) > 1:
                raise ArgumentError("series", "names that differ", f"{name!r} twice")
        return value

    def overridden(
        self,
        resolutions: list[Resolution] | None = None,
        rounds: int | None = None,
        techniques: list[str] | None = None,
    ) -> Self:
        """Return the experiment with what the command line changes; None changes nothing.

        Resolutions are those of the axis "pixels"; the other axes keep theirs.
        """
        changed = super().overridden(None, rounds, techniques)
        if resolutions is None:
            return changed
        return changed._with_series("pixels", {"resolutions": resolutions})

    def picked(self, names: Sequence[str] | None, triangles: Sequence[str] | None) -> Self:
        """Return the experiment with only some of its series, or other numbers of triangles.

        Parameters
        ----------
        names : sequence of str, optional
            Names of series, or axes, which stand for all series along them.
        triangles : sequence of str, optional
            For the series along "triangles", as `Series.triangles` has them.

        Raises
        ------
        UnknownNameError
            Neither the name of a series nor an axis.
        ArgumentError
            Numbers of triangles that cannot be read.
        """
        changed = self
        if names is not None:
            known = dict.fromkeys([s.name for s in self.series] + [s.axis for s in self.series])
            for name in names:
                if name not in known:
                    raise UnknownNameError("series", name, known)
            left = [s for s in self.series if s.name in names or s.axis in names]
            changed = changed.model_copy(update={"series": left})
        if triangles is not None:
            counts = parse_counts("--triangles", list(triangles))
            changed = changed._with_series("triangles", {"triangles": counts})
        return changed

    def _with_series(self, axis: Axis, changes: dict[str, Any]) -> Self:
        series = [s.model_copy(update=changes) if s.axis == axis else s for s in self.series]
        return self.model_copy(update={"series": series})


def parse_counts(argument: str, values: list[Any]) -> list[int]:
    """Return numbers of triangles, in order and each once.

    Parameters
    ----------
    argument : str
        Named in messages.
    values : list of int or str
        Numbers, as 4096 or "2^12", and ranges of powers of two, "2^10..2^23".

    Raises
    ------
    ArgumentError
        Anything else.
    """
    found: set[int] = set()
    for value in values:
        first, dots, last = str(value).partition("..")
        ends = [_count(first), _count(last if dots else first)]
        if isinstance(value, bool) or None in ends or (dots and not _powers(ends)):
            raise ArgumentError(
                argument, "numbers such as 4096 or 2^12, or a range 2^10..2^23", repr(value)
            )
        low, high = (int(end or 0) for end in ends)
        if high > MOST_TRIANGLES:
            raise ArgumentError(argument, f"at most {MOST_TRIANGLES} triangles", repr(value))
        while low <= high:
            found.add(low)
            low *= 2
    return sorted(found)


def _count(text: str) -> int | None:
    match = re.fullmatch(r"\s*(?:2\^(\d{1,2})|(\d{1,12}))\s*", text)
    if not match:
        return None
    value = 2 ** int(match[1]) if match[1] else int(match[2])
    return value if value >= 1 else None


def _powers(ends: Sequence[int | None]) -> bool:
    return all(end is not None and end & (end - 1) == 0 for end in ends) and ends == sorted(
        ends, key=lambda end: end or 0
    )
