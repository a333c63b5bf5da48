"""The closed loop: navigator, costmaps, planner and controller drive a simulated base."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from move_base.control.dwa import DwaController
from move_base.control.oscillation import OscillationFlags
from move_base.costmap.grid import LETHAL
from move_base.navigation.result import Outcome, State
from move_base.parameters.reader import read_parameters
from robot_formulas.geometry import Pose, Velocity

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
    assert log.length < 13.0  # the taut way is 11.3 m; the robot keeps off the corners
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
    snapshot = simulation.navigator.global_snapshot
    assert snapshot.costs[snapshot.geometry.cell(-0.14, 0.1)] == LETHAL  # out of sight for long, and kept


def test_robot_with_a_camera_alone_looks_where_it_goes(simulate, walls, variant):
    tree = variant(0.5, 0.65, "point_cloud")
    simulation = simulate([*walls(), RACK], start=(-3.0, -3.0, -1.57), tree=tree)
    log = drive(simulation, (-3.0, 3.0, 1.57))  # behind it
    assert log.outcome is Outcome.SUCCEEDED
    moving = [(pose, command) for (_, pose, _), (_, command) in zip(log.states, log.commands, strict=True) if command.x]
    assert {command.y for _, command in log.commands} == {0.0}
    assert min(command.x for _, command in moving) > 0.0
    first = moving[0][0]
    assert abs(first.yaw - math.pi / 2) < 1.2  # turned towards the way before it drove


def test_robot_gets_into_a_narrow_gap_that_it_meets_aslant(simulate, walls, variant):
    boxes = [*walls(), (0.0, 3.4, 0.4, 5.6, 0.0), (0.0, -3.4, 0.4, 5.6, 0.0)]  # 1.2 m between them
    simulation = simulate(boxes, start=(-1.5, 3.0, -1.57), tree=variant(0.75, 0.5))
    log = drive(simulation, (1.5, -3.0, 0.0))
    assert log.outcome is Outcome.SUCCEEDED
    assert log.contacts == 0


@pytest.mark.parametrize("radius", [0.5, 0.8])
@pytest.mark.parametrize("start", [(-4.0, -4.0, 0.8), (2.5, -3.5, 3.1), (-2.0, -2.7, 0.0)])
def test_robot_passes_a_narrow_aisle_without_turning_back(simulate, walls, variant, start, radius):
    """An aisle of 1.1 m, 1.6 m long, with a wider mouth on both sides: 0.05 m beside the padded footprint."""
    sides = [(side * 2.825, 0.0, 4.55, 1.6, 0.0) for side in (-1, 1)]
    arms = [(side * 3.15, end * 1.4, 3.9, 1.2, 0.0) for side in (-1, 1) for end in (-1, 1)]
    simulation = simulate([*walls(), *sides, *arms], start=start, tree=variant(0.5, radius))
    log = drive(simulation, (0.0, 3.5, 1.57))
    assert (log.outcome, log.text) == (Outcome.SUCCEEDED, "Goal reached.")
    assert log.contacts == 0
    backwards = sum(command.x < 0.0 for _, command in log.commands)
    assert backwards < 0.1 * len(log.commands)


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


def test_nothing_turns_in_recovery_on_stale_data(simulate, walls, tree):
    turning = [{"name": "turn", "type": "rotate_recovery/RotateRecovery"}]
    simulation = simulate([*walls(), RACK], start=(-3.0, 0.0, 0.0), tree=tree(recovery_behaviors=turning))
    drive(simulation, (3.0, 0.0, 0.0), seconds=1.0)
    simulation.navigator._start_recovery(simulation.time, simulation.pose, "test")
    simulation.silent_from = simulation.time
    log = simulation.run(3.0)
    assert {command for when, command in log.commands if when > simulation.silent_from + 1.1} == {Velocity()}


def test_repeated_messages_do_not_count_as_current(simulate, walls):
    simulation = simulate(walls())
    simulation.sense()
    (source,) = simulation.navigator.sources
    old = simulation.navigator._surroundings._sensors[source.stream].recent[-1]
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


def test_blocked_goal_is_approached_as_far_as_the_default_tolerance_allows(simulate, walls, tree):
    simulation = simulate([*walls(), RACK], start=(-3.0, 0.0, 0.0), tree=tree(NavfnROS__default_tolerance=0.8))
    log = drive(simulation, (-0.6, 0.0, 0.0))
    assert log.outcome is Outcome.SUCCEEDED
    assert simulation.pose.distance(Pose(-0.6, 0.0, 0.0)) < 0.8


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


def at_a_wall(simulate, walls, **options):
    """A robot that a wall ahead keeps from driving on and from turning; it wants to go on through the wall."""
    simulation = simulate([*walls(), (0.7, 0.0, 0.2, 6.0, 0.0)], **options)
    simulation.run(0.3)
    robot = Pose.from_matrix(simulation.lookup("odom", "base_link", None))
    path = robot.apply(np.array([[0.1 * step, 0.0] for step in range(30)]))
    return simulation.navigator._controller, robot, path, simulation.navigator.local_snapshot


def test_sideways_is_tried_before_backward(simulate, walls):
    controller, robot, path, snapshot = at_a_wall(simulate, walls)
    chosen = controller.follow(robot, Velocity(), path, 3.0, snapshot)
    assert chosen.velocity.x == 0.0 and chosen.velocity.y != 0.0


@pytest.mark.parametrize("turning", [2.0, -2.0, 1e300])
def test_base_that_is_measured_faster_than_it_may_be_is_sent_no_faster(tree, turning):
    controller = DwaController(read_parameters(tree(TrajectoryPlannerROS__acc_lim_theta=3.0)))
    samples = controller._arc_samples(Velocity(9.0, 0.0, turning))
    assert np.abs(samples[:, 2]).max() <= 1.57
    assert samples[:, 0].max() <= 0.5


def test_base_that_gets_sideways_slowly_is_not_sent_fast(simulate, walls, tree):
    controller, robot, path, snapshot = at_a_wall(simulate, walls, tree=tree(TrajectoryPlannerROS__acc_lim_y=0.1))
    chosen = controller.follow(robot, Velocity(), path, 3.0, snapshot)
    assert abs(chosen.velocity.y) == pytest.approx(0.08)


def test_base_that_cannot_move_sideways_backs_off(simulate, walls, tree):
    controller, robot, path, snapshot = at_a_wall(
        simulate, walls, tree=tree(TrajectoryPlannerROS__holonomic_robot=False)
    )
    chosen = controller.follow(robot, Velocity(), path, 3.0, snapshot)
    assert chosen.velocity == Velocity(-0.1, 0.0, 0.0)


def covered(simulation, pose):
    """Area of obstacles that the robot covers at a pose, m2."""
    x, y = np.meshgrid(np.linspace(-0.48, 0.48, 97), np.linspace(-0.40, 0.40, 81))
    cells = simulation.geometry.cells(pose.apply(np.stack([x, y], axis=-1).reshape(-1, 2)))
    return 1e-4 * simulation.solid[cells].sum()


WALL = (1.1, 0.0, 0.2, 6.0, 0.0)  # its near face is at x = 1
CORNER = math.hypot(0.48, 0.40)


@pytest.mark.parametrize(
    ("nearest", "yaw", "overlap"),
    [
        (0.48, 0.0, 0.01),
        (0.48, 0.0, 0.06),
        (0.40, math.pi / 2, 0.03),
        (0.48, math.pi, 0.03),
        (CORNER, -math.atan2(0.40, 0.48), 0.03),
        (CORNER, math.pi - math.atan2(0.40, 0.48), 0.03),
    ],
    ids=["slightly in front", "in front", "beside", "behind", "front corner", "rear corner"],
)
def test_robot_that_touches_a_wall_comes_free_of_it(simulate, walls, nearest, yaw, overlap):
    simulation = simulate([*walls(), WALL], start=(1.0 - nearest + overlap, 0.0, yaw))
    log = drive(simulation, (-1.0, 0.5, yaw), seconds=30.0)
    assert log.outcome is Outcome.SUCCEEDED
    areas = [covered(simulation, pose) for _, pose, _ in log.states]
    assert areas[0] > 0.0 and areas[-1] == 0.0
    assert max(areas) <= areas[0] + 1e-4


def test_robot_comes_free_by_the_beginning_of_a_turn_that_would_touch_again(simulate, walls, tree):
    """It stands in a pocket nearly along its wall, can't move sideways, and a whole turn is more than it needs."""
    yaw = math.pi / 2 - 0.12
    corner = Pose(0.0, 0.0, yaw).apply(np.array([[0.48, -0.40]]))[0, 0]
    start = Pose(1.01 - corner, 0.0, yaw)
    pocket = [(start.x, side * 0.84, 2.0, 0.6, 0.0) for side in (-1, 1)]
    settings = tree(TrajectoryPlannerROS__holonomic_robot=False)
    simulation = simulate([*walls(), WALL, *pocket], start=(start.x, start.y, yaw), tree=settings)
    log = drive(simulation, (start.x - 2.0, 0.0, math.pi), seconds=5.0)
    assert covered(simulation, start) > 0.0
    assert covered(simulation, log.states[-1][1]) == 0.0


