"""Blocks are gripped by friction, carried and put down, by scripted motions of the joints."""

import math

import numpy as np
import pybullet
import pytest
from helpers.cell_hand import ACROSS, READY, Hand, Kinematics
from pybullet_simulator.physics.cell_simulation import STEP, CellSimulation
from pybullet_simulator.world.cell import BLOCK_MASS, BLOCK_SIZE, TABLE_TOP
from robot_formulas.geometry import quaternion_of

LAYER = BLOCK_SIZE[2]
FLOOR_LAYER = TABLE_TOP + LAYER / 2.0
PYRAMID = (
    *((-0.20, y, FLOOR_LAYER) for y in (-0.056, 0.0, 0.056)),
    *((-0.20, y, FLOOR_LAYER + LAYER) for y in (-0.028, 0.028)),
    (-0.20, 0.0, FLOOR_LAYER + 2.0 * LAYER),
)
NORMAL = 10.0
"""N; what handling blocks takes at most."""


@pytest.fixture(scope="module")
def kinematics():
    kinematics = Kinematics()
    yield kinematics
    kinematics.close()


@pytest.fixture
def cell():
    cell = CellSimulation(seed=0)
    yield cell
    cell.close()


@pytest.fixture
def hand(cell, kinematics):
    hand = Hand(cell, "left", kinematics)
    hand.move_joints(READY, speed=2.0)
    return hand


def error(cell, name, place):
    return math.dist(cell.blocks[name][0], place)


def test_three_blocks_are_stacked_within_2_mm(cell, hand):
    for number in range(3):
        place = (-0.20, 0.05, FLOOR_LAYER + number * LAYER)
        hand.pick(f"block_{number + 1}")
        assert hand.arm.is_holding
        assert cell.blocks[f"block_{number + 1}"][0][2] > TABLE_TOP + 0.1
        hand.put(place)
        assert not hand.arm.is_holding
    hand.wait(1.0)
    for number in range(3):
        assert error(cell, f"block_{number + 1}", (-0.20, 0.05, FLOOR_LAYER + number * LAYER)) < 0.002
    assert max(hand.forces) < NORMAL


def test_block_that_was_turned_is_let_go_of_where_it_stands(cell, hand):
    hand.pick("block_1")
    place = np.array((-0.20, 0.05, FLOOR_LAYER))
    hand.move_over(place + np.array((0.0, 0.0, 0.08)), ACROSS)
    hand.move_straight(place)
    hand.wait(0.2)
    before = np.array(cell.blocks["block_1"][0])
    hand.arm.command_gripper(0.064, 20.0)
    cell.step()
    normals = np.array([point[7] for point in pybullet.getContactPoints(cell._robot, physicsClientId=cell.client)])
    assert len(normals)
    assert np.abs(normals[:, 0]) == pytest.approx(1.0, abs=0.02), "a finger presses aside, and takes the block along"
    hand.wait(0.5)
    assert cell.blocks["block_1"][0] == pytest.approx(before, abs=0.001)


def test_block_stays_in_the_hand_while_the_base_drives_sideways(cell, hand):
    hand.pick("block_1")
    before = np.array(cell.blocks["block_1"][0]) - (*cell.base_pose[:2], 0.0)
    start = cell.base_pose[1]
    while cell.base_pose[1] > start - 0.5:
        cell.drive(0.0, -0.3, 0.0)
        hand.wait(0.05)
    hand.wait(1.0)
    after = np.array(cell.blocks["block_1"][0]) - (*cell.base_pose[:2], 0.0)
    assert hand.arm.is_holding
    assert after == pytest.approx(before, abs=0.001)
    assert max(hand.forces) < NORMAL


def test_arm_shakes_a_base_at_rest_by_less_than_a_millimetre(cell, hand):
    start = cell.base_pose
    hand.move_joints((1.2, -0.3, 0.0, -1.5, 0.0, 1.571, 0.785), speed=2.0)
    assert cell.base_pose == pytest.approx(start, abs=0.001)


def test_weak_grip_drops_the_block(cell, hand):
    hand.pick("block_1")
    hand.arm.command_gripper(0.0, 0.1)
    hand.wait(1.0)
    assert not hand.arm.is_holding
    assert cell.blocks["block_1"][0][2] < TABLE_TOP + 0.05


def test_obstacle_is_felt_well_above_normal_handling(cell, hand):
    hand.grip(0.0)
    hand.move_over((-0.25, 0.35, 0.55), 0.0)
    cell.spawn("box", (-0.25, 0.15, 0.55), (0.2, 0.1, 0.3))
    hand.wait(0.1)
    assert max(hand.forces) < NORMAL
    hand.move_straight(np.array((-0.25, 0.18, 0.55)))
    assert max(hand.forces) > 5.0 * NORMAL
    cell.delete("box")
    hand.wait(0.5)
    assert hand.arm.contact_force < NORMAL


def test_obstacle_is_felt_through_a_held_block(cell, hand):
    hand.pick("block_1")
    hand.move_over((-0.25, 0.35, 0.55), ACROSS)
    cell.spawn("box", (-0.25, 0.15, 0.465), (0.2, 0.1, 0.13))  # lower than the fingers
    hand.move_straight(np.array((-0.25, 0.21, 0.55)))
    assert max(hand.forces) > 2.0 * NORMAL


def test_pyramid_stands_still(cell):
    rng = np.random.default_rng(3)
    for body, place in zip(cell._bodies.blocks.values(), PYRAMID, strict=True):
        x, y = rng.normal(place[:2], 0.001)
        turn = quaternion_of(rng.normal(0.0, 0.02))
        pybullet.resetBasePositionAndOrientation(body, (x, y, place[2]), (0.0, 0.0, *turn), physicsClientId=cell.client)
    for _ in range(round(0.2 / STEP)):
        cell.step()
    before = np.array([position for position, _ in cell.blocks.values()])
    for _ in range(round(5.0 / STEP)):
        cell.step()
    after = np.array([position for position, _ in cell.blocks.values()])
    assert np.abs(after - before).max() < 0.00005


def test_arm_carries_its_own_weight_and_a_blocks(cell, hand):
    targets = hand.arm.positions.copy()
    hand.pick("block_1")
    hand.wait(0.5)
    shoulder = abs(hand.arm.efforts[1])
    assert 0.0 < shoulder < 87.0
    assert hand.arm.contact_force < BLOCK_MASS * 9.81
    hand.move_joints(targets)
    hand.wait(0.5)
    assert hand.arm.positions == pytest.approx(targets, abs=0.001)
