"""Motions that are planned for an arm among what is around it."""

import numpy as np
import pytest
from arm_motion import kinematics
from arm_motion.grasping import top_down
from arm_motion.scene import Scene
from metacontrol_manipulation.handling.deeds import HandlingError, Move
from metacontrol_manipulation.handling.handler import Handler
from metacontrol_manipulation.perception.blocks import Block
from metacontrol_manipulation.pick_place.actions import Pick, Place
from metacontrol_manipulation.pick_place.progress import Progress
from metacontrol_manipulation.pick_place.pyramid import SIDE, SLOTS, TABLE_HEIGHT
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


AT_HOME = {"left": LEFT.home, "right": RIGHT.home}


def lying(x, y):
    return Block(x, y, TABLE_HEIGHT + SIDE / 2.0, 0.0)


def postures(deeds):
    return [posture for deed in deeds if isinstance(deed, Move) for posture in deed.trajectory.positions[::10]]


def test_an_arm_keeps_out_of_the_way_of_the_other_one(handler):
    left = handler.deeds(Pick("left", lying(-0.20, 0.05)), AT_HOME, CELL, Progress())
    right = Pick("right", lying(-0.20, -0.05))
    assert handler.deeds(right, AT_HOME, CELL, Progress()), "nothing is in its way while the left arm is at home"
    with pytest.raises(HandlingError):
        handler.deeds(right, AT_HOME, CELL, Progress(), left)
    aside = handler.deeds(Pick("right", lying(-0.20, -0.40)), AT_HOME, CELL, Progress(), left)
    with Scene() as scene:
        for other in postures(aside):
            scene.set(other_arm=((0.0, RIGHT.y - LEFT.y, 0.0), other))
            assert all(scene.is_free(posture) for posture in postures(left)), "the arms meet somewhere"


def test_an_arm_that_has_put_a_block_goes_home(handler):
    holding = {**AT_HOME, "left": over_table(0.35)}
    deeds = handler.place_and_leave(Place("left", SLOTS[0]), holding, CELL, Progress())
    moves = [deed for deed in deeds if isinstance(deed, Move)]
    assert not handler.is_away("left", moves[-1].trajectory.positions[-1])
    assert min(kinematics.forward(posture)[0][2] + LEFT.z for posture in moves[-1].trajectory.positions) > (
        SLOTS[0].position[2] + SIDE
    ), "it goes through the block that it has put"


def test_hand_is_told_in_the_cell(handler):
    x, y, z = handler.hand("left", over_table(0.2), CELL)
    assert (x, y, z) == pytest.approx((HOME.x + LEFT.x + 0.5, LEFT.y, TABLE_HEIGHT + 0.2), abs=1e-6)
