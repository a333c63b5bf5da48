"""The closed loop: navigator, costmaps, planner and controller drive a simulated base."""

import math

import numpy as np
import pytest
from move_base.geometry import Pose, Velocity
from move_base.navigator import Outcome

RACK = (0.0, -1.5, 0.8, 6.0, 0.0)


def drive(simulation, goal, seconds=60.0, until=None):
    simulation.run(0.3)
    simulation.navigator.set_goal(Pose(*goal), simulation.time)
    return simulation.run(seconds, until)


@pytest.mark.parametrize(
    "settings",
    [
        (0.3, 0.8, "scan"),
        (0.5, 0.65, "scan"),
        (0.75, 0.5, "scan"),
        (0.3, 0.8, "point_cloud"),
        (0.75, 0.5, "point_cloud"),
    ],
)
def test_variants_drive_round_a_rack_without_contact(simulate, walls, variant, settings):
    simulation = simulate([*walls(), RACK], start=(-3.0, -3.0, 0.0), tree=variant(*settings))
    log = drive(simulation, (3.0, -3.0, 0.0))
    assert (log.outcome, log.text) == (Outcome.SUCCEEDED, "Goal reached.")
    assert log.contacts == 0
    assert simulation.pose.distance(Pose(3.0, -3.0, 0.0)) < 0.35
    assert log.length < 12.5  # the taut way is 11.3 m
    speed = settings[0]
    assert log.length / log.duration > 0.75 * speed
    assert max(command.x for _, command in log.commands) <= speed + 1e-9


def test_hidden_obstacle_on_the_way_is_driven_round(simulate, walls):
    simulation = simulate(walls(), hidden=[(0.0, 0.1, 0.3, 0.3, 0.0)], start=(-4.0, 0.0, 0.0))
    log = drive(simulation, (4.0, 0.0, 0.0))
    assert log.outcome is Outcome.SUCCEEDED
    assert log.contacts == 0


def test_hidden_obstacle_is_driven_round_on_the_camera_alone(simulate, walls, variant):
    tree = variant(0.5, 0.65, "point_cloud")
    simulation = simulate(walls(), hidden=[(0.0, 0.1, 0.3, 0.3, 0.0)], start=(-4.0, 0.0, 0.0), tree=tree)
    log = drive(simulation, (4.0, 0.0, 0.0))
    assert log.outcome is Outcome.SUCCEEDED
    assert log.contacts == 0


def test_robot_gets_into_a_narrow_gap_that_it_meets_aslant(simulate, walls, variant):
    boxes = [*walls(), (0.0, 3.4, 0.4, 5.6, 0.0), (0.0, -3.4, 0.4, 5.6, 0.0)]  # 1.2 m between them
    simulation = simulate(boxes, start=(-1.5, 3.0, -1.57), tree=variant(0.75, 0.5))
    log = drive(simulation, (1.5, -3.0, 0.0))
    assert log.outcome is Outcome.SUCCEEDED
    assert log.contacts == 0


def test_robot_turns_before_it_drives_away_from_a_wall(simulate, walls):
    simulation = simulate(walls(), start=(4.9, 0.0, 0.0))
    log = drive(simulation, (-3.0, 0.0, math.pi))
    assert log.outcome is Outcome.SUCCEEDED
    assert log.contacts == 0


def test_driving_is_smooth_and_ends_slowly(simulate, walls):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0))
    log = drive(simulation, (4.0, 0.0, 0.0))
    turns = np.array([command.yaw for _, command in log.commands])
    assert np.abs(turns).max() < 0.3
    assert np.count_nonzero(np.diff(np.sign(turns[np.abs(turns) > 0.05]))) <= 2
    assert log.commands[-2][1].x < 0.35
    assert all(command.y == 0.0 for _, command in log.commands)


def test_goals_heading_is_turned_to_within_tolerance(simulate, walls, tree):
    simulation = simulate(walls(), tree=tree(TrajectoryPlannerROS__yaw_goal_tolerance=0.1))
    log = drive(simulation, (1.5, 0.0, 3.0))
    assert log.outcome is Outcome.SUCCEEDED
    assert abs(simulation.pose.yaw - 3.0) < 0.15


