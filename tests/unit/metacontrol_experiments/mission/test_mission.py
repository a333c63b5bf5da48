"""The state machine of a mission."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_experiments.contingency.contingency import Contingency, Kind, Moment
from metacontrol_experiments.mission import mission
from metacontrol_experiments.mission.mission import Action, Inject, MissionError, Outcome, Plan

KILL = Contingency(Kind.KILL, Moment(share=0.4), target="front_laser")
PLAN = Plan(goal_x=10.0, goal_y=0.0, contingencies=(KILL,))


@pytest.fixture
def driving():
    state = mission.start(PLAN, 100.0, 0.0, 0.0)
    return mission.on_goal_status(state, 100.2, GoalStatus.ACTIVE)[0]


def test_goal_that_is_listed_as_reached_is_reached_though_its_result_is_missed(driving):
    state, _ = mission.on_goal_status(driving, 120.0, GoalStatus.SUCCEEDED)
    assert (state.outcome, state.reason) == (Outcome.REACHED, "goal reached")
    assert mission.on_goal_status(state, 121.0, GoalStatus.SUCCEEDED) == (state, ())


def test_perturbation_strikes_once_when_its_share_is_done(driving):
    state, actions = mission.on_pose(PLAN, driving, 101.0, 3.9, 0.0)
    assert actions == () and state.share == pytest.approx(0.39)
    state, actions = mission.on_pose(PLAN, state, 102.0, 4.1, 0.0)
    assert actions == (Inject(0),)
    assert mission.on_pose(PLAN, state, 103.0, 4.2, 0.0)[1] == ()
    back, _ = mission.on_pose(PLAN, state, 104.0, 1.0, 0.0)
    assert mission.on_pose(PLAN, back, 105.0, 5.0, 0.0)[1] == ()


def test_contingencies_strike_at_their_time_and_place_and_not_again_at_the_start():
    clutter = Contingency(Kind.CLUTTER, count=7)
    late = Contingency(Kind.POWER, Moment(time=20.0), value=1.6)
    there = Contingency(Kind.LIGHT, Moment(place=(3.0, 2.0)), value=0.1)
    plan = Plan(10.0, 0.0, (clutter, late, there))
    state = mission.start(plan, 100.0, 0.0, 0.0)
    state, actions = mission.on_pose(plan, state, 100.1, 0.1, 0.0)
    assert actions == ()
    state, actions = mission.on_pose(plan, state, 105.0, 3.0, 1.2)
    assert actions == (Inject(2),)
    state, _ = mission.on_goal_status(state, 119.0, GoalStatus.ACTIVE)
    state, actions = mission.on_time(plan, state, 120.0)
    assert actions == (Inject(1),)
    assert mission.on_time(plan, state, 121.0)[1] == ()


def test_mission_without_perturbation_never_strikes(driving):
    assert mission.on_pose(Plan(10.0, 0.0), driving, 101.0, 9.0, 0.0)[1] == ()


def test_pose_that_is_not_finite_changes_nothing(driving):
    assert mission.on_pose(PLAN, driving, 101.0, math.nan, 0.0) == (driving, ())


def test_reached_goal_ends_the_mission(driving):
    state, _ = mission.on_goal_result(driving, 120.0, GoalStatus.SUCCEEDED, "")
    assert (state.outcome, state.ended_s) == (Outcome.REACHED, 120.0)


def test_abort_while_nothing_is_reconfigured_ends_the_mission(driving):
    state, _ = mission.on_goal_result(driving, 120.0, GoalStatus.ABORTED, "stuck")
    assert state.outcome is Outcome.ABORTED
    assert state.reason == "move_base: goal aborted: stuck"


def test_goal_preempted_by_a_reconfiguration_goes_on_when_it_is_taken_over(driving):
    state, _ = mission.on_configuration(driving, 110.0, False)
    state, _ = mission.on_goal_result(state, 110.2, GoalStatus.PREEMPTED, "")
    state, _ = mission.on_time(PLAN, state, 150.0)
    assert not state.over
    state, _ = mission.on_configuration(state, 151.0, True)
    state, _ = mission.on_goal_status(state, 151.1, GoalStatus.ACTIVE)
    state, _ = mission.on_time(PLAN, state, 160.0)
    assert not state.over


def test_goal_ended_by_a_reconfiguration_and_not_taken_up_again_fails(driving):
    state, _ = mission.on_configuration(driving, 110.0, False)
    state, _ = mission.on_goal_result(state, 110.2, GoalStatus.PREEMPTED, "")
    state, _ = mission.on_configuration(state, 111.0, True)
    state, _ = mission.on_time(PLAN, state, 111.0 + mission.SETTLE_S + 0.1)
    assert state.outcome is Outcome.ABORTED


def test_goal_missing_from_status_during_a_reconfiguration_is_no_end(driving):
    state, _ = mission.on_configuration(driving, 110.0, False)
    state, _ = mission.on_goal_status(state, 130.0, None)
    assert not mission.on_time(PLAN, state, 140.0)[0].over


def test_goal_that_the_server_forgot_is_given_up(driving):
    state, actions = mission.on_time(PLAN, driving, 100.2 + mission.LOST_S + 0.1)
    assert state.outcome is Outcome.ABORTED and actions == (Action.CANCEL_GOAL,)


def test_goal_is_not_given_up_because_the_time_jumps(driving):
    """As when somebody has stopped the mission's process for a while."""
    after = 100.2 + 5.0 * mission.LOST_S
    state = mission.on_jump(driving, after, after - 100.2)
    assert mission.on_time(PLAN, state, after) == (state, ())
    state, actions = mission.on_time(PLAN, state, after + mission.LOST_S + 0.1)
    assert (state.outcome, actions) == (Outcome.ABORTED, (Action.CANCEL_GOAL,))


