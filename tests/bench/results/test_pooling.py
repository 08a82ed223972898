"""Pooling, against figures worked out by hand."""

import numpy as np
import pandas as pd
import pytest

from hybrid_rt_bench.judged.columns import CELL, POINT, WRONG
from hybrid_rt_bench.judged.pooling import pareto, pools

KEYS = [*CELL, *POINT]


def row(camera, technique, **values):
    keys = dict.fromkeys(CELL, 0) | {"scene": "s", "camera": camera, "workload": "mirror"}
    return {**keys, "technique": technique, "point": "default", **values}


def frame():
    """Two cells: 100 and 300 rays, of which 50 and 100 are answered, 2 and 1 of them wrong."""
    counts = {"wrong_primitive": 0, "tie": 5, "reference_wrong": 0}
    return pd.DataFrame(
        [
            row(
                "a", "x", rays=100, resolved=50, false_hit=2, false_miss=0, all_false_hit=4,
                all_false_miss=0, steps=1000, march_ms=1.0, hybrid_ms=4.0, error_t_p50=1e-6,
                **counts,
            ),
            row(
                "b", "x", rays=300, resolved=100, false_hit=0, false_miss=1, all_false_hit=0,
                all_false_miss=1, steps=2000, march_ms=np.nan, hybrid_ms=np.nan, error_t_p50=3e-6,
                **counts,
            ),
            row(
                "b", "y", rays=300, resolved=300, false_hit=0, false_miss=0, all_false_hit=0,
                all_false_miss=0, steps=np.nan, march_ms=np.nan, hybrid_ms=3.0, error_t_p50=np.nan,
                **counts,
            ),
        ]
    )  # fmt: skip


def samples():
    def timed(camera, technique, embree, hybrid):
        rows = zip(embree, hybrid, strict=True)
        return [
            {**row(camera, technique), "embree": e, "hybrid": h, "march": 0.75 * h} for e, h in rows
        ]

    return pd.DataFrame(
        timed("a", "x", (2.0, 4.0, 6.0), (1.0, 1.0, 1.0))  # median ratio 4
        + timed("b", "x", (1.0, 2.0, 9.0), (1.0, 2.0, 9.0))  # median ratio 1
        + timed("b", "y", (3.0,), (1.0,))
    )


def test_counts_are_added_and_rates_are_of_the_sums():
    x = pools(frame(), ["technique"])[("x",)]
    assert (x.rays, x.resolved, x.alpha) == (400, 150, 150 / 400)
    assert x.rate(WRONG).value == pytest.approx(3 / 150)
    assert x.rate(WRONG, of_all=True).value == pytest.approx(5 / 400)
    assert (x.rate("tie").count, x.rate("tie").total) == (10, 150)
    assert x.steps_per_ray == pytest.approx(3000 / 400)


def test_a_count_of_zero_keeps_its_upper_bound():
    y = pools(frame(), ["technique"])[("y",)]
    rate = y.rate(WRONG)
    assert (rate.count, rate.value, rate.low) == (0, 0.0, 0.0)
    assert rate.high == pytest.approx(3 / 300)


def test_untimed_rows_do_not_slow_the_rates_down():
    x = pools(frame(), ["technique"])[("x",)]
    assert x.per_second("march_ms") == pytest.approx(100 / 1e-3 / 1e6)
    assert x.per_second("hybrid_ms") == pytest.approx(100 / 4e-3 / 1e6)


def test_what_no_row_has_is_nan():
    y = pools(frame(), ["technique"])[("y",)]
    assert np.isnan([y.steps_per_ray, y.per_second("march_ms"), y.median("error_t_p50")]).all()
    assert y.per_second("hybrid_ms") == pytest.approx(300 / 3e-3 / 1e6)


def test_speedup_is_the_geometric_mean_of_the_cells_paired_medians():
    pooled = pools(frame(), ["technique"])
    x, y = (pooled[(name,)].speedup(samples()) for name in "xy")
    assert x.value == pytest.approx(np.sqrt(4 * 1))
    assert x.low <= x.value <= x.high
    assert y.value == pytest.approx(3)
    assert pooled[("x",)].speedup(pd.DataFrame()) is None


def test_ratios_are_of_any_two_stages():
    x = pools(frame(), ["technique"])[("x",)]
    ratio = x.ratio(samples(), "march", "hybrid")
    assert (ratio.low, ratio.value, ratio.high) == pytest.approx((0.75, 0.75, 0.75))
    assert x.ratio(samples(), "hybrid", "embree").value == pytest.approx(1 / np.sqrt(4 * 1))


def test_the_break_even_march_time_is_what_the_other_stages_leave_of_embrees():
    pooled = pools(frame(), ["technique"])
    # Camera a: median of 2, 4, 6 less a quarter of 1; camera b: of 1, 2, 9 less a quarter of each.
    spare = (4 - 0.25) + (2 - 0.5)
    assert pooled[("x",)].break_even_ns(samples()) == pytest.approx(1e9 * spare / 400)
    only_a = samples()[lambda s: s["camera"] == "a"]  # what is not timed has no part in it
    assert pooled[("x",)].break_even_ns(only_a) == pytest.approx(1e9 * 3.75 / 100)
    assert np.isnan(pooled[("x",)].break_even_ns(pd.DataFrame()))
    slow = samples().assign(hybrid=100.0, march=1.0)
    assert pooled[("x",)].break_even_ns(slow) < 0


def test_nanoseconds_a_ray_are_of_the_timed_rows():
    x = pools(frame(), ["technique"])[("x",)]
    assert x.nanoseconds("march_ms") == pytest.approx(1e6 / 100)
    assert np.isnan(pools(frame(), ["technique"])[("y",)].nanoseconds("march_ms"))


def test_pools_keep_the_order_of_first_appearance():
    assert list(pools(frame().iloc[::-1], ["technique", "camera"])) == [
        ("y", "b"), ("x", "b"), ("x", "a"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("error", "worth", "front"),
    [
        ((0.0, 0.1, 0.2), (1.0, 2.0, 1.5), [0, 1]),
        ((0.2, 0.0, 0.1), (3.0, 1.0, 1.0), [1, 0]),
        ((0.0, 0.0), (1.0, 2.0), [1]),
        ((0.1, 0.1), (2.0, 2.0), [0]),
        ((), (), []),
    ],
)
def test_front_holds_what_no_other_point_beats(error, worth, front):
    assert pareto(error, worth) == front
