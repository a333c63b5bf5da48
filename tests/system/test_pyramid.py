"""The pyramid is built without ROS, by physics and a depth image; whoever takes over goes on with the work."""

import pytest
from helpers.cell_robot import CellRobot, errors
from metacontrol_manipulation.handling.handler import Handler
from metacontrol_manipulation.pick_place.actions import Done, Pick, Place, Stuck
from metacontrol_manipulation.pick_place.building import Building
from metacontrol_manipulation.pick_place.next_step import BOTH_ARMS, one_arm
from metacontrol_manipulation.pick_place.pyramid import SLOTS
from pybullet_simulator.robot.manipulator import ARMS

IN_PLACE = 0.01
"""m within which each block must be in its slot."""


@pytest.fixture
def robot():
    robot = CellRobot(seed=3)
    yield robot
    robot.close()


@pytest.fixture
def handler():
    handler = Handler(ARMS)
    yield handler
    handler.close()


def test_other_arm_and_the_base_go_on_when_an_arm_is_blocked(robot, handler):
    walls = []

    def block_the_left_arm(action):
        if isinstance(action, Place) and action.arm == "left" and not walls:
            walls.append("wall")
            robot.simulation.spawn("wall", (-0.25, 0.16, 0.70), (0.3, 0.02, 0.6))

    first = Building(robot, handler, BOTH_ARMS, block_the_left_arm).run(lambda: not robot.blocked)
    assert first is None
    assert robot.blocked == {"left"}
    robot.simulation.delete("wall")
    second = []
    ending = Building(robot, handler, one_arm("right"), second.append).run()
    assert isinstance(ending, Done), ending
    assert all(action.arm == "right" for action in second if isinstance(action, Pick | Place))
    for _ in range(1000):  # it stands still for 5 s
        robot.step()
    assert max(errors(robot.simulation, SLOTS).values()) < IN_PLACE


def test_without_a_working_arm_it_says_why(robot, handler):
    robot.blocked = {"left", "right"}
    ending = Building(robot, handler, BOTH_ARMS, lambda action: None).run()
    assert isinstance(ending, Stuck)
    assert "the left and the right arm is stopped" in ending.reason


def test_both_arms_wait_for_one_that_is_stopped_for_a_while(robot, handler):
    robot.blocked = {"left"}
    stopped_until, done = robot.simulation.time + 5.0, []

    def step():
        CellRobot.step(robot)
        if robot.simulation.time > stopped_until:
            robot.blocked = set()

    robot.step = step
    building = Building(robot, handler, BOTH_ARMS, lambda action: done.append((robot.simulation.time, action)))
    building.run(lambda: not done)
    assert done[0][0] > stopped_until
    assert isinstance(done[0][1], Pick)
