"""Grasps from above: where the fingers close, and which of several grasps is taken."""

import numpy as np
import pytest
from arm_motion.grasping import APPROACH, grasp, reachable, top_down, yaws
from arm_motion.kinematics import matrix_of
from arm_motion.panda import HOME
from arm_motion.scene import Box, Scene
from hypothesis import given, settings
from hypothesis import strategies as st

TABLE = Box((0.70, -0.30, -0.10), (0.80, 1.60, 0.40))
CUBE = Box((0.0, 0.0, 0.0), (0.05, 0.05, 0.05))


@pytest.fixture(scope="module")
def scene():
    with Scene() as scene:
        yield scene


@given(yaw=st.floats(-10.0, 10.0))
def test_a_hand_from_above_points_down_and_closes_in_the_direction_of_its_yaw(yaw):
    fingers, ahead = matrix_of(np.array(top_down(yaw)))[:, 1:].T
    assert np.allclose(ahead, (0.0, 0.0, -1.0))
    assert np.allclose(fingers, (np.cos(yaw), np.sin(yaw), 0.0))


@given(yaw=st.floats(-10.0, 10.0), along=st.floats(-10.0, 10.0))
def test_two_of_four_grasps_are_along_a_direction(yaw, along):
    assert len(yaws(yaw)) == 4
    near = yaws(yaw, along)
    assert len(near) in (2, 4)  # all four at 45 degrees
    assert all(abs(np.cos(one - along)) > 0.69 for one in near)
    assert all(abs(np.sin(2.0 * (one - yaw))) < 1e-6 for one in near)


@settings(max_examples=25, deadline=None)
@given(x=st.floats(0.38, 0.60), y=st.floats(-0.05, 0.30), yaw=st.floats(-3.2, 3.2))
def test_every_cube_of_the_arms_side_is_grasped_from_above(scene, x, y, yaw):
    scene.set([TABLE], ((0.0, -0.6, 0.0), HOME))
    taken = grasp(scene, (x, y, 0.125), yaw, HOME)
    assert taken is not None
    assert np.allclose(scene.forward(taken.above)[0], (x, y, 0.125 + APPROACH), atol=1e-3)
    assert np.allclose(scene.forward(taken.joints)[0], (x, y, 0.125), atol=1e-3)
    assert abs(np.sin(2.0 * (taken.yaw - yaw))) < 1e-6
    assert all(scene.is_free(joints) for joints in taken.down)


def test_the_grasp_nearest_to_the_present_posture_is_taken(scene):
    scene.set([TABLE])
    first = grasp(scene, (0.5, 0.1, 0.125), 0.2, HOME)
    for yaw in yaws(0.2):
        other = grasp(scene, (0.5, 0.1, 0.125), yaw, HOME, along=yaw)
        assert np.linalg.norm(other.above - HOME) >= np.linalg.norm(first.above - HOME) - 1e-9


def test_a_cube_beside_another_is_grasped_where_the_fingers_have_room(scene):
    scene.set([TABLE, Box((0.5, 0.156, 0.125), (0.05, 0.05, 0.05)), Box((0.5, 0.044, 0.125), (0.05, 0.05, 0.05))])
    taken = grasp(scene, (0.5, 0.1, 0.125), 0.0, HOME)
    assert abs(np.cos(taken.yaw)) == pytest.approx(1.0)
    assert grasp(scene, (0.5, 0.1, 0.125), 0.0, HOME, along=np.pi / 2.0) is None


def test_a_cube_is_put_between_two_others(scene):
    scene.set([TABLE, Box((0.5, -0.244, 0.125), (0.05, 0.05, 0.05)), Box((0.5, -0.356, 0.125), (0.05, 0.05, 0.05))])
    assert grasp(scene, (0.5, -0.3, 0.127), 0.0, HOME, along=0.0, held=CUBE) is not None
    assert grasp(scene, (0.5, -0.29, 0.127), 0.0, HOME, along=0.0, held=CUBE) is None


def test_a_covered_cube_is_not_grasped(scene):
    scene.set([TABLE, Box((0.5, 0.1, 0.21), (0.2, 0.2, 0.05))])
    assert grasp(scene, (0.5, 0.1, 0.125), 0.0, HOME) is None


@pytest.mark.parametrize(("place", "expected"), [((0.5, 0.1), True), ((0.55, -0.2), True), ((1.0, 0.0), False)])
def test_what_is_near_is_reachable(scene, place, expected):
    scene.set([TABLE])
    assert reachable(scene, *place, 0.125) is expected
