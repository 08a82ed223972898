"""A share of rays with an interval for what it estimates."""

from __future__ import annotations

from dataclasses import dataclass

from scipy import stats

from hybrid_rt import _check


@dataclass(frozen=True)
class Rate:
    """A share, with an interval for what it estimates.

    Attributes
    ----------
    count, total : int
    low, high : float
        Exact 95 % interval (Clopper and Pearson 1934). For a count of zero `high` is the rule of
        three, ``3 / total``: what has never been seen in that many rays is, at 95 %, no more
        frequent. For no rays at all it is 0 to 1.
    """

    count: int
    total: int
    low: float
    high: float

    def __post_init__(self) -> None:
        _check.integer("total", self.total, least=0, most=2**63 - 1)
        _check.integer("count", self.count, least=0, most=int(self.total))
        _check.fraction("low", self.low)
        _check.fraction("high", self.high)

    @classmethod
    def of(cls, count: int, total: int) -> Rate:
        """Return the rate of `count` in `total`."""
        total = _check.integer("total", total, least=0, most=2**63 - 1)
        count = _check.integer("count", count, least=0, most=total)
        if total == 0:
            return cls(0, 0, 0.0, 1.0)
        if count == 0:
            return cls(0, total, 0.0, min(1.0, 3.0 / total))
        # scipy.stats.binomtest finds the same ends, but to 2e-12 only: a fifth of a per mille of
        # the lower one for a single error among 230 million.
        low = float(stats.beta.ppf(0.025, count, total - count + 1))
        high = float(stats.beta.ppf(0.975, count + 1, total - count)) if count < total else 1.0
        return cls(count, total, low, high)

    @property
    def value(self) -> float:
        """``count / total``; NaN for no rays."""
        return self.count / self.total if self.total else float("nan")