@pytest.mark.parametrize("boxes", [[], [WALL]], ids=["free", "touching"])
def test_goal_of_a_robot_that_does_not_turn_to_its_heading_ends(simulate, walls, monkeypatch, boxes):
    simulation = simulate([*walls(), *boxes], start=(1.03 - 0.48, 0.0, 0.0))

    def jam(_command, duration):
        simulation.time += duration
        simulation.history[round(simulation.time / 0.01)] = simulation.pose

    monkeypatch.setattr(simulation, "move", jam)
    log = drive(simulation, (1.03 - 0.48, 0.0, math.pi))
    assert (log.outcome, log.text) == (Outcome.ABORTED, "the robot does not turn to the goal's heading")


def test_robot_between_walls_that_it_touches_on_both_sides_stays(simulate, walls):
    boxes = [*walls(), (0.0, 0.47, 6.0, 0.2, 0.0), (0.0, -0.47, 6.0, 0.2, 0.0)]
    boxes += [(side * 0.6, 0.0, 0.3, 1.0, 0.0) for side in (-1, 1)]
    simulation = simulate(boxes)
    log = drive(simulation, (4.0, 0.0, 0.0), seconds=5.0)
    areas = [covered(simulation, pose) for _, pose, _ in log.states]
    assert areas[0] > 0.0
    assert max(areas) <= areas[0] + 1e-4
    assert simulation.pose.distance(Pose(0.0, 0.0, 0.0)) < 0.05


