"""What levels say: robust against single bad ones, quick with lasting changes and trends."""

import math
import random
import statistics

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mros1_reasoner.knowledge.model import Direction
from mros1_reasoner.knowledge.scale import Scale
from mros1_reasoner.loop.estimate import MOST, estimate, rank_below_median
from mros1_reasoner.loop.levels import Expectation, Judging, Levels

KEY = ("o_sweep", "noise")


def seen(*levels, period=1.0):
    return estimate([(i * period, level) for i, level in enumerate(levels)])


def test_one_level_is_what_it_is():
    assert (seen(0.4).level, seen(0.4).slope, seen(0.4).scatter) == (0.4, 0.0, 0.0)


@pytest.mark.parametrize("place", range(5))
def test_single_bad_level_moves_nothing(place):
    levels = [3.0, 3.1, 2.9, 3.05, 2.95]
    levels[place] = 50.0
    found = seen(*levels)
    assert found.level == pytest.approx(3.0, abs=0.11)
    assert found.slope == 0.0
    assert found.scatter < 0.3


def test_trend_is_followed_and_noise_is_none():
    rising = seen(1.0, 1.1, 1.21, 1.3, 1.42, period=0.1)
    assert rising.slope == pytest.approx(1.0, abs=0.1)
    assert rising.level == pytest.approx(1.41, abs=0.02)
    assert rising.ahead(0.5) == pytest.approx(1.91, abs=0.1)
    assert seen(1.2, 1.0, 1.3, 1.1, 1.25).slope == 0.0


def test_levels_of_one_moment_have_no_trend():
    assert estimate([(1.0, 0.1), (1.0, 0.2), (1.0, 0.3), (1.0, 0.4), (1.0, 0.5)]).slope == 0.0


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=MOST),
    st.floats(-1e3, 1e3),
    st.floats(0.01, 100.0),
)
def test_estimate_follows_shift_and_scale(levels, shift, factor):
    before, after = seen(*levels), seen(*(factor * (level + shift) for level in levels))
    size = 1e-6 * factor * (1.0 + abs(shift) + max(map(abs, levels)))
    if before.slope == 0.0 and after.slope == 0.0:  # rounding may tie two levels
        assert after.level == pytest.approx(factor * (before.level + shift), abs=size)
        assert after.scatter == pytest.approx(factor * before.scatter, abs=size)


def alarms(draw, count=20_000):
    """Return the share of levels after which the limit 1.0 counts as violated, of levels drawn by `draw`."""
    levels, against = Levels(), Expectation(limit=1.0)
    found = 0
    for second in range(count):
        levels.observe(float(second), KEY, draw(), against)
        found += bool(levels.violations(float(second), {"o_sweep": 0.0}))
    return found / count


def test_false_alarm_rates_are_those_that_are_documented():
    """The figures stand in docs/decisions/0032."""
    rng = random.Random(4)
    rare = alarms(lambda: 0.5 + 0.05 * rng.gauss(0, 1) + (rng.random() < 0.05))
    assert rare < 0.006, "peaks in 5 % of the levels, far from a quiet bulk"
    z = statistics.NormalDist().inv_cdf(0.999)
    assert alarms(lambda: 1.0 - z * 0.1 + 0.1 * rng.gauss(0, 1)) < 0.06, "3.1 standard deviations from the limit"
    assert alarms(lambda: 0.5 + 0.1 * rng.gauss(0, 1)) < 0.004, "5 standard deviations from the limit"
    lasting = alarms(lambda: 1.1 + 0.05 * rng.gauss(0, 1))
    assert lasting > 0.99


def test_higher_is_better_is_judged_from_below():
    levels, against = Levels(), Expectation(Scale(Direction.HIGHER_IS_BETTER), limit=10.0)
    for tick, level in enumerate([12.0, 11.6, 11.1, 10.7, 10.2]):
        levels.observe(tick * 0.1, KEY, level, against)
    assert levels[KEY].high < 10.0, "it falls, and will be below the limit in a moment"
    assert levels.violations(0.4, {"o_sweep": 0.0}) == {KEY}
    assert levels.violations(0.4, {"o_sweep": 0.5}) == frozenset(), "no limit counts right after an adaptation"


def test_few_levels_count_only_after_the_window():
    levels, against = Levels(Judging(window=2.0, timeout=30.0)), Expectation(limit=1.0)
    levels.observe(10.0, KEY, 1.5, against)
    assert not levels.violations(11.9, {"o_sweep": 0.0})
    assert levels.violations(12.0, {"o_sweep": 0.0})
    assert min(levels.due({"o_sweep": 0.0})) <= 12.0


@pytest.mark.parametrize("sign", [1, -1])
def test_usual_level_tells_a_lasting_change_before_the_peaks_do(sign):
    against = Expectation(limit=1.0, expected=0.8, typical=0.5)
    if sign < 0:
        scale = Scale(Direction.HIGHER_IS_BETTER)
        against = Expectation(scale, limit=1.0, expected=1 / 0.8, typical=1 / 0.5)
    levels, now = Levels(), 0.0
    for ratio in [1.0] * 10 + [1.4] * 8:
        now += 1.0
        levels.observe(now, KEY, (0.5 * ratio) ** sign, against)
        assert not levels.violations(now, {"o_sweep": 0.0}), "a bad stretch leaves two of ten levels as they were"
    levels.observe(now + 1.0, KEY, (0.5 * 1.4) ** sign, against)
    assert levels[KEY].high == pytest.approx(1.12**sign), "1.4 times the usual level: 1.4 times the expected one"
    assert levels.violations(now + 1.0, {"o_sweep": 0.0})


@pytest.mark.parametrize(("count", "rank"), [(1, 0), (4, 0), (5, 0), (8, 1), (10, 1), (20, 5)])
def test_rank_lies_above_the_median_not_more_often_than_stated(count, rank):
    assert rank_below_median(count, 0.95) == rank
    if count >= 5:
        assert sum(math.comb(count, below) for below in range(rank + 1)) / 2**count <= 0.05


def test_usual_level_is_known_across_changes_of_the_design():
    fast = Expectation(limit=1.0, expected=0.8, typical=0.5)
    slow = Expectation(limit=1.0, expected=0.4, typical=0.2)
    levels = Levels()
    for second in range(6):
        levels.observe(float(second), KEY, 0.7, fast)
    levels.forget(KEY[0])
    levels.observe(6.0, KEY, 0.9, slow)  # still of the fast one
    for second in range(7, 11):
        levels.observe(float(second), KEY, 0.28, slow)
    assert levels[KEY].high == pytest.approx(1.4 * 0.4)
    levels.forget(quality=KEY[1])  # stale
    levels.observe(11.0, KEY, 0.2, slow)
    assert levels[KEY].high == pytest.approx(0.2), "nothing is known of the time without levels"
