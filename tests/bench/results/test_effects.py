"""Which changes are reported: on samples made up with what runs of one program differ by."""

import dataclasses
import math

import numpy as np
import pytest

from hybrid_rt_bench.results import effects
from hybrid_rt_bench.results.effects import LEVEL, SMALLEST, Side, effect, holm, restlessness

CELLS, ROUNDS, TIMES = 8, 11, 10


def side(rng, runs, changes, noisy=1.0, busy=0.0):
    """Return the sides of `TIMES` times: runs, cells and rounds scatter, and the machine is busy.

    The logarithm of each time is shifted by `changes`. What all cells of a run share, what each
    has, and what a busy machine leaves in a normalised time are drawn anew for every run.
    """
    load = busy * np.abs(rng.normal(size=(runs, 1)))
    baseline = math.log(0.05) + load + rng.normal(0, 0.02, (runs, CELLS))
    restless, found = 0.03 * noisy + 0.2 * busy, []
    for change in changes:
        shared = rng.normal(0, 0.01 * noisy, (runs, 1)) + load * rng.normal(0, 0.08, (runs, 1))
        level = change + shared + rng.normal(0, 0.02 * noisy, (runs, CELLS))
        rounds = level[..., None] + rng.normal(0, restless, (runs, CELLS, ROUNDS))
        # Some rounds are disturbed, always for the longer.
        rounds += (rng.random(rounds.shape) < 0.1) * np.abs(rng.normal(0, 0.5, rounds.shape))
        middle = np.median(rounds, axis=-1)
        deviation = 1.4826 * np.median(np.abs(rounds - middle[..., None]), axis=-1)
        variance = math.pi / 2 * (deviation * ROUNDS / (ROUNDS - 0.8)) ** 2 / ROUNDS
        scatter = np.full((runs, CELLS), 0.03 * noisy + busy / 2)
        seconds = np.exp(baseline + level)
        same = np.ones(CELLS, np.bool_)
        found.append(Side(middle, variance, baseline, scatter, seconds, same))
    return found


def reported(rng, runs, changes, **more):
    """Return which of the times are reported as changed."""
    before, after = side(rng, runs, [0] * TIMES, **more), side(rng, runs, changes, **more)
    first = [effect(a, b) for a, b in zip(before, after, strict=True)]
    restless = restlessness([e.excess for e in first], 2 * runs)
    tested = [effect(a, b, restless) for a, b in zip(before, after, strict=True)]
    p = holm([e.p for e in tested])
    return [
        p <= LEVEL / 2 and max(e.ratio, 1 / e.ratio) >= 1 + SMALLEST
        for p, e in zip(p, tested, strict=True)
    ]


@pytest.mark.parametrize("runs", [1, 2, 4])
@pytest.mark.parametrize("more", [{}, {"noisy": 2.5}, {"busy": 0.5}, {"noisy": 2.0, "busy": 0.5}])
def test_equal_programs_are_hardly_ever_told_apart(runs, more):
    rng = np.random.default_rng(20261125)
    false = sum(any(reported(rng, runs, [0] * TIMES, **more)) for _ in range(50))
    assert false <= 1, f"{false} of 50"


@pytest.mark.parametrize(("runs", "least"), [(1, 0.5), (3, 0.95)])
def test_a_change_of_a_tenth_is_found_and_nothing_else(runs, least):
    rng = np.random.default_rng(7)
    found = [reported(rng, runs, [math.log(1.1)] + [0] * (TIMES - 1)) for _ in range(50)]
    assert np.mean([times[0] for times in found]) >= least
    assert sum(any(times[1:]) for times in found) <= 1


def test_many_times_are_corrected_for():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5]) == [0.5]
    assert holm([]) == []
    assert holm([0.9, 0.8]) == [1.0, 1.0]


def plain(levels, baseline=None):
    """Return a side of one cell without scatter in its runs."""
    level = np.array(levels, np.float64)[:, None]
    base = np.full(level.shape, math.log(0.05)) if baseline is None else np.array(baseline)[:, None]
    nothing = np.zeros(level.shape)
    return Side(level, nothing, base, nothing, np.full(level.shape, 0.05), np.ones(1, np.bool_))


def test_the_ratio_is_that_of_the_means_and_its_interval_holds_it():
    found = effect(plain([0.0, 0.02]), plain([0.1, 0.12]))
    assert found.ratio == pytest.approx(math.exp(0.1))
    assert found.low < found.ratio < found.high
    assert found.freedom == effects.RUNS_EXPECTED + 2
    assert found.needed(found.p) == pytest.approx(found.ratio - 1)


def test_more_runs_see_more():
    few, many = (effect(plain([0] * n), plain([0.1] * n)) for n in (1, 4))
    assert many.p < few.p / 10
    assert math.isnan(few.excess)
    assert many.excess == 0


def test_runs_that_lie_apart_are_believed_less():
    near = effect(plain([0.0, 0.01, 0.02]), plain([0.1, 0.11, 0.12]))
    far = effect(plain([-0.2, 0.0, 0.23]), plain([-0.1, 0.1, 0.33]))
    assert far.p > 10 * near.p
    assert far.excess > 10 > near.excess


def test_a_baseline_that_changed_is_not_believed_to_cancel():
    same = effect(plain([0.0]), plain([0.1]))
    moved = effect(plain([0.0]), plain([0.1], baseline=[math.log(0.1)]))
    assert moved.error > 2 * same.error


def test_another_path_of_the_baseline_is_a_doubt():
    other = plain([0.1])
    doubtful = dataclasses.replace(other, same_path=np.zeros(1, np.bool_))
    assert effect(plain([0.0]), doubtful).error > effect(plain([0.0]), other).error


def test_the_middle_of_rounds_is_not_moved_by_a_disturbed_one():
    level, variance = effects.middle([1.0, 1.01, 0.99, 1.0, 30.0], [0.5] * 5)
    assert level == pytest.approx(math.log(2))
    assert variance < 0.02**2
    assert effects.middle([3.0], [1.0]) == (pytest.approx(math.log(3)), effects.UNKNOWN)