def held(simulate, walls, tree, yaw, **changes):
    """The controller of a robot that touches a wall, and what it needs to choose a velocity."""
    nearest = 0.40 if abs(yaw) == math.pi / 2 else 0.48
    changes = {f"TrajectoryPlannerROS__{name}": value for name, value in changes.items()}
    simulation = simulate([*walls(), WALL], start=(1.03 - nearest, 0.0, yaw), tree=tree(**changes))
    simulation.run(0.3)
    robot = Pose.from_matrix(simulation.lookup("odom", "base_link", None))
    return simulation.navigator._controller, robot, simulation.navigator.local_snapshot


@pytest.mark.parametrize(
    ("yaw", "changes", "expected"),
    [
        (0.0, {}, Velocity(-0.1, 0.0, 0.0)),
        (0.0, {"escape_vel": -0.2}, Velocity(-0.2, 0.0, 0.0)),
        (0.0, {"escape_vel": 0.0}, None),
        (math.pi, {"escape_vel": 0.0}, Velocity(0.1, 0.0, 0.0)),
        (math.pi, {"min_vel_x": 0.0, "max_vel_x": 0.05}, Velocity(0.05, 0.0, 0.0)),
        (math.pi / 2, {"y_vels": [-0.1, 0.2]}, Velocity(0.0, 0.2, 0.0)),
        (math.pi / 2, {"holonomic_robot": False}, None),
    ],
)
def test_way_out_of_a_wall_is_one_that_the_base_can_take(simulate, walls, tree, yaw, changes, expected):
    controller, robot, snapshot = held(simulate, walls, tree, yaw, **changes)
    chosen = controller._ahead._come_free(robot, snapshot)
    assert (chosen and chosen.velocity) == expected


def test_turn_of_a_robot_that_touches_a_wall_begins_with_the_way_out(simulate, walls, tree):
    controller, robot, snapshot = held(simulate, walls, tree, 0.0)
    assert controller.turn(robot, 1.0, snapshot).velocity == Velocity(-0.1, 0.0, 0.0)


def test_robot_that_touches_nothing_has_no_way_out(simulate, walls):
    controller, robot, _, snapshot = at_a_wall(simulate, walls)
    assert controller._ahead._come_free(robot, snapshot) is None


