import numpy as np
import pytest
import scipy.stats
from scipy.stats import binom

from hybrid_rt_bench.results import statistics as stats


def test_median_interval_is_made_of_the_order_statistics_that_cover():
    x = np.random.default_rng(1).permutation(np.arange(1.0, 21.0))
    found = stats.median(x)
    # Twenty samples: the 6th smallest and largest bracket the median with 1 - 2 P(B < 6) = 0.959.
    assert (found.value, found.low, found.high) == (10.5, 6.0, 15.0)
    assert found.coverage == pytest.approx(1 - 2 * binom.cdf(5, 20, 0.5))


def test_median_of_few_samples_says_that_its_interval_covers_less():
    found = stats.median([3.0, 1.0, 2.0])
    assert (found.low, found.value, found.high) == (1.0, 2.0, 3.0)
    assert found.coverage == pytest.approx(0.75)


def test_median_interval_holds_the_true_median_as_often_as_it_claims():
    rng = np.random.default_rng(2)
    found = [stats.median(rng.exponential(size=15)) for _ in range(2000)]
    share = np.mean([e.low <= np.log(2) <= e.high for e in found])
    assert share == pytest.approx(found[0].coverage, abs=0.02)


@pytest.mark.parametrize("bad", [[], [1.0, np.nan], [np.inf]])
def test_median_refuses_what_has_none(bad):
    with pytest.raises(ValueError, match="sample"):
        stats.median(bad)


def test_paired_ratio_cancels_what_slows_a_whole_round():
    slow = np.array([1.0, 5.0, 1.0, 2.0, 9.0])
    found = stats.paired_ratio(3 * slow, 2 * slow)
    assert (found.low, found.value, found.high) == (1.5, 1.5, 1.5)


def test_paired_ratio_refuses_rounds_without_partner():
    with pytest.raises(ValueError, match="one length"):
        stats.paired_ratio([1.0, 2.0], [1.0])


def test_geometric_mean_of_a_ratio_and_its_inverse_is_one():
    assert stats.geometric_mean([4.0, 0.25]) == pytest.approx(1.0)
    with pytest.raises(ValueError, match="positive"):
        stats.geometric_mean([1.0, 0.0])


def test_geometric_mean_of_medians_has_no_width_without_scatter():
    found = stats.geometric_mean_of_medians([[2.0, 2.0, 2.0], [8.0, 8.0]])
    assert (found.low, found.value, found.high) == pytest.approx((4.0, 4.0, 4.0))


def test_bootstrap_is_the_same_every_time():
    groups = [np.random.default_rng(k).uniform(1, 2, 7) for k in range(3)]
    first, again = (stats.geometric_mean_of_medians(groups) for _ in range(2))
    assert first == again
    assert first.low < first.value < first.high


def test_ratio_of_medians_tells_a_real_difference_from_scatter():
    rng = np.random.default_rng(3)
    a, b = rng.normal(10, 0.1, 15), rng.normal(12, 0.1, 15)
    different, alike = stats.ratio_of_medians(b, a), stats.ratio_of_medians(a, a[::-1])
    assert different.low > 1.1
    assert alike.low <= 1 <= alike.high


def test_unstable_means_that_the_quartiles_lie_far_apart():
    assert stats.unstable([1.0, 1.3, 0.8, 1.2])
    assert not stats.unstable([1.0, 1.01, 0.99, 1.0])
    assert not stats.unstable([1.0, 9.0])  # two samples have no quartiles worth the name


@pytest.mark.parametrize("n", [6, 7, 15, 40])
@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_the_interval_of_a_median_is_that_of_scipy(n, confidence):
    x = np.random.default_rng(n).lognormal(size=n)
    found = stats.median(x, confidence)
    test = scipy.stats.quantile_test(x, q=float(np.median(x)), p=0.5)
    interval = test.confidence_interval(confidence)
    assert (found.low, found.high) == (interval.low, interval.high)
    assert found.coverage >= confidence


def test_the_bootstrap_is_that_of_scipy():
    rng = np.random.default_rng(1)
    groups = [rng.lognormal(size=n) for n in (5, 7, 9)]

    def mean_of_medians(*samples, axis):
        medians = np.stack([np.median(np.sort(x, axis=axis), axis=axis) for x in samples])
        return scipy.stats.gmean(medians, axis=0)

    theirs = scipy.stats.bootstrap(
        [np.sort(x) for x in groups], mean_of_medians, n_resamples=2000, vectorized=True,
        paired=False, method="percentile", rng=np.random.default_rng(20250217),
    ).confidence_interval  # fmt: skip
    ours = stats.geometric_mean_of_medians(groups)
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), rel=1e-12)
    assert ours.value == pytest.approx(mean_of_medians(*groups, axis=-1), rel=1e-12)


def test_a_group_of_one_round_has_no_spread():
    found = stats.geometric_mean_of_medians([[2.0], [8.0]])
    assert (found.value, found.low, found.high) == pytest.approx((4.0, 4.0, 4.0))
