"""The time by which a mission is judged."""

import itertools

from hypothesis import given
from hypothesis import strategies as st
from metacontrol_experiments.mission.clock import DOUBT_S, STEP_S, SteadyClock


def believed(readings):
    clock = SteadyClock()
    return [clock.believe(told, wall) for told, wall in readings]


def test_one_wrong_time_is_not_believed():
    assert believed([(22.0, 0.0), (52.4, 0.05), (22.1, 0.1), (22.2, 0.15)]) == [22.0, 22.0, 22.1, 22.2]
    assert believed([(52.0, 0.0), (22.4, 0.05), (52.1, 0.1)]) == [52.0, 52.0, 52.1]


def test_two_wrong_times_long_after_each_other_are_not_believed_either():
    assert believed([(1.0, 0.0), (31.0, 0.1), (1.2, 0.2), (35.0, 9.0), (5.0, 9.1)]) == [1.0, 1.0, 1.2, 1.2, 5.0]


def test_a_jump_that_lasts_is_believed():
    late = 0.1 + DOUBT_S + 0.1
    assert believed([(22.0, 0.0), (2.0, 0.1), (2.5, 0.6), (3.0, late), (3.1, late + 0.1)]) == [
        22.0,
        22.0,
        22.0,
        3.0,
        3.1,
    ]


def test_a_jump_that_is_believed_is_told_once():
    clock = SteadyClock()
    for told, wall in ((22.0, 0.0), (34.0, 12.0)):
        clock.believe(told, wall)
    assert clock.take_jump() == 0.0
    clock.believe(35.1, 13.1)
    assert clock.take_jump() == 35.1 - 22.0
    assert clock.take_jump() == 0.0


@given(st.lists(st.integers(0, int(8 * STEP_S)), min_size=1))
def test_a_clock_that_goes_on_is_followed(eighths):
    told = [total / 8 for total in itertools.accumulate(eighths)]
    assert believed([(time, index * 0.05) for index, time in enumerate(told)]) == told
