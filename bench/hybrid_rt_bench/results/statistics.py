"""Statistics of repeated timings: medians, intervals, paired ratios, and a warning when unstable.

Timings are neither normal nor free of outliers, so every figure is a median and every interval is
made of order statistics or of a bootstrap; nothing assumes a distribution.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binom, gmean

F64 = NDArray[np.float64]

CONFIDENCE = 0.95
UNSTABLE = 0.10
"""A timing whose quartiles lie further apart than this share of its median is called unstable."""


@dataclass(frozen=True)
class Estimate:
    """A value and the interval that holds it.

    Attributes
    ----------
    value, low, high : float
    coverage : float
        Confidence that the interval really has; below what was asked for when there are too few
        samples (three rounds bound a median with 0.75 at best).
    count : int
        Number of samples.
    """

    value: float
    low: float
    high: float
    coverage: float
    count: int


def median(samples: ArrayLike, confidence: float = CONFIDENCE) -> Estimate:
    """Return the median with its order-statistic interval.

    The k-th smallest and the k-th largest of n samples bracket the median with probability
    1 - 2 P(Binomial(n, 1/2) < k), whatever the distribution. The largest k that keeps `confidence`
    is taken, and k = 1 (the extremes) where none does.

    Raises
    ------
    ValueError
        No samples, or samples that are not finite.
    """
    x = _finite(samples)
    n = len(x)
    # As `scipy.stats.quantile_test`, which does not tell the coverage and has no interval at all
    # where the extremes do not reach `confidence`.
    k = max(1, int(binom.ppf((1 - confidence) / 2, n, 0.5)))
    return Estimate(float(np.median(x)), float(x[k - 1]), float(x[n - k]), _coverage(n, k), n)


def paired_ratio(numerator: ArrayLike, denominator: ArrayLike) -> Estimate:
    """Return the median, over rounds, of the ratio inside a round.

    Both stages of a round ran within the same second, so that a slow spell of the machine slows
    both and cancels.
    """
    a, b = np.asarray(numerator, np.float64), np.asarray(denominator, np.float64)
    if a.shape != b.shape:
        raise ValueError(f"paired samples of one length expected, got {a.shape} and {b.shape}")
    return median(a / b)


def geometric_mean(values: ArrayLike) -> float:
    """Return the geometric mean of positive values: the mean that ratios have."""
    x = _finite(values)
    if x[0] <= 0:
        raise ValueError(f"positive values expected, got {x[0]:g}")
    return float(gmean(x))


def geometric_mean_of_medians(
    groups: Sequence[ArrayLike], confidence: float = CONFIDENCE, resamples: int = 2000
) -> Estimate:
    """Return the geometric mean of the groups' medians with a bootstrap interval.

    Every group is resampled by itself: the interval speaks of these cells measured again, not of
    other cameras. The seed is fixed, so that a report rendered twice is the same report.
    """
    rows = [_finite(group) for group in groups]
    value = geometric_mean([float(np.median(x)) for x in rows])
    # `scipy.stats.bootstrap` gives the same numbers, but none for a group of one round.
    rng = np.random.default_rng(20250217)
    logs = sum(np.log(bootstrap_medians(x, rng, resamples)) for x in rows)
    tail = (1 - confidence) / 2
    low, high = np.exp(np.quantile(logs / len(rows), [tail, 1 - tail]))
    return Estimate(value, float(low), float(high), confidence, min(len(x) for x in rows))


def geometric_mean_of_estimates(estimates: Sequence[Estimate]) -> Estimate:
    """Return the geometric mean of ratios with independent errors.

    In logarithms the widths of the intervals then add as squares.
    """
    logs = np.log(np.array([(e.value, e.low, e.high) for e in estimates]))
    centre = logs[:, 0].mean()
    below = np.sqrt(((logs[:, 0] - logs[:, 1]) ** 2).sum()) / len(logs)
    above = np.sqrt(((logs[:, 2] - logs[:, 0]) ** 2).sum()) / len(logs)
    low, value, high = np.exp([centre - below, centre, centre + above])
    return Estimate(float(value), float(low), float(high), CONFIDENCE, len(estimates))


def ratio_of_medians(
    numerator: ArrayLike,
    denominator: ArrayLike,
    confidence: float = CONFIDENCE,
    resamples: int = 2000,
) -> Estimate:
    """Return the ratio of the medians of two unpaired samples, with a bootstrap interval."""
    a, b = _finite(numerator), _finite(denominator)
    rng = np.random.default_rng(20250217)
    ratios = bootstrap_medians(a, rng, resamples) / bootstrap_medians(b, rng, resamples)
    tail = (1 - confidence) / 2
    low, high = np.quantile(ratios, [tail, 1 - tail])
    value = float(np.median(a) / np.median(b))
    return Estimate(value, float(low), float(high), confidence, min(len(a), len(b)))


def bootstrap_medians(samples: ArrayLike, rng: np.random.Generator, resamples: int) -> F64:
    """Return the medians of `resamples` draws with replacement."""
    x = np.asarray(samples, np.float64)
    picks = rng.integers(0, len(x), (resamples, len(x)))
    return np.asarray(np.median(x[picks], axis=1))


def spread(samples: ArrayLike) -> float:
    """Return the distance of the quartiles as a share of the median."""
    x = _finite(samples)
    low, mid, high = np.quantile(x, [0.25, 0.5, 0.75])
    return float((high - low) / mid) if mid > 0 else 0.0


def unstable(samples: ArrayLike) -> bool:
    """Tell whether samples scatter too much to be trusted; fewer than three never do."""
    return len(np.ravel(np.asarray(samples))) >= 3 and spread(samples) > UNSTABLE


def _finite(samples: Any) -> F64:
    x = np.sort(np.asarray(samples, np.float64).ravel())
    if len(x) == 0:
        raise ValueError("at least one sample expected, got none")
    if not np.isfinite(x).all():
        raise ValueError("finite samples expected, got NaN or infinity")
    return x


def _coverage(n: int, k: int) -> float:
    return max(0.0, 1.0 - 2.0 * float(binom.cdf(k - 1, n, 0.5))) if n > 1 else math.nan