def test_back_and_forth_on_the_spot_ends_until_the_robot_has_moved():
    for column, velocity in ((1, Velocity(0.0, 0.3, 0.0)), (2, Velocity(0.0, 0.0, 0.5))):
        flags, here = OscillationFlags(), Pose(0.0, 0.0, 0.0)
        samples = np.zeros((2, 3))
        samples[:, column] = -0.3, 0.3
        flags.take(here, velocity)
        assert len(flags.allowed(samples)) == 2
        flags.take(here, Velocity(0.0, -velocity.y, -velocity.yaw))
        assert flags.allowed(samples)[:, column].tolist() == [-0.3]
        flags.follow(Pose(0.04, 0.0, 0.0), 0.05)
        assert len(flags.allowed(samples)) == 1
        flags.follow(Pose(0.06, 0.0, 0.0), 0.05)
        assert len(flags.allowed(samples)) == 2


CLOSED = (0.0, 0.0, 0.8, 12.0, 0.0)  # a wall from one side of the room to the other


def recovered(log):
    """Names of the recovery behaviours in the order in which they began."""
    return [text.split()[1].rstrip(":") for _, text in log.warnings if text.startswith("Recovery ")]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, ["conservative_reset", "rotate_recovery", "aggressive_reset", "rotate_recovery"]),
        ({"clearing_rotation_allowed": False}, ["conservative_reset", "aggressive_reset"]),
        ({"recovery_behavior_enabled": False}, []),
        ({"recovery_behaviors": [{"name": "wipe", "type": "clear_costmap_recovery/ClearCostmapRecovery"}]}, ["wipe"]),
        ({"recovery_behaviors": []}, []),
    ],
)
def test_recovery_sequence_is_the_one_asked_for(simulate, walls, tree, changes, expected):
    simulation = simulate([*walls(), CLOSED], start=(-3.0, 0.0, 0.0), tree=tree(planner_patience=1.0, **changes))
    log = drive(simulation, (3.0, 0.0, 0.0))
    assert log.outcome is Outcome.ABORTED
    assert recovered(log) == expected
    assert log.contacts == 0


def test_rotation_of_recovery_is_a_full_turn(simulate, walls, tree):
    turn = [{"name": "turn", "type": "rotate_recovery/RotateRecovery"}]
    changes = {"planner_patience": 1.0, "recovery_behaviors": turn}
    simulation = simulate([*walls(), CLOSED], start=(-3.0, 0.0, 0.0), tree=tree(**changes))
    log = drive(simulation, (3.0, 0.0, 0.0))
    yaws = np.unwrap([pose.yaw for _, pose, _ in log.states])
    assert yaws[-1] - yaws[0] == pytest.approx(2.0 * math.pi, abs=0.25)
    assert max(command.yaw for _, command in log.commands) <= 1.0


@pytest.mark.parametrize(("side", "kept"), [(1.0, False), (4.0, True)])
def test_clearing_keeps_a_square_of_its_reset_distance(simulate, walls, tree, side, kept):
    wipe = [{"name": "wipe", "type": "clear_costmap_recovery/ClearCostmapRecovery"}]
    changes = {"planner_patience": 1.0, "recovery_behaviors": wipe, "wipe__reset_distance": side}
    changes["wipe__layer_names"] = ["obstacles_layer"]
    simulation = simulate([*walls(), CLOSED], start=(-3.0, 0.0, math.pi), tree=tree(**changes))
    costmap = simulation.navigator._global.costmap
    behind = costmap.geometry.cell(-2.0, 0.0)  # where no ray goes
    costmap.obstacles("obstacles_layer")[behind] = LETHAL
    assert recovered(drive(simulation, (3.0, 0.0, 0.0))) == ["wipe"]
    assert (costmap.obstacles("obstacles_layer")[behind] == LETHAL) == kept


@pytest.mark.parametrize(
    ("changes", "clears"),
    [
        ({}, (False, False)),  # the default is a layer named obstacles
        ({"wipe__layer_names": ["obstacles_layer"]}, (True, True)),
        ({"wipe__layer_names": ["obstacles_layer"], "wipe__affected_maps": "local"}, (False, True)),
        ({"wipe__layer_names": ["obstacles_layer"], "wipe__affected_maps": "global"}, (True, False)),
        ({"wipe__layer_names": ["obstacles_layer"], "wipe__invert_area_to_clear": True}, (False, False)),
        ({"wipe__layer_names": ["elsewhere"]}, (False, False)),
    ],
)
def test_clearing_is_limited_to_its_layers_and_maps(simulate, walls, tree, changes, clears):
    wipe = [{"name": "wipe", "type": "clear_costmap_recovery/ClearCostmapRecovery"}]
    settings = {"planner_patience": 1.0, "recovery_behaviors": wipe, "wipe__reset_distance": 1.0, **changes}
    simulation = simulate([*walls(), CLOSED], start=(-3.0, 0.0, math.pi), tree=tree(**settings))
    held = []
    simulation.run(0.3)
    for area in (simulation.navigator._global, simulation.navigator._local):
        robot = area.robot_pose(simulation.time, simulation)
        x, y = robot.apply(np.array([[-1.0, 0.0]]))[0]  # behind the robot, where no ray goes
        held.append((area.costmap, area.costmap.geometry.cell(x, y)))
        area.costmap.obstacles("obstacles_layer")[held[-1][1]] = LETHAL
    assert recovered(drive(simulation, (3.0, 0.0, 0.0))) == ["wipe"]
    found = tuple(costmap.obstacles("obstacles_layer")[cell] != LETHAL for costmap, cell in held)
    assert found == clears


