"""What is around an arm is where it is for the robot, wherever the robot stands."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_manipulation.handling.surroundings import BlockPose, Surroundings
from pybullet_simulator.robot.manipulator import ARMS, HOME
from robot_formulas.geometry import Pose

LEFT, RIGHT = ARMS
AT_HOME = HOME.inverse()


def test_place_at_home_is_seen_from_the_arm():
    position, yaw = Surroundings(LEFT, AT_HOME).in_arm(BlockPose(-0.2, 0.3, 0.425, 0.5))
    assert position == pytest.approx((0.5, 0.0, 0.125))
    assert yaw == pytest.approx(0.5)


@given(st.floats(-1.5, -0.8), st.floats(-0.6, 0.6), st.floats(-0.5, 0.5), st.floats(-0.4, 0.0), st.floats(-0.7, 0.7))
def test_both_arms_mean_the_same_place(x, y, turn, place_x, place_y):
    cell = Pose(x, y, turn).inverse()
    place = BlockPose(place_x, place_y, 0.425)
    (one, _), (other, _) = (Surroundings(mount, cell).in_arm(place) for mount in ARMS)
    assert one[0] + LEFT.x == pytest.approx(other[0] + RIGHT.x)
    assert one[1] + LEFT.y == pytest.approx(other[1] + RIGHT.y)
    back = Pose(x, y, turn) @ Pose(one[0] + LEFT.x, one[1] + LEFT.y)
    assert (back.x, back.y) == pytest.approx((place_x, place_y))


def test_boxes_are_table_body_mast_and_the_known_blocks():
    around = Surroundings(RIGHT, AT_HOME)
    boxes = around.boxes([BlockPose(-0.2, 0.0, 0.425)])
    table, body, mast, block = boxes
    assert table.position[2] + table.size[2] / 2.0 == pytest.approx(0.40 - RIGHT.z)
    assert body.position[2] + body.size[2] / 2.0 < 0.0  # the arm stands on it
    assert mast.position[1] == pytest.approx(0.30)  # to the left of the right arm
    assert block.size[0] < 0.05


def test_other_arm_stands_where_it_is_mounted():
    offset, joints = Surroundings(LEFT, AT_HOME).other_arm(RIGHT, [0.0] * 7)
    assert offset == pytest.approx((0.0, -0.6, 0.0))
    assert joints == [0.0] * 7


def test_fingers_close_along_the_cell_when_the_robot_has_turned():
    assert Surroundings(LEFT, Pose(-0.95, 0.0, 0.1).inverse()).along == pytest.approx(-0.1)
    assert math.isclose(Surroundings(LEFT, AT_HOME).along, 0.0)
