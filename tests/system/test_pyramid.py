"""The pyramid is built without ROS, by physics and a depth image; whoever takes over goes on with the work."""

import math

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


def test_both_arms_are_at_work_at_the_same_time_and_do_not_meet(robot, handler):
    forces = []

    def step():
        CellRobot.step(robot)
        forces.append(max(arm.contact_force for arm in robot.simulation.arms.values()))

    robot.step, began = step, robot.simulation.time
    done = []
    ending = Building(robot, handler, BOTH_ARMS, done.append).run()
    assert isinstance(ending, Done), ending
    assert robot.most_at_once == 2
    assert sum(isinstance(action, Pick | Place) for action in done) == 2 * len(SLOTS), "something was done twice"
    assert robot.simulation.time - began < 60.0, "one arm after the other takes 68 to 77 s"
    assert max(forces) < 15.0
    assert max(errors(robot.simulation, SLOTS).values()) < IN_PLACE


class KilledError(Exception):
    """The program is killed."""


def test_hand_that_holds_a_block_in_its_slot_lets_go_of_it_when_another_program_takes_over(robot, handler):
    placing = []

    def step():
        CellRobot.step(robot)
        for action in placing:
            hand = handler.hand(action.arm, robot.joints[action.arm], robot.cell)
            if action.arm in robot.held and math.dist(hand, action.slot.position) < 0.004:
                raise KilledError

    def note(action):
        if isinstance(action, Place):
            placing.append(action)

    robot.step = step
    with pytest.raises(KilledError):
        Building(robot, handler, BOTH_ARMS, note).run()
    robot.step = lambda: CellRobot.step(robot)
    assert placing[0].arm in robot.held
    done = []
    ending = Building(robot, handler, BOTH_ARMS, done.append).run()
    assert isinstance(ending, Done), ending
    assert placing[0].slot not in {action.slot for action in done if isinstance(action, Place)}, (
        "the block was put there again"
    )
    assert max(errors(robot.simulation, SLOTS).values()) < IN_PLACE


def test_arms_that_hide_where_the_cell_is_go_out_of_the_way(robot, handler):
    building = Building(robot, handler, BOTH_ARMS, lambda action: None)
    building.look(clear=True)
    for arm, side in (("left", 1.0), ("right", -1.0)):
        nearest = min((block for block in building.progress.blocks if side * block.y > 0.0), key=lambda one: abs(one.y))
        above = handler.deeds(Pick(arm, nearest), robot.joints, robot.cell, building.progress)[:2]
        assert robot.do(arm, above)
    robot.blocked, robot.needs_tags = {"right"}, True
    assert not robot.sees_cell()
    ending = Building(robot, handler, one_arm("left"), lambda action: None).run()
    assert isinstance(ending, Done), ending
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