def test_jump_moves_nothing_into_the_future(driving):
    state, _ = mission.on_configuration(driving, 130.0, False)
    state = mission.on_jump(state, 131.0, 30.0)
    assert max(state.seen_s, state.asked_s, state.stable_since_s) <= 131.0


def test_goal_that_nobody_acknowledged_is_sent_again():
    state = mission.start(PLAN, 100.0, 0.0, 0.0)
    state, actions = mission.on_time(PLAN, state, 105.1)
    assert actions == (Action.RESEND_GOAL,)
    assert mission.on_time(PLAN, state, 105.2)[1] == ()


def test_time_out_cancels_the_goal(driving):
    state, _ = mission.on_goal_status(driving, 349.0, GoalStatus.ACTIVE)
    assert not mission.on_time(PLAN, state, 350.0)[0].over
    state, actions = mission.on_time(PLAN, state, 350.1)
    assert state.outcome is Outcome.TIMEOUT and actions == (Action.CANCEL_GOAL,)


def test_nothing_changes_a_mission_that_is_over(driving):
    over = mission.abort(driving, 110.0, "simulator gone")
    assert mission.interrupt(over, 111.0, "again") == over
    assert mission.on_pose(PLAN, over, 111.0, 5.0, 0.0) == (over, ())
    assert mission.on_goal_result(over, 111.0, GoalStatus.SUCCEEDED, "") == (over, ())
    assert mission.on_time(PLAN, over, 999.0) == (over, ())


@pytest.mark.parametrize("x", [10.0, 9.7, math.inf])
def test_goal_that_is_no_mission_is_refused(x):
    with pytest.raises(MissionError):
        mission.start(PLAN, 0.0, x, 0.0)


def test_unknown_goal_state_is_lost():
    assert GoalStatus.of(77) is GoalStatus.LOST


@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), max_size=50))
def test_whatever_the_way_the_perturbation_strikes_at_most_once(way):
    state = mission.start(PLAN, 0.0, 0.0, 0.0)
    strikes = 0
    for x, y in way:
        state, actions = mission.on_pose(PLAN, state, 1.0, x, y)
        strikes += actions.count(Inject(0))
        assert state.share >= 0.0
    assert strikes == (1 if any(PLAN.distance(x, y) <= 6.0 for x, y in way) else 0)
