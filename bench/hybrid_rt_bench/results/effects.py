"""How large a change between two sides of runs is, and whether it is one.

The unit of repetition is the run: rounds of one process share its memory, its place in the caches
and its neighbours, and agree with each other far better than with those of the next process. The
variance between runs is therefore taken from repeated runs, moderated towards what is expected of
any machine, as in G. K. Smyth, "Linear models and empirical Bayes methods for assessing
differential expression", 2004: with few runs the expectation counts, with many what they show. With
one run a side there is nothing but the expectation, which is a cautious one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2, median_abs_deviation
from scipy.stats import t as student

F64 = NDArray[np.float64]

LEVEL = 0.01
"""At most this share of comparisons of equal programs is to report a change anywhere."""

SMALLEST = 0.05
"""No smaller change is reported."""

OF_A_RUN, OF_A_CELL = 0.012, 0.02
"""Expected standard deviations, between processes of one program, of the logarithm of a time over
its baseline: what all cells of a run have in common, and what each has by itself."""

OF_A_CALL = 1e-4
"""Seconds by which waking threads scatters any time."""

NOT_CANCELLED = 0.1
"""Which part of a change of the baseline's own time is left in what is divided by it, as a standard
deviation: what slows a machine does not slow all stages alike."""

SLICE = 3e-3
"""Seconds that a thread keeps its core beside others: of what is over sooner, much less cancels."""

OF_A_PATH = 0.05
"""What is expected besides of a cell whose baseline was not traced in one way by all runs: which of
several ways that are about as fast is chosen is chance."""

OF_A_BASELINE = 0.10
"""The expected standard deviation between processes of a time that has no baseline."""

RUNS_EXPECTED = 20
"""By how many degrees of freedom an expectation counts beside what repeated runs show."""


LEAST_RESTLESS, FEW = 0.25, 4
"""The least share of the expected variance that many repeated runs can bring it down to, and how
many degrees of freedom they need for that."""


@dataclass(frozen=True, eq=False)
class Side:
    """What the runs of one side took in cells that all of them have.

    Attributes
    ----------
    level : (R, K) float64
        Middle, over the rounds of each of R runs in each of K cells, of the logarithm of the time
        over that of its baseline; of the time itself where it has none.
    variance : (R, K) float64
        Of that middle, from round to round.
    baseline : (R, K) float64
        Logarithm of the baseline's own seconds; NaN where there is none.
    scatter : (R, K) float64
        Standard deviation of that logarithm from round to round.
    seconds : (R, K) float64
        The median time.
    same_path : (K,) bool
        Whether all runs, of both sides, traced the baseline in the same way.
    """

    level: F64
    variance: F64
    baseline: F64
    scatter: F64
    seconds: F64
    same_path: NDArray[np.bool_]


@dataclass(frozen=True)
class Effect:
    """A change from one side to the other, as a ratio of times.

    Attributes
    ----------
    ratio, low, high : float
        After over before, with the interval of confidence 0.95.
    p : float
        Of a ratio as far from 1 if there is no change, before any correction for many of them.
    error, freedom : float
        Standard error of the logarithm of the ratio, and Student's degrees of freedom.
    excess : float
        The variance that repeated runs show, over what was expected; NaN without any.
    cells : int
    """

    ratio: float
    low: float
    high: float
    p: float
    error: float
    freedom: float
    excess: float
    cells: int

    def needed(self, level: float) -> float:
        """Return the change, as a share, from which on `p` is at most `level`."""
        return math.expm1(float(student.isf(level / 2, self.freedom)) * self.error)


def middle(seconds: ArrayLike, baseline: ArrayLike) -> tuple[float, float]:
    """Return the middle of the logarithms of paired ratios, and its variance.

    Parameters
    ----------
    seconds, baseline : (N,) array, positive
        Of the same rounds. `baseline` of ones leaves the times as they are.
    """
    logs = np.log(np.asarray(seconds, np.float64)) - np.log(np.asarray(baseline, np.float64))
    n = len(logs)
    # The variance of the median of normal samples.
    variance = math.pi / 2 * deviation(logs) ** 2 / n if n > 1 else UNKNOWN
    return float(np.median(logs)), variance


def deviation(samples: ArrayLike) -> float:
    """Return a standard deviation that outliers do not move; 0 for one sample."""
    x = np.asarray(samples, np.float64)
    # Of few samples the median deviation is too small.
    return float(median_abs_deviation(x, scale="normal")) * len(x) / (len(x) - 0.8)


UNKNOWN = 0.1**2
"""The variance of a middle of one round."""


def effect(before: Side, after: Side, restless: float = 1.0) -> Effect:
    """Return the change from one side to the other, over all cells.

    The test is Student's, on the means over the cells of each run, with a moderated variance.

    Parameters
    ----------
    before, after : Side
    restless : float
        By how much more than expected the runs of this comparison vary; see `restlessness`.
    """
    share = 1 / len(before.level) + 1 / len(after.level)
    of_run, left = OF_A_BASELINE, np.zeros(before.level.shape[1])
    own = OF_A_CELL**2 + _calls(before, after) + _mean(before.variance, after.variance)
    own = own + np.where(before.same_path & after.same_path, 0.0, OF_A_PATH**2)
    weights = own
    if paired := bool(np.isfinite(before.baseline).all()):
        of_run, left = OF_A_RUN, _left(before, after)
        weights = own + left**2
    weights = 1 / weights / (1 / weights).sum()
    changes = after.level.mean(axis=0) - before.level.mean(axis=0)
    change = float(weights @ changes)
    of_cells = float((weights**2 * own).sum())
    if len(weights) > 1:  # what the cells disagree in, if that is more
        scatter = float(weights @ (changes - change) ** 2) / (1 - float((weights**2).sum()))
        of_cells = max(of_cells, float((weights**2).sum()) * scatter / share)
        if len(weights) > 2:  # then what they have in common is not what is expected either
            beyond = scatter / share - float(weights @ own) + OF_A_CELL**2
            of_run *= math.sqrt(max(1.0, beyond / OF_A_CELL**2))
    expected = of_run**2 + of_cells
    freedom = len(before.level) + len(after.level) - 2
    shown = _squares(before.level @ weights) + _squares(after.level @ weights)
    drift = 0.0
    if paired:
        loads = [side.baseline @ (weights * left) for side in (before, after)]
        drift = float(loads[1].mean() - loads[0].mean())
        uneasy = np.sqrt(_mean(before.scatter**2, after.scatter**2))
        expected += float(weights @ (left * uneasy)) ** 2
        if freedom:
            expected += sum(map(_squares, loads)) / freedom
    excess = shown / freedom / expected if freedom else math.nan
    variance = (RUNS_EXPECTED * restless * expected + shown) / (RUNS_EXPECTED + freedom)
    error = math.sqrt(variance * share + drift**2)
    half = float(student.ppf(0.975, RUNS_EXPECTED + freedom)) * error
    ratio, low, high = (math.exp(x) for x in (change, change - half, change + half))
    p = 2 * float(student.sf(abs(change) / error, RUNS_EXPECTED + freedom))
    return Effect(ratio, low, high, p, error, RUNS_EXPECTED + freedom, excess, len(weights))


def restlessness(excesses: Sequence[float], runs: int) -> float:
    """Return by how much more than expected repeated runs vary, over all their times.

    With fewer than `FEW` degrees of freedom no less than is expected.

    Parameters
    ----------
    excesses : sequence of float
        Those of the effects.
    runs : int
        Of both sides together.
    """
    known = [excess for excess in excesses if math.isfinite(excess)]
    if not known:
        return 1.0
    freedom = runs - 2
    least = LEAST_RESTLESS if freedom >= FEW else 1.0
    return max(least, float(np.median(known)) / (float(chi2.median(freedom)) / freedom))


def disagreement(effects: Sequence[Effect]) -> float:
    """Return by how much more than expected cells of one time disagree; 1 at least.

    A process that finds another place in memory, or another neighbour, in one cell than in the next
    shows in this without any run being repeated. A cell that changed by itself hardly does.
    """
    if len(effects) < 3:
        return 1.0
    logs = np.log([effect.ratio for effect in effects])
    middle = float(np.median(logs))
    return max(1.0, deviation((logs - middle) / [effect.error for effect in effects]) ** 2)


def holm(p: Sequence[float]) -> list[float]:
    """Return p-values corrected for as many tests as there are (S. Holm, 1979)."""
    order = np.argsort(p)
    factors = len(p) - np.arange(len(p))
    corrected = np.minimum(1, np.maximum.accumulate(np.asarray(p, np.float64)[order] * factors))
    found = np.empty(len(p))
    found[order] = corrected
    return [float(value) for value in found]


def _calls(before: Side, after: Side) -> F64:
    """Return the variance of the cells that is the clock's and the scheduler's."""
    found = np.zeros(before.level.shape[1])
    for side in (before, after):
        found += ((OF_A_CALL / side.seconds) ** 2).mean(axis=0) / 2
        if np.isfinite(side.baseline).all():
            found += ((OF_A_CALL / np.exp(side.baseline)) ** 2).mean(axis=0) / 2
    return found


def _left(before: Side, after: Side) -> F64:
    """Return which part of a change of the baseline is left in each cell."""
    shorter = _mean(*(np.minimum(side.seconds, np.exp(side.baseline)) for side in (before, after)))
    return np.asarray(np.hypot(NOT_CANCELLED, SLICE / (SLICE + shorter)))


def _mean(before: F64, after: F64) -> F64:
    return np.asarray((before.mean(axis=0) + after.mean(axis=0)) / 2)


def _squares(values: F64) -> float:
    return float(((values - values.mean()) ** 2).sum())
