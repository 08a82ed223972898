"""How time grows: exponents of power laws fitted to times over sizes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import linregress
from scipy.stats import t as student

from hybrid_rt_bench.results import statistics as stats


@dataclass(frozen=True)
class Exponent:
    """The power that a time grows with.

    Attributes
    ----------
    value, low, high : float
        NaN for `value` with fewer than two sizes, infinite `low` and `high` with fewer than three.
    points : int
        Number of sizes.
    """

    value: float
    low: float
    high: float
    points: int


def fit(sizes: ArrayLike, times: ArrayLike, confidence: float = stats.CONFIDENCE) -> Exponent:
    """Return the slope of log time over log size, by ordinary least squares.

    The interval is Student's, from the scatter of the points about the line, with two degrees of
    freedom less than there are points. That scatter holds what the rounds scatter *and* by how much
    the curve is no power law; a bootstrap over rounds would only hold the former, and be far too
    narrow for a curve that bends.

    Parameters
    ----------
    sizes, times : (K,) array, positive
        One time for each size, such as the median of its rounds.

    Raises
    ------
    ValueError
        Arrays of different lengths, or values that are not positive and finite.
    """
    n, t = np.asarray(sizes, np.float64), np.asarray(times, np.float64)
    if n.ndim != 1 or n.shape != t.shape:
        raise ValueError(f"two arrays of one length expected, got {n.shape} and {t.shape}")
    for name, values in (("sizes", n), ("times", t)):
        if not (np.isfinite(values) & (values > 0)).all():
            raise ValueError(f"{name}: positive and finite values expected, got {values}")
    x, y = np.log(n), np.log(t)
    if len(np.unique(x)) < 2:
        return Exponent(math.nan, -math.inf, math.inf, len(x))
    line = linregress(x, y)
    slope = float(line.slope)
    if len(x) < 3:
        return Exponent(slope, -math.inf, math.inf, len(x))
    error = float(np.nan_to_num(line.stderr))  # NaN where all times are the same
    half = float(student.ppf((1 + confidence) / 2, len(x) - 2)) * error
    return Exponent(slope, slope - half, slope + half, len(x))


def upper_half(sizes: ArrayLike) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return which sizes are in the upper half of their range, in logarithms, three at least.

    Where a fixed cost leads among the small sizes, growth only shows here.
    """
    x = np.log(np.asarray(sizes, np.float64))
    middle = (x.min() + x.max()) / 2 - 1e-9
    third = np.sort(x)[-min(3, len(x))]
    return np.asarray(x >= min(middle, third))
