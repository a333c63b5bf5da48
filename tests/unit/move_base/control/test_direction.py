"""Driving backwards is the mirror image of driving ahead."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from move_base.control.direction import Controller
from move_base.control.dwa import DwaController
from move_base.costmap.costmap import Costmap
from move_base.costmap.static_map import StaticMap
from move_base.navigation.result import Outcome
from move_base.parameters.reader import read_parameters
from robot_formulas.geometry import Pose, Velocity, wrap

CELLS, RESOLUTION = 160, 0.05
NUMBER = {"allow_nan": False, "allow_infinity": False}
AROUND = st.tuples(st.floats(0.35, 1.0, **NUMBER), st.floats(-3.1, 3.1, **NUMBER))
LENGTHS = st.floats(0.15, 0.5, **NUMBER)
SPEEDS = st.floats(-0.3, 0.3, **NUMBER)


def tug(corners, **planner):
    """A tug with a short nose and a long tail; its controller's parameters are those of the planner."""
    layer = {
        "plugins": [
            {"name": "plan", "type": "costmap_2d::StaticLayer"},
            {"name": "rim", "type": "costmap_2d::InflationLayer"},
        ]
    }
    costmap = {**layer, "footprint": corners, "footprint_padding": 0.05, "resolution": RESOLUTION}
    costmap |= {"global_frame": "yard", "robot_base_frame": "hull", "plan": {"map_topic": "yard"}}
    return read_parameters(
        {"global_costmap": dict(costmap), "local_costmap": dict(costmap), "TrajectoryPlannerROS": planner}
    )


def snapshot_of(parameters, boxes, robot):
    """The costmap of a yard with boxes of a cell, at distances and directions from the robot."""
    occupied = np.zeros((CELLS, CELLS), dtype=np.int8)
    for distance, direction in boxes:
        x, y = robot.x + distance * math.cos(direction), robot.y + distance * math.sin(direction)
        row, column = (int((value + 4.0) / RESOLUTION) for value in (y, x))
        occupied[row, column] = 100
    costmap = Costmap(parameters.local_costmap)
    origin = (-4.0, -4.0, 0.0)
    costmap.set_map(StaticMap.create(occupied.ravel(), CELLS, CELLS, RESOLUTION, origin), "yard")
    return costmap.update(robot, [])


@st.composite
def situations(draw):
    nose, tail, left, right = (draw(LENGTHS) for _ in range(4))
    corners = [[nose, left], [nose, -right], [-tail, -right], [-tail, left]]
    robot = Pose(*draw(st.tuples(*[st.floats(-1.0, 1.0, **NUMBER)] * 2)), draw(st.floats(-3.1, 3.1, **NUMBER)))
    away = draw(st.floats(-3.1, 3.1, **NUMBER))
    steps = np.arange(0.0, 2.0, 0.1)[:, None]
    path = (robot.x, robot.y) + steps * (math.cos(away), math.sin(away))
    velocity = Velocity(draw(SPEEDS), draw(SPEEDS), draw(st.floats(-1.0, 1.0, **NUMBER)))
    return corners, robot, path, velocity, draw(st.lists(AROUND, max_size=6)), draw(st.floats(-0.3, 0.1, **NUMBER))


def mirrored(pose):
    return Pose(pose.x, pose.y, wrap(pose.yaw + math.pi))


def assert_mirror(back, ahead):
    assert (back is None) == (ahead is None)
    if back is None:
        return
    assert back.cost == pytest.approx(ahead.cost, abs=1e-6)
    assert back.poses[-1, :2] == pytest.approx(ahead.poses[-1, :2], abs=1e-6)
    assert math.cos(back.poses[-1, 2] - ahead.poses[-1, 2]) == pytest.approx(-1.0)
    assert (back.velocity.x, back.velocity.y) == pytest.approx((-ahead.velocity.x, -ahead.velocity.y))
    assert back.velocity.yaw == pytest.approx(ahead.velocity.yaw)


@settings(max_examples=200, deadline=None)
@given(situations())
def test_backwards_is_the_mirror_image_of_ahead(situation):
    corners, robot, path, velocity, boxes, sideways = situation
    common = {"acc_lim_x": 3.0, "acc_lim_y": 2.0, "vx_samples": 5, "max_vel_theta": 1.3}
    ahead = tug(corners, **common, max_vel_x=0.4, min_vel_x=0.1, y_vels=[sideways, 0.2], escape_vel=-0.1)
    turned = [[-x, -y] for x, y in corners]
    back = tug(turned, **common, max_vel_x=-0.1, min_vel_x=-0.4, y_vels=[-0.2, -sideways], escape_vel=-0.1)
    snapshot = snapshot_of(ahead, boxes, robot)
    one, other = DwaController(ahead), Controller(back)
    for _ in range(3):  # it remembers the last command
        went = one.follow(robot, velocity, path, 2.0, snapshot)
        came = other.follow(mirrored(robot), Velocity(-velocity.x, -velocity.y, velocity.yaw), path, 2.0, snapshot)
        assert_mirror(came, went)
        if went is None:
            break
        velocity = went.velocity
        robot = Pose(*(float(value) for value in went.poses[0]))
        if not snapshot.geometry.contains(robot.x, robot.y):
            break
    for angle in (0.7, -2.0):
        assert_mirror(other.turn(mirrored(robot), angle, snapshot), one.turn(robot, angle, snapshot))


