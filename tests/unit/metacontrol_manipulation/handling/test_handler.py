"""Motions that are planned for an arm among what is around it."""

import numpy as np
import pytest
from arm_motion import kinematics
from arm_motion.grasping import top_down
from metacontrol_manipulation.handling.deeds import Move
from metacontrol_manipulation.handling.handler import Handler
from metacontrol_manipulation.pick_place.progress import Progress
from metacontrol_manipulation.pick_place.pyramid import TABLE_HEIGHT
from pybullet_simulator.robot.manipulator import ARMS, HOME
from robot_formulas.geometry import Pose

CELL = Pose(-HOME.x, 0.0)
LEFT, RIGHT = ARMS


@pytest.fixture
def handler():
    handler = Handler(ARMS)
    yield handler
    handler.close()


def over_table(height):
    """Return the left arm's posture with the hand downwards at a height above the table, m."""
    place = (0.5, 0.0, TABLE_HEIGHT - LEFT.z + height)
    return kinematics.inverse(place, top_down(0.0), LEFT.home)[0]


def test_hand_among_the_blocks_rises_straight(handler):
    start = over_table(0.05)
    (move,) = handler.rise("left", {"left": start, "right": RIGHT.home}, CELL, Progress())
    assert isinstance(move, Move)
    places = np.array([kinematics.forward(posture)[0] for posture in move.trajectory.positions])
    assert np.ptp(places[:, :2], axis=0) == pytest.approx([0.0, 0.0], abs=0.002)
    assert places[-1, 2] - places[0, 2] == pytest.approx(0.10, abs=0.002)


def test_hand_above_the_blocks_or_at_home_stays(handler):
    assert handler.rise("left", {"left": over_table(0.35), "right": RIGHT.home}, CELL, Progress()) == []
    assert handler.rise("left", {"left": LEFT.home, "right": RIGHT.home}, CELL, Progress()) == []
