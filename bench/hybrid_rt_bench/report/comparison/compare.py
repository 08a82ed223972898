"""Compare two sides of runs of one kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.report.comparison import counted, warned
from hybrid_rt_bench.report.comparison.counted import Difference
from hybrid_rt_bench.report.comparison.rounds import identity, middles, rounds_of
from hybrid_rt_bench.results.compared import Compared
from hybrid_rt_bench.results.effects import (
    LEVEL,
    SMALLEST,
    Effect,
    Side,
    disagreement,
    effect,
    holm,
    restlessness,
)
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_bench.results.schema import Schema

SHORT, SHORTEST = 0.02, 1e-3
"""A time that is a smaller share of its baseline, or whose fastest round took fewer seconds, is not
judged: it is the clock's and the scheduler's."""

Runs = Sequence[RunData]
Place = tuple[Any, ...]


@dataclass(frozen=True)
class Change:
    """How a time changed, in one cell or over all that both sides have.

    Attributes
    ----------
    names : dict
        Whose time it is: the technique and what else the kind says.
    timing : str
    cell : dict
        Empty for the mean over cells.
    effect : Effect
    before_ms, after_ms : float
        Medians as they are, not normalised; geometric means over runs and cells.
    judged : bool
        Whether it can be called a change. A baseline cannot, since nothing is beside it, nor what
        is far shorter than its baseline.
    p : float
        Corrected for all that are judged, NaN where it is not.
    verdict : {"slower", "faster", ""}
    """

    names: dict[str, Any]
    timing: str
    cell: dict[str, Any]
    effect: Effect
    before_ms: float
    after_ms: float
    judged: bool
    p: float = float("nan")
    verdict: str = ""


@dataclass(frozen=True)
class Comparison:
    """What became of the runs of one side in those of the other.

    Attributes
    ----------
    kind : str
    before, after : list of str
        Names of the runs.
    groups : list of Change
        Means over cells.
    cells : list of Change
        Cell by cell; judged by themselves only with repeated runs.
    differences : list of Difference
        What is counted and not the same.
    counted : int
        How many rows were held to be the same.
    alone : tuple of two lists of dict
        Rows that only the runs before, or only those after, have.
    foreign : list of str
        In what the machines differ; their times are then those of other machines.
    warnings : list of str
    smallest : float
        The smallest change that is reported, as a share.
    """

    kind: str
    before: list[str]
    after: list[str]
    groups: list[Change]
    cells: list[Change]
    differences: list[Difference]
    counted: int
    alone: tuple[list[dict[str, Any]], list[dict[str, Any]]]
    foreign: list[str]
    warnings: list[str]
    smallest: float = SMALLEST
    baselines: list[Change] = field(default_factory=list)

    @property
    def changes(self) -> list[Change]:
        """All times that changed: means first, then the cells of those whose mean did not."""
        groups = [change for change in self.groups if change.verdict]
        named = {(str(change.names), change.timing) for change in groups}
        cells = [c for c in self.cells if c.verdict and (str(c.names), c.timing) not in named]
        return groups + cells

    @property
    def changed(self) -> bool:
        """Whether anything changed, times or counts."""
        return bool(self.changes or self.differences)


def compare(
    before: Runs, after: Runs, compared: Compared, schema: Schema, smallest: float = SMALLEST
) -> Comparison:
    """Return how the runs of one side differ from those of the other.

    Raises
    ------
    ArgumentError
        No row in common.
    ReportsError
        Times that are none.
    """
    result = counted.counted(before, after, compared, schema)
    cell = identity(compared, schema)
    names = list(compared.names)
    place = [*cell, *names, "timing"]
    sides = [
        [middles(rounds_of(run, compared, schema), place) for run in side]
        for side in (before, after)
    ]
    if not result.common:
        raise ArgumentError(
            "runs", f"a row that {before[0].name} and {after[0].name} share", "none in common"
        )
    found = _Times(cell, names, sides, warned.chosen(before, after, compared, schema))
    raw = {timing.name for timing in compared.timings if not timing.baseline}
    cells = [c for c in found.cells() if c.timing not in raw]
    groups = [c for c in found.groups() if c.timing not in raw]
    return Comparison(
        before[0].kind,
        [run.name for run in before],
        [run.name for run in after],
        _judged(groups, smallest),
        _judged(cells, smallest) if len(before) + len(after) > 2 else cells,
        result.differences,
        len(result.common),
        _alone(result.alone, found, place),
        warned.foreign(before, after),
        warned.warnings(before, after),
        smallest,
        [c for c in found.groups() if c.timing in raw],
    )


class _Times:
    """The times of both sides, those that every run has first."""

    def __init__(
        self,
        cell: list[str],
        names: list[str],
        sides: list[list[pd.DataFrame]],
        same_path: dict[Place, bool],
    ) -> None:
        self.cell, self.names, self.sides, self.same_path = cell, names, sides, same_path
        self.common = _in_order(sides)
        self.short = _short_ones(sides, self.common)
        self.runs = sum(map(len, sides))

    def groups(self) -> list[Change]:
        """Return the change of every time over all the cells in which every run has it."""
        groups: dict[Place, list[Place]] = {}
        everywhere = [frame for side in self.sides for frame in side]
        for key in self.common:
            if all(key in frame.index for frame in everywhere):
                groups.setdefault(key[len(self.cell) :], []).append(key)
        kept = []
        for keys in groups.values():
            longest = [key for key in keys if not self._short(key)]
            kept.append(longest or keys)

        def changes(restless: float) -> list[Change]:
            return [self._change(keys[0], keys, {}, restless) for keys in kept]

        first = changes(1.0)
        tested = [change.effect.excess for change in first if change.judged]
        return changes(restlessness(tested, self.runs))

    def cells(self) -> list[Change]:
        """Return the change of every row that both sides have."""
        first = [self._change(key, [key], self._named(key), 1.0) for key in self.common]
        tested = [change.effect.excess for change in first if change.judged]
        restless = restlessness(tested, self.runs)
        by_time: dict[Place, list[Effect]] = {}
        for key, change in zip(self.common, first, strict=True):
            by_time.setdefault(key[len(self.cell) :], []).append(change.effect)
        apart = {time: disagreement(effects) for time, effects in by_time.items()}
        return [
            self._change(key, [key], self._named(key), restless * apart[key[len(self.cell) :]])
            for key in self.common
        ]

    def _named(self, key: Place) -> dict[str, Any]:
        return dict(zip(self.cell, key[: len(self.cell)], strict=True))

    def _change(
        self, key: Place, keys: list[Place], cell: dict[str, Any], restless: float
    ) -> Change:
        before, after = (self._side(frames, keys) for frames in self.sides)
        raw = bool(np.isnan(before.baseline).any())
        return Change(
            names=dict(zip(self.names, key[len(self.cell) : -1], strict=True)),
            timing=str(key[-1]),
            cell=cell,
            effect=effect(before, after, restless),
            before_ms=_milliseconds(before),
            after_ms=_milliseconds(after),
            judged=not raw and not all(self._short(one) for one in keys),
        )

    def _side(self, frames: list[pd.DataFrame], keys: list[Place]) -> Side:
        having = [frame.loc[keys] for frame in frames if all(key in frame.index for key in keys)]
        paths = [self.same_path.get(key[: len(self.cell)], True) for key in keys]

        def values(name: str) -> NDArray[np.float64]:
            return np.array([frame[name].to_numpy(np.float64) for frame in having])

        return Side(
            level=values("level"),
            variance=values("variance"),
            baseline=values("baseline"),
            scatter=values("scatter"),
            seconds=values("seconds"),
            same_path=np.array(paths, np.bool_),
        )

    def _short(self, key: Place) -> bool:
        return key in self.short


def _short_ones(sides: list[list[pd.DataFrame]], keys: list[Place]) -> set[Place]:
    """Return the rows that are too short to be judged.

    Of all rounds the fastest counts: in others the scheduler makes a short stage long.
    """
    every = pd.concat([frame for side in sides for frame in side])
    least = every[["level", "shorter", "baseline"]].groupby(level=list(range(every.index.nlevels)))
    low = least.min()
    small = (low.level < np.log(SHORT)) & low.baseline.notna() | (low.shorter < SHORTEST)
    return set(low.index[small]) & set(keys)


def _milliseconds(side: Side) -> float:
    return 1e3 * float(np.exp(np.log(side.seconds).mean()))


def _alone(
    rows: tuple[list[dict[str, Any]], list[dict[str, Any]]], times: _Times, place: list[str]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the rows that one side has alone, and those of its times in other rows."""
    found, common = [], set(times.common)
    for mine, frames in zip(rows, times.sides, strict=True):
        keys = dict.fromkeys(key for frame in frames for key in frame.index)
        lone = [dict(zip(place, key, strict=True)) for key in keys if key not in common]
        listed = [tuple(row.items()) for row in mine]
        extra = [row for row in lone if tuple(row.items())[:-1] not in listed]
        found.append([*mine, *extra])
    return found[0], found[1]


def _in_order(sides: list[list[pd.DataFrame]]) -> list[Place]:
    """Return the rows that some run of each side has, as the first run has them."""
    before, after = (dict.fromkeys(key for f in side for key in f.index) for side in sides)
    return [key for key in before if key in after]


def _judged(changes: list[Change], smallest: float) -> list[Change]:
    """Return the changes with their corrected p and their verdict.

    Means and cells are two families, and each has half of `LEVEL`.
    """
    tested = [k for k, change in enumerate(changes) if change.judged]
    found = list(changes)
    for k, p in zip(tested, holm([changes[k].effect.p for k in tested]), strict=True):
        ratio = changes[k].effect.ratio
        large = max(ratio, 1 / ratio) >= 1 + smallest
        word = ("slower" if ratio > 1 else "faster") if large and p <= LEVEL / 2 else ""
        found[k] = replace(changes[k], p=p, verdict=word)
    return found
