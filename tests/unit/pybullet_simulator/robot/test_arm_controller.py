"""The controller of an arm follows trajectories within tolerances, and stops at resistance."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pybullet_simulator.robot.arm_controller import (
    GOAL_TOLERANCE,
    PATH_TOLERANCE,
    START_TOLERANCE,
    ArmController,
    Outcome,
    Trajectory,
    TrajectoryError,
)

HERE = (0.0,) * 7
THERE = (0.5,) * 7
LIMIT = 40.0


def motion(seconds=1.0):
    return Trajectory((0.0, seconds), (HERE, THERE), (HERE, HERE))


def drive(controller, until, follow, force=lambda now: 0.0, start=0.0):
    """Run the controller at 50 Hz with an arm that is where `follow` says; return (time, outcome) of the first one."""
    now = start
    positions = HERE
    while now <= until:
        outcome = controller.update(now, positions, force(now))
        if outcome:
            return now, outcome
        positions = follow(controller.target, positions)
        now += 0.02
    return None


def obedient(target, _positions):
    return target


def test_trajectory_is_followed_to_its_end():
    controller = ArmController(LIMIT)
    controller.follow(motion(), 0.0, HERE)
    time, outcome = drive(controller, 5.0, obedient)
    assert outcome is Outcome.DONE
    assert time == pytest.approx(1.0, abs=0.05)
    assert not controller.is_moving
    assert controller.target == pytest.approx(THERE)


@given(st.lists(st.floats(0.01, 3.0), min_size=1, max_size=6), st.floats(0.0, 1.0))
def test_splines_pass_through_all_points_and_keep_rest_at_the_ends(spans, share):
    times = tuple(sum(spans[:i]) for i in range(len(spans) + 1))
    positions = tuple((float(i),) * 7 for i in range(len(times)))
    trajectory = Trajectory(times, positions, (HERE,) * len(times))
    for time, point in zip(times, positions, strict=True):
        assert trajectory.at(time) == pytest.approx(point, abs=1e-6)
    between = trajectory.at(times[0] + share * (times[1] - times[0]))
    assert all(-1e-9 <= value <= 1.0 + 1e-9 for value in between)  # at rest at both points: no overshoot
    assert trajectory.at(-1.0) == positions[0]
    assert trajectory.at(times[-1] + 1.0) == positions[-1]


def test_resistance_stops_the_arm_until_it_is_released():
    controller = ArmController(LIMIT)
    controller.follow(motion(), 0.0, HERE)
    _, outcome = drive(controller, 5.0, obedient, lambda now: 60.0 if now > 0.4 else 5.0)
    assert outcome is Outcome.STOPPED
    assert controller.is_stopped
    stopped_at = controller.target
    assert 0.0 < stopped_at[0] < 0.5
    with pytest.raises(TrajectoryError, match="stopped: it met 60 N"):
        controller.follow(motion(), 1.0, stopped_at)
    assert "still meets 50 N" in controller.release(50.0)
    assert controller.release(0.0) == ""
    controller.follow(Trajectory((0.0, 1.0), (stopped_at, HERE), (HERE, HERE)), 2.0, stopped_at)
    assert controller.is_moving


def test_single_reading_is_no_contact():
    controller = ArmController(LIMIT)
    controller.follow(motion(), 0.0, HERE)
    assert drive(controller, 5.0, obedient, lambda now: 200.0 if 0.41 < now < 0.43 else 0.0)[1] is Outcome.DONE


def test_arm_that_is_pushed_while_it_rests_stops():
    controller = ArmController(LIMIT)
    assert drive(controller, 0.2, obedient, lambda _: 60.0) is None
    assert controller.is_stopped


def test_arm_that_falls_behind_ends_its_trajectory_where_it_is():
    controller = ArmController(LIMIT)
    controller.follow(motion(), 0.0, HERE)
    stuck = (0.1,) * 7
    assert drive(controller, 5.0, lambda *_: stuck)[1] is Outcome.BEHIND
    assert controller.target == stuck
    assert PATH_TOLERANCE < 0.5


def test_goal_that_is_not_reached_in_time_is_told():
    controller = ArmController(LIMIT)
    controller.follow(motion(), 0.0, HERE, goal_time=0.5)
    short = 2.0 * GOAL_TOLERANCE
    time, outcome = drive(controller, 5.0, lambda target, _: tuple(value - short for value in target))
    assert outcome is Outcome.NOT_REACHED
    assert time == pytest.approx(1.5, abs=0.05)


def test_trajectory_that_begins_elsewhere_is_refused():
    controller = ArmController(LIMIT)
    with pytest.raises(TrajectoryError, match="begins more than"):
        controller.follow(motion(), 0.0, (2.0 * START_TOLERANCE,) * 7)


def test_new_trajectory_goes_on_from_the_target_of_an_arm_that_lags():
    controller = ArmController(LIMIT)
    controller.follow(motion(), 0.0, HERE)
    controller.update(0.5, (0.2,) * 7, 0.0)
    target = controller.target
    controller.follow(Trajectory((0.0, 1.0), (target, HERE), (HERE, HERE)), 0.5, (0.15,) * 7)
    assert controller.is_moving


def test_cancelled_arm_stays_where_it_is():
    controller = ArmController(LIMIT)
    controller.follow(motion(), 0.0, HERE)
    controller.update(0.5, (0.24,) * 7, 0.0)
    controller.cancel((0.24,) * 7)
    assert controller.update(0.6, (0.24,) * 7, 0.0) is None
    assert controller.target == (0.24,) * 7


@pytest.mark.parametrize(
    ("times", "positions", "velocities"),
    [
        ((), (), ()),
        ((0.0, 0.0), (HERE, THERE), (HERE, HERE)),
        ((-0.1,), (HERE,), (HERE,)),
        ((0.0,), ((0.0,) * 6,), (HERE,)),
        ((0.0,), (HERE,), ((float("nan"),) * 7,)),
        ((float("inf"),), (HERE,), (HERE,)),
        ((0.0, 1.0), (HERE,), (HERE,)),
    ],
)
def test_bad_trajectory_is_refused(times, positions, velocities):
    with pytest.raises(TrajectoryError):
        Trajectory(times, positions, velocities)


# -- back along the way -----------------------------------------------------------------------------------------------

DOWN = (0.5, 0.4, *HERE[2:])
ABOVE = (0.5, *HERE[1:])
OVER_THERE = (-0.5, -0.4, *HERE[2:])


def go(controller, start, end, now, force=lambda now: 0.0):
    """Move an obedient arm from one place to another; return (time, outcome, place)."""
    controller.follow(Trajectory((0.0, 1.0), (start, end), (HERE, HERE)), now, start)
    return follow_on(controller, start, now, force)


def follow_on(controller, place, now, force=lambda now: 0.0):
    for _ in range(500):
        outcome = controller.update(now, place, force(now))
        if outcome:
            return now, outcome, place
        now, place = now + 0.02, controller.target
    raise AssertionError("the motion does not end")


def stopped_on_the_way():
    """An arm that went down to take something, came up again, and met resistance half way to the next place."""
    controller = ArmController(LIMIT)
    now = 0.0
    for start, end in ((HERE, ABOVE), (ABOVE, DOWN), (DOWN, ABOVE)):
        now, outcome, _ = go(controller, start, end, now)
        assert outcome is Outcome.DONE
    met = now + 0.5
    now, outcome, place = go(controller, ABOVE, OVER_THERE, now, lambda time: 100.0 if time > met else 0.0)
    assert outcome is Outcome.STOPPED
    return controller, now, place


def test_a_stopped_arm_goes_back_part_by_part_without_the_detour():
    controller, now, place = stopped_on_the_way()
    lowest = []
    for goal in (ABOVE, HERE):
        while max(abs(a - b) for a, b in zip(place, goal, strict=True)) > 0.06:
            assert controller.go_back(now, place) == ""
            assert controller.is_stopped
            now, outcome, place = follow_on(controller, place, now)
            lowest.append(place[1])
            assert outcome is Outcome.DONE
    assert max(lowest) < 0.1  # it has not gone down again
    assert controller.is_stopped
    with pytest.raises(TrajectoryError, match="stopped"):
        controller.follow(Trajectory((0.0,), (place,), (HERE,)), now, place)


def test_the_way_back_is_left_where_it_is_blocked_and_can_be_tried_again():
    controller, now, place = stopped_on_the_way()
    assert controller.go_back(now, place) == ""
    blocked_from = now + 0.6  # what stopped the arm may press on it at the begin
    now, outcome, place = follow_on(controller, place, now, lambda time: 100.0 if time > blocked_from else 0.0)
    assert outcome is Outcome.STOPPED
    assert controller.go_back(now, place) == ""
    now, outcome, place = follow_on(controller, place, now)
    assert outcome is Outcome.DONE
    assert place == pytest.approx(ABOVE, abs=0.06)


def test_an_arm_that_works_or_has_come_no_way_does_not_go_back():
    controller = ArmController(LIMIT)
    assert "not stopped" in controller.go_back(0.0, HERE)
    controller.is_stopped = True
    assert "any further" in controller.go_back(0.0, HERE)


def test_the_blind_time_ends_with_the_way_back():
    controller, now, place = stopped_on_the_way()
    assert controller.go_back(now, place) == ""
    controller.update(now, place, 100.0)
    assert controller.is_moving  # what stopped it may still press on it
    controller.cancel(place)
    assert controller.release(0.0) == ""
    time, outcome, _ = go(controller, place, ABOVE, now + 0.02, lambda _: 100.0)
    assert outcome is Outcome.STOPPED
    assert time - now < 0.1


def test_trajectory_ends_where_the_arm_is_when_the_clock_is_set_back():
    controller = ArmController(LIMIT)
    controller.follow(motion(), 1000.0, HERE)
    assert controller.update(1000.5, (0.25,) * 7, 0.0) is None
    assert controller.update(3.0, (0.25,) * 7, 0.0) is Outcome.SET_BACK
    assert not controller.is_moving
    assert controller.target == (0.25,) * 7