BOXES = st.lists(st.tuples(st.floats(-1.5, 1.5, **NUMBER), st.floats(-1.5, 1.5, **NUMBER)), max_size=4)


@settings(max_examples=4, deadline=None)
@given(BOXES, st.floats(-3.0, 3.0, **NUMBER), st.floats(-3.0, 3.0, **NUMBER))
def test_drive_by_the_rear_laser_is_that_of_a_robot_turned_round(simulation_class, boxes, yaw, goal_yaw):
    make, walls, variant = simulation_class
    hidden = [(x, y, 0.3, 0.3, 0.0) for x, y in boxes]
    logs = []
    for source, turn in (("scan", 0.0), ("rear_scan", math.pi)):
        start = (-2.5, -0.5, yaw + turn)
        simulation = make(walls(), hidden=hidden, start=start, tree=variant(0.3, 0.5, source))
        simulation.run(0.3)
        simulation.navigator.set_goal(Pose(2.5, 0.3, goal_yaw + turn), simulation.time)
        logs.append(simulation.run(60.0))
    ahead, back = logs
    assert back.outcome is ahead.outcome and back.contacts == ahead.contacts
    # Rays and cells are rounded otherwise after a half turn: the ways are alike, not equal to the last digit.
    assert back.length == pytest.approx(ahead.length, abs=0.5)
    assert back.duration == pytest.approx(ahead.duration, abs=3.0)
    assert max(command.x for _, command in back.commands) <= 0.1 + 1e-9  # the escape's speed


@pytest.fixture(scope="module")
def simulation_class(request):
    """What the fixtures `simulate`, `walls` and `variant` give; hypothesis takes none of a test's own scope."""
    plugin = request.config.pluginmanager
    (conftest,) = (one for one in plugin.get_plugins() if getattr(one, "Simulation", None) and hasattr(one, "room"))
    return conftest.Simulation, conftest.room, conftest.variant_tree


def backwards(simulate, walls, variant, goal, *, hidden=(), start=(-3.0, 0.0, 0.0), **changes):
    simulation = simulate(walls(), hidden=hidden, start=start, tree=variant(0.3, 0.5, "rear_scan", **changes))
    simulation.run(0.3)
    simulation.navigator.set_goal(Pose(*goal), simulation.time)
    return simulation, simulation.run(60.0)


def test_robot_turns_drives_backwards_and_ends_with_the_goals_heading(simulate, walls, variant):
    tolerance = {"TrajectoryPlannerROS__yaw_goal_tolerance": 0.1}
    simulation, log = backwards(simulate, walls, variant, (3.0, 0.0, 0.5), **tolerance)
    assert (log.outcome, log.contacts) == (Outcome.SUCCEEDED, 0)
    assert abs(simulation.pose.yaw - 0.5) < 0.15
    moving = [(pose, command) for (_, pose, _), (_, command) in zip(log.states, log.commands, strict=True) if command.x]
    assert all(-0.3 - 1e-9 <= command.x < 0.0 for _, command in moving)
    assert all(abs(wrap(pose.yaw - math.pi)) < 1.2 for pose, _ in moving)


def test_obstacle_behind_a_robot_that_drives_backwards_is_seen_and_driven_round(simulate, walls, variant):
    _, log = backwards(simulate, walls, variant, (3.0, 0.0, 0.0), hidden=[(0.0, 0.1, 0.3, 0.3, 0.0)])
    assert (log.outcome, log.contacts) == (Outcome.SUCCEEDED, 0)


def test_silent_rear_laser_stops_the_robot(simulate, walls, variant):
    simulation = simulate(walls(), start=(-3.0, 0.0, 3.0), tree=variant(0.3, 0.5, "rear_scan"))
    simulation.silent_from = simulation.time + 4.0
    simulation.run(0.3)
    simulation.navigator.set_goal(Pose(3.0, 0.0, 0.0), simulation.time)
    log = simulation.run(60.0)
    assert log.text == "no current data from rear/scan for 15.0 s"


def test_robot_that_drives_backwards_backs_off_ahead(simulate, walls, variant):
    tree = variant(0.3, 0.5, "rear_scan", TrajectoryPlannerROS__holonomic_robot=False)
    simulation = simulate([*walls(), (-0.7, 0.0, 0.2, 6.0, 0.0)], tree=tree)
    simulation.run(0.3)
    robot = Pose.from_matrix(simulation.lookup("odom", "base_link", None))
    path = robot.apply(np.array([[-0.1 * step, 0.0] for step in range(30)]))
    controller, snapshot = simulation.navigator._controller, simulation.navigator.local_snapshot
    assert controller.follow(robot, Velocity(), path, 3.0, snapshot).velocity == Velocity(0.1, 0.0, 0.0)


def test_direction_may_change_while_the_node_runs(simulate, walls, variant):
    simulation = simulate(walls(), start=(-3.0, 0.0, 0.0), tree=variant(0.3, 0.5))
    simulation.run(0.3)
    simulation.navigator.set_goal(Pose(3.0, 0.0, 0.0), simulation.time)
    simulation.run(20.0, until=lambda one: one.velocity.x > 0.25)
    p = simulation.navigator.parameters
    simulation.navigator.reconfigure(replace(p, controller=replace(p.controller, max_vel_x=-0.1, min_vel_x=-0.3)))
    log = simulation.run(60.0)
    assert log.outcome is Outcome.SUCCEEDED
    assert min(command.x for _, command in log.commands) == pytest.approx(-0.3)
