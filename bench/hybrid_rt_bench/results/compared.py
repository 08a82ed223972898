"""What of a kind's results is compared between runs, as data.

A kind says which of its columns are the same in every run of one program, and which of its samples
are times, with the baseline that was timed beside each. How these are compared is one thing for all
kinds: `hybrid_rt_bench.report.comparison`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Timing:
    """A time in a kind's samples, and the baseline of the same round.

    Attributes
    ----------
    name : str
        What reports call it.
    parts : tuple of str
        The columns of the samples, or the stages, whose seconds it is the sum of. Default: `name`.
    baseline : str
        The column or stage that the strongest tracer took in the same round. Empty for a time that
        is a baseline itself: it has nothing beside it, and can only be compared raw.
    of : tuple of str, optional
        Which of the `Compared.names` it has. Default: all of them; none for a time that belongs to
        the cell, and not to one of the techniques in it.
    amount, baseline_amount : str
        Columns by which the seconds and those of the baseline are divided first, such as a number
        of rays that is not the same in every run: of the results, and of the samples.
    """

    name: str
    parts: tuple[str, ...] = ()
    baseline: str = ""
    of: tuple[str, ...] | None = None
    amount: str = ""
    baseline_amount: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """What it is the sum of."""
        return self.parts or (self.name,)


@dataclass(frozen=True)
class Compared:
    """How runs of a kind are compared.

    Attributes
    ----------
    exact : tuple of str
        Columns of the results that are the same in every run of one program: counts, shares,
        errors.
    names : tuple of str
        Columns that tell the rows of a cell apart, in the results, the samples and the verdicts.
    cell : tuple of str
        Columns of the results that say which cell it is. Default: the keys of the schema.
    timings : tuple of Timing
    stage : str
        The column of the samples that names the stage, where each stage is a row with its
        ``seconds``; empty where the stages are columns.
    chosen : tuple of str
        What was chosen while running, such as the strongest path of the baseline: columns of the
        results, or what ``run.json`` says of the cell.
    loose : tuple of (str, value)
        Rows of the results with such a value in such a column depend on what was chosen, and are
        not held to be the same.
    """

    exact: tuple[str, ...]
    names: tuple[str, ...] = ("technique",)
    cell: tuple[str, ...] = ()
    timings: tuple[Timing, ...] = ()
    stage: str = ""
    chosen: tuple[str, ...] = ()
    loose: tuple[tuple[str, Any], ...] = ()
