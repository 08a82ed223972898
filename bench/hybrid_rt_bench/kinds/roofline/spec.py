"""Settings of experiments of kind "roofline"."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.measure.experiment import (
    ResolutionText,
    Rounds,
    SceneExperiment,
    SelectionRays,
)


class RooflineExperiment(SceneExperiment):
    """What the certified march does and reads, beside what this machine and Embree leave it.

    Attributes
    ----------
    resolutions : list of Resolution
    lists : int
        Length of the lists of primitives.
    rounds : int
        Timed rounds of each view.
    selection_rays : int
        As the comments in the TOML files say.
    table_kib : list of int
        Sizes of the tables that the machine's rates are measured with, ascending powers of two.
    repeats : int
        Of each rate, of which the fastest counts.
    repeat_seconds : float
        What a repeat takes at least.
    """

    kind: Literal["roofline"] = "roofline"
    resolutions: list[ResolutionText] = Field(min_length=1)
    lists: int = Field(strict=True, ge=1, le=64)
    rounds: Rounds
    selection_rays: SelectionRays = 131072
    table_kib: list[int] = Field(min_length=1)
    repeats: Rounds
    repeat_seconds: float = Field(gt=0, le=10)

    @field_validator("table_kib")
    @classmethod
    def _powers(cls, value: list[int]) -> list[int]:
        powers = all(1 <= n <= 2**20 and n & (n - 1) == 0 for n in value)
        if not powers or sorted(set(value)) != value:
            raise ArgumentError("table_kib", "ascending powers of two, 1 to 2**20", str(value))
        return value