def test_planning_is_given_up_after_the_retries(simulate, walls, tree):
    changes = {"planner_patience": 30.0, "max_planning_retries": 3, "recovery_behavior_enabled": False}
    simulation = simulate([*walls(), CLOSED], start=(-3.0, 0.0, 0.0), tree=tree(**changes))
    log = drive(simulation, (3.0, 0.0, 0.0))
    assert log.outcome is Outcome.ABORTED
    assert "4 retries" in log.text and "there is no way to the goal" in log.text
    assert log.duration < 5.0


def test_controller_without_a_free_velocity_recovers_after_its_patience(simulate, walls, tree):
    changes = {"controller_patience": 2.0, "clearing_rotation_allowed": False}
    simulation = simulate(walls(), start=(-3.0, 0.0, 0.0), tree=tree(**changes))
    simulation.navigator._controller.follow = lambda *_: None
    log = drive(simulation, (3.0, 0.0, 0.0))
    assert log.outcome is Outcome.ABORTED
    assert log.text == "no free velocity for 2 s (after all recovery behaviours)"
    assert recovered(log) == ["conservative_reset", "aggressive_reset"]
    assert log.duration == pytest.approx(3 * 2.0, abs=1.0)


def test_robot_that_hardly_moves_oscillates(simulate, walls, tree):
    changes = {"oscillation_timeout": 3.0, "oscillation_distance": 0.4, "recovery_behavior_enabled": False}
    simulation = simulate(walls(), start=(-3.0, 0.0, 0.0), tree=tree(**changes))
    simulation.move = lambda command, duration: setattr(simulation, "time", simulation.time + duration)  # wheels spin
    simulation.lookup = lambda target, source, stamp, look=simulation.lookup: look(target, source, None)
    log = drive(simulation, (3.0, 0.0, 0.0), seconds=20.0)
    assert log.outcome is Outcome.ABORTED
    assert log.text == "moved less than 0.4 m in 3 s (recovery is disabled)"


def test_localisation_that_jumps_is_followed_by_a_new_plan(simulate, walls):
    simulation = simulate([*walls(), RACK], start=(-3.0, -3.0, 0.0))
    drive(simulation, (3.0, -3.0, 0.0), until=lambda s: s.pose.y > -1.0)
    simulation.map_to_odom = Pose(0.9, 0.3, 0.1).matrix()
    simulation.pose = Pose(simulation.pose.x - 0.5, simulation.pose.y, simulation.pose.yaw)  # where it says to be now
    log = simulation.run(60.0)
    assert log.outcome is Outcome.SUCCEEDED
    assert log.contacts == 0


def test_scan_that_repeats_is_old_after_a_while(simulate, walls):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0))
    drive(simulation, (4.0, 0.0, 0.0), seconds=2.0)
    observe, (source,) = simulation.navigator.observe, simulation.navigator.sources
    stuck = simulation.navigator._surroundings._sensors[source.stream].recent[-1]
    simulation.navigator.observe = lambda _, now: observe(stuck, now)
    log = simulation.run(30.0)
    assert log.outcome is Outcome.ABORTED
    assert log.text == "no current data from front/scan for 15.0 s"


def test_scan_in_an_unknown_frame_is_the_reason(simulate, walls):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0))
    observe = simulation.navigator.observe
    simulation.navigator.observe = lambda seen, now: observe(replace(seen, frame="attic"), now)
    log = drive(simulation, (4.0, 0.0, 0.0))
    assert log.outcome is Outcome.ABORTED
    assert log.text == "no transform for front/scan from its frame 'attic' for 15.0 s"


