"""Pool the rows of an error experiment: counts are added up, ratios have a geometric mean.

A row is one point of a technique (its parameters) on the rays of one cell. A *wrong* answer is a
false hit or a false miss; a wrong primitive, within a pixel of the truth, is counted beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.judged.columns import CELL, POINT
from hybrid_rt_bench.results import statistics as stats


@dataclass(frozen=True)
class Pooled:
    """Rows taken together.

    Attributes
    ----------
    rows : DataFrame
        What was pooled.
    """

    rows: pd.DataFrame

    @property
    def rays(self) -> int:
        """Rays of all rows."""
        return int(self.rows["rays"].sum())

    @property
    def resolved(self) -> int:
        """Rays that the screen answers."""
        return int(self.rows["resolved"].sum())

    @property
    def alpha(self) -> float:
        """Resolved rays over rays."""
        return self.resolved / self.rays if self.rays else float("nan")

    def rate(self, verdicts: str | Sequence[str], *, of_all: bool = False) -> Rate:
        """Return the rate of a verdict, or of several together.

        Parameters
        ----------
        verdicts : str or sequence of str
            Of `VERDICTS`.
        of_all : bool
            Of all rays of the hybrid; else of those that the screen answers.
        """
        names = (verdicts,) if isinstance(verdicts, str) else verdicts
        prefix = "all_" if of_all else ""
        count = sum(int(self.rows[prefix + name].sum()) for name in names)
        return Rate.of(count, self.rays if of_all else self.resolved)

    @property
    def tests_per_ray(self) -> float:
        """Exact tests per ray; NaN where there are no rays."""
        return float(self.rows["tests"].sum()) / self.rays if self.rays else float("nan")

    @property
    def steps_per_ray(self) -> float:
        """Samples of the screen per ray; NaN where nothing marches."""
        steps = self.rows["steps"].sum(min_count=1)
        return float(steps) / self.rays if self.rays else float("nan")

    def per_second(self, column: str) -> float:
        """Return millions of rays per second, by a column of milliseconds; NaN if nothing is timed.

        Of all timed rows together: their rays over the sum of their times.
        """
        timed = self.rows[self.rows[column] > 0]
        milliseconds = float(timed[column].sum())
        return float(timed["rays"].sum()) / milliseconds / 1e3 if milliseconds else float("nan")

    def nanoseconds(self, column: str) -> float:
        """Return nanoseconds per ray, by a column of milliseconds; NaN if nothing is timed."""
        return 1e3 / self.per_second(column)

    def median(self, column: str) -> float:
        """Return the median over rows; NaN where no row has a value."""
        return float(self.rows[column].median())

    def largest(self, column: str) -> float:
        """Return the maximum over rows; NaN where no row has a value."""
        return float(self.rows[column].max())

    def mean(self, column: str) -> float:
        """Return the mean over rows; NaN where no row has a value."""
        return float(self.rows[column].mean())

    def speedup(self, samples: pd.DataFrame) -> stats.Estimate | None:
        """Return `ratio` of the strongest Embree, tracing every ray, to the hybrid."""
        return self.ratio(samples, "embree", "hybrid")

    def ratio(self, samples: pd.DataFrame, over: str, under: str) -> stats.Estimate | None:
        """Return the geometric mean over rows of the medians of the rounds' paired ratios.

        Parameters
        ----------
        samples : DataFrame
            All samples of the run, with `CELL` and `POINT`; those of `rows` are taken.
        over, under : str
            Columns of seconds.

        Returns
        -------
        Estimate or None
            With a 95 % bootstrap interval over rounds; None where nothing is timed.
        """
        groups = [(mine[over] / mine[under]).to_numpy() for mine in self._samples_by_row(samples)]
        return stats.geometric_mean_of_medians(groups) if groups else None

    def free_march(self, samples: pd.DataFrame) -> stats.Estimate | None:
        """Return `speedup` as it would be if the march took no time: the most that it can be."""
        if samples.empty:
            return None
        others = samples.assign(others=samples["hybrid"] - samples["march"])
        return self.ratio(others, "embree", "others")

    def break_even_ns(self, samples: pd.DataFrame) -> float:
        """Return the march time at which the hybrid breaks even, ns per ray.

        The time of Embree tracing every ray, less that of the hybrid without its march, each beside
        the other: the median over rounds, added up over rows. Below 0, no march is fast enough; NaN
        where nothing is timed.

        Parameters
        ----------
        samples : DataFrame
            As in `ratio`.
        """
        rows = self._samples_by_row(samples)
        spare = [(mine["embree"] - (mine["hybrid"] - mine["march"])).median() for mine in rows]
        rays = sum(int(mine["rays"].iloc[0]) for mine in rows)
        return 1e9 * float(np.sum(spare)) / rays if rays else float("nan")

    def _samples_by_row(self, samples: pd.DataFrame) -> list[pd.DataFrame]:
        if samples.empty:
            return []
        keys = [*CELL, *POINT]
        mine = samples.merge(self.rows[[*keys, "rays"]], on=keys)
        return [group for _, group in mine.groupby(keys, sort=False)]


def pools(rows: pd.DataFrame, by: Sequence[str]) -> dict[tuple[str, ...], Pooled]:
    """Return rows pooled by the values of some columns, in the order of their first appearance."""
    found = rows.groupby(list(by), sort=False)
    return {tuple(str(part) for part in key): Pooled(group) for key, group in found}


def pareto(error: Sequence[float], worth: Sequence[float]) -> list[int]:
    """Return which points no other one beats, from the least error to the most.

    A point is beaten by one that has no more error and no less worth, and differs.
    """
    order = sorted(range(len(error)), key=lambda i: (error[i], -worth[i]))
    front: list[int] = []
    best = -np.inf
    for i in order:
        if worth[i] > best:
            front.append(i)
            best = worth[i]
    return front