def test_robot_stops_on_stale_data_and_aborts_after_the_patience(simulate, walls):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0))
    simulation.silent_from = simulation.time + 4.0
    log = drive(simulation, (4.0, 0.0, 0.0))
    assert log.outcome is Outcome.ABORTED
    assert log.text == "no current data from front/scan for 15.0 s"
    stopped = [command for when, command in log.commands if when > simulation.silent_from + 1.1]
    assert len(stopped) > 200
    assert set(stopped) == {Velocity()}
    assert any("Standing still: no current data from front/scan" in text for _, text in log.warnings)


def test_robot_drives_on_when_data_come_back(simulate, walls):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0))
    simulation.silent_from = simulation.time + 4.0
    returns = simulation.silent_from + 8.0

    def data_are_back(s):
        if s.time > returns:
            s.silent_from = math.inf
        return False

    assert drive(simulation, (4.0, 0.0, 0.0), until=data_are_back).outcome is Outcome.SUCCEEDED


def test_nothing_turns_in_recovery_on_stale_data(simulate, walls):
    simulation = simulate([*walls(), RACK], start=(-3.0, 0.0, 0.0), hidden=[])
    drive(simulation, (3.0, 0.0, 0.0), seconds=1.0)
    simulation.navigator._start_recovery(simulation.time, simulation.pose, "test")
    simulation.navigator._work.behaviour = "rotate"
    simulation.silent_from = simulation.time
    log = simulation.run(3.0)
    assert {command for when, command in log.commands if when > simulation.silent_from + 1.1} == {Velocity()}


def test_repeated_messages_do_not_count_as_current(simulate, walls):
    simulation = simulate(walls())
    simulation.sense()
    (source,) = simulation.navigator.sources
    old = simulation.navigator._sensors[source.topic, source.data_type].recent[-1]
    assert "not newer" in simulation.navigator.observe(old, simulation.time)
    assert "ahead of the clock" in simulation.navigator.observe(
        type(old)(**{**vars(old), "stamp": simulation.time + 5.0}), simulation.time
    )


@pytest.mark.parametrize(
    ("goal", "reason"),
    [((50.0, 0.0, 0.0), "outside the map"), ((0.0, -1.0, 0.0), "in a wall of the map")],
)
def test_hopeless_goal_ends_at_once_with_its_reason(simulate, walls, goal, reason):
    log = drive(simulate([*walls(), RACK], start=(-3.0, 0.0, 0.0)), goal)
    assert log.outcome is Outcome.ABORTED
    assert reason in log.text
    assert log.duration < 1.0


def test_unreachable_goal_is_given_up_after_recovery(simulate, walls):
    simulation = simulate([*walls(), (0.0, 0.0, 0.8, 12.0, 0.0)], start=(-3.0, 0.0, 0.0))
    log = drive(simulation, (3.0, 0.0, 0.0))
    assert log.outcome is Outcome.ABORTED
    assert "there is no way to the goal" in log.text
    assert log.contacts == 0
    assert any("Recovery rotate" in text for _, text in log.warnings)


def test_missing_map_is_the_reason_of_the_abort(simulate, walls):
    simulation = simulate(walls())
    fresh = type(simulation.navigator)(simulation.navigator.parameters)
    simulation.navigator = fresh
    log = drive(simulation, (1.0, 0.0, 0.0))
    assert log.outcome is Outcome.ABORTED
    assert "no map received on map for 5" in log.text


def test_cancelled_goal_sends_nothing_more(simulate, walls):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0))
    drive(simulation, (4.0, 0.0, 0.0), seconds=2.0)
    simulation.navigator.cancel()
    assert simulation.navigator.step(simulation.time, simulation, Velocity()).velocity is None


def test_clock_set_back_does_not_end_the_goal(simulate, walls):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0))
    drive(simulation, (4.0, 0.0, 0.0), seconds=3.0)
    simulation.time -= 50.0
    simulation.sent = -math.inf
    simulation.navigator.reset_time(simulation.time)
    assert simulation.run(40.0).outcome is Outcome.SUCCEEDED