def test_scan_whose_stamp_jumps_does_not_shut_out_later_ones(simulate, walls):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0))
    drive(simulation, (4.0, 0.0, 0.0), seconds=2.0)
    (source,) = simulation.navigator.sources
    newest = simulation.navigator._surroundings._sensors[source.stream].recent[-1]
    for jump in (1e9, -50.0):
        assert simulation.navigator.observe(replace(newest, stamp=newest.stamp + jump), simulation.time)
    assert simulation.run(40.0).outcome is Outcome.SUCCEEDED


def test_sensor_has_the_range_of_each_costmap(simulate, walls, tree):
    given = json.loads(json.dumps(tree()))  # so that the costmaps share no group
    given["global_costmap"]["obstacles_layer"]["scan"]["obstacle_range"] = 1.0
    simulation = simulate([], hidden=[(2.0, 0.0, 0.5, 0.5, 0.0)], tree=given)
    simulation.run(1.0)
    seen = [
        (area.snapshot.costs == LETHAL).any() for area in (simulation.navigator._global, simulation.navigator._local)
    ]
    assert seen == [False, True]


def test_costmaps_rest_without_a_goal_where_asked_for(simulate, walls, tree):
    simulation = simulate(walls(), tree=tree(shutdown_costmaps=True))
    simulation.run(1.0)
    assert simulation.navigator.local_snapshot is None
    assert drive(simulation, (2.0, 0.0, 0.0)).text == "Goal reached."


def test_recovery_tells_its_name_and_place_in_the_sequence(simulate, walls, tree):
    simulation = simulate([*walls(), CLOSED], start=(-3.0, 0.0, 0.0), tree=tree(planner_patience=1.0))
    begun, step = [], simulation.navigator.step
    simulation.navigator.step = lambda *arguments: _noted(step(*arguments), begun)
    drive(simulation, (3.0, 0.0, 0.0))
    found = [(one.name, one.index, one.count) for one in begun]
    names = ("conservative_reset", "rotate_recovery", "aggressive_reset", "rotate_recovery")
    assert found == [(name, index, 4) for index, name in enumerate(names)]


def _noted(result, begun):
    if result.recovery is not None:
        begun.append(result.recovery)
    return result


def test_differential_drive_arrives(simulate, walls, tree):
    simulation = simulate(
        [*walls(), (0.0, 1.0, 0.8, 2.4, 0.0)],
        start=(-3.0, 0.0, 1.5),
        tree=tree(TrajectoryPlannerROS__holonomic_robot=False),
    )
    log = drive(simulation, (3.0, 0.5, 0.0))
    assert log.text == "Goal reached."
    assert {command.y for _, command in log.commands} == {0.0}
    assert log.contacts == 0


def test_clock_that_is_set_back_during_a_recovery_ends_the_recovery_only(simulate, walls, tree):
    turn = [{"name": "turn", "type": "rotate_recovery/RotateRecovery"}]
    changes = {"planner_patience": 1.0, "recovery_behaviors": turn}
    simulation = simulate([*walls(), CLOSED], start=(-3.0, 0.0, 0.0), tree=tree(**changes))
    drive(simulation, (3.0, 0.0, 0.0), until=lambda one: one.navigator.state is State.RECOVERING)
    simulation.time = 50.0
    simulation.sent = -math.inf
    simulation.history = {round(50.0 / 0.01): simulation.pose}
    simulation.navigator.reset_time(simulation.time)
    simulation.run(0.1)
    assert simulation.navigator.state is State.PLANNING
    assert simulation.run(60.0).outcome is Outcome.ABORTED


@pytest.mark.parametrize(("duration", "fewest", "most"), [(0.0, 15, 25), (1.0, 1, 2)])
def test_robot_that_drives_plans_less_often_where_plans_take_long(simulate, walls, tree, duration, fewest, most):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0), tree=tree(planner_frequency=4.0))
    plan_between, planned = simulation.navigator.plan_between, []

    def plan(*arguments):
        planned.append(simulation.time)
        for _ in range(round(duration / 0.01)):
            simulation.time += 0.01
            simulation.history[round(simulation.time / 0.01)] = simulation.pose
        return plan_between(*arguments)

    simulation.navigator.plan_between = plan
    drive(simulation, (4.0, 0.0, 0.0), seconds=5.0)
    assert fewest <= len(planned) <= most
    assert simulation.pose.x > -3.0
