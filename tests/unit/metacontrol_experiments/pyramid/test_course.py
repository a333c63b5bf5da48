"""The course of a mission of D1: what strikes when, and how it ends."""

from dataclasses import replace

import pytest
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_experiments.mission.mission import Action, Outcome
from metacontrol_experiments.pyramid import course
from metacontrol_experiments.pyramid.course import BLOCKS, TIMEOUT_S, WATCH_S, Inject, TakeAway
from metacontrol_experiments.pyramid.scenarios import Light, Obstacle, Scenario, Strike

WALL = Obstacle("left", -0.25, 0.16)
LEFT, NONE = frozenset(("left",)), frozenset()


@pytest.fixture
def state():
    """A mission at 10 s, whose goal is known."""
    return course.on_known(course.start(10.0))


def scenario(*strikes):
    return Scenario(0, strikes=strikes)


def deeds(asked, state, now):
    return course.on_time(asked, state, now)[1]


def test_strike_waits_for_its_blocks_and_for_the_time_after_the_one_before(state):
    asked = scenario(Strike(Light(0.0), placed=2), Strike(Light(1.0), placed=3, after=5.0))
    assert deeds(asked, state, 20.0) == ()
    state = course.on_placed(state, 2)
    assert deeds(asked, state, 20.0) == (Inject(asked.strikes[0]),)
    state = course.on_placed(course.struck(state, 20.0), 3)
    assert deeds(asked, state, 24.9) == ()
    assert deeds(asked, state, 25.1) == (Inject(asked.strikes[1]),)


def test_obstacle_strikes_when_its_arm_carries_a_block(state):
    asked = scenario(Strike(WALL))
    for carrying, struck in ((NONE, ()), (frozenset(("right",)), ()), (LEFT, (Inject(asked.strikes[0]),))):
        assert deeds(asked, course.on_carrying(state, carrying), 11.0) == struck


def test_obstacle_is_taken_away_after_the_arm_has_stopped_and_nothing_strikes_meanwhile(state):
    asked = scenario(Strike(WALL), Strike(Light(0.0)))
    state = course.stands(course.struck(course.on_carrying(state, LEFT), 11.0), WALL)
    assert deeds(asked, state, 12.0) == ()
    state = course.on_stops(state, 12.5, "left", is_stopped=True)
    assert deeds(asked, state, 14.0) == ()
    state, done = course.on_time(asked, state, 14.6)
    assert done == (TakeAway(),)
    assert deeds(asked, state, 14.7) == (Inject(asked.strikes[1]),)


def test_obstacle_that_nothing_meets_is_put_in_the_next_way(state):
    asked = scenario(Strike(WALL))
    state = course.stands(course.struck(course.on_carrying(state, LEFT), 11.0), WALL)
    state, done = course.on_time(asked, state, 21.5)
    assert done == (TakeAway(),)
    assert deeds(asked, state, 21.6) == (Inject(asked.strikes[0]),)


def test_arm_that_is_stopped_from_the_start_and_is_told_so_again_stopped_once(state):
    state = course.on_stops(state, 11.0, "left", is_stopped=True)
    state = course.on_stops(state, 12.0, "left", is_stopped=True)
    assert state.stopped == {"left": 11.0}
    assert course.on_stops(state, 13.0, "left", is_stopped=False).stopped == {}
    assert course.on_stops(state, 13.0, "tail", is_stopped=True) == state


@pytest.mark.parametrize(("placed", "outcome"), [(BLOCKS, Outcome.REACHED), (BLOCKS - 1, Outcome.ABORTED)])
def test_what_a_program_has_built_is_watched_before_it_counts(state, placed, outcome):
    state = course.on_result(course.on_placed(state, BLOCKS), 50.0, GoalStatus.SUCCEEDED, "")
    state, done = course.on_time(scenario(), state, 50.0 + WATCH_S - 0.1)
    assert (state.outcome, done) == (None, ())
    state, _ = course.on_time(scenario(), course.on_placed(state, placed), 50.0 + WATCH_S)
    assert state.outcome is outcome
    assert outcome is Outcome.REACHED or "5 of 6" in state.reason


def test_reason_of_a_program_that_gives_up_is_the_mission_s(state):
    state = course.on_result(state, 50.0, GoalStatus.ABORTED, "no arm works")
    state, _ = course.on_time(scenario(), state, 56.0)
    assert (state.outcome, state.reason) == (Outcome.ABORTED, "build: goal aborted: no arm works")
    assert course.on_time(scenario(), state, 90.0) == (state, ())


def test_time_is_up(state):
    state, done = course.on_time(scenario(), course.on_placed(state, 3), 10.1 + TIMEOUT_S)
    assert (state.outcome, done) == (Outcome.TIMEOUT, (Action.CANCEL_GOAL,))
    assert "3 of 6" in state.reason


def test_goal_that_nobody_lists_is_sent_again():
    state = course.start(10.0)
    state, done = course.on_time(scenario(), state, 15.1)
    assert done == (Action.RESEND_GOAL,)
    assert course.on_time(scenario(), state, 16.0)[1] == ()


def test_mission_that_is_over_stays_as_it_ended(state):
    ended = course.interrupt(state, 20.0, "interrupted")
    assert ended.outcome is Outcome.INTERRUPTED
    assert course.abort(ended, 21.0, "something else") == ended
    assert course.on_result(ended, 22.0, GoalStatus.SUCCEEDED, "") == ended
    assert replace(ended, outcome=None).is_over is False
