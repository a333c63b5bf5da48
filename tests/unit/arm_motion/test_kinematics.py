"""Poses and postures: forward and inverse kinematics belong together, and to the model in pybullet_data."""

import numpy as np
import pybullet
import pytest
from arm_motion.kinematics import UPRIGHT, forward, inverse, matrix_of, quaternion_of
from arm_motion.panda import HOME, JOINTS, LOWER, TCP_LINK, UPPER, URDF
from hypothesis import given
from hypothesis import strategies as st

postures = st.lists(st.floats(0.0, 1.0), min_size=JOINTS, max_size=JOINTS).map(
    lambda shares: LOWER + np.array(shares) * (UPPER - LOWER)
)


@pytest.fixture(scope="module")
def arm():
    client = pybullet.connect(pybullet.DIRECT)
    yield client, pybullet.loadURDF(URDF, useFixedBase=True, physicsClientId=client)
    pybullet.disconnect(client)


def turn_between(first, second):
    """Return the angle between two orientations."""
    return 2.0 * np.arcsin(min(1.0, min(np.linalg.norm(first - second), np.linalg.norm(first + second)) / 2.0))


@given(joints=postures)
def test_forward_is_the_pose_of_the_model_in_pybullet_data(arm, joints):
    client, body = arm
    for joint in range(JOINTS):
        pybullet.resetJointState(body, joint, joints[joint], physicsClientId=client)
    state = pybullet.getLinkState(body, TCP_LINK, computeForwardKinematics=True, physicsClientId=client)
    position, quaternion = forward(joints)
    assert np.allclose(position, state[4], atol=1e-5)
    assert turn_between(quaternion, np.array(state[5])) < 1e-3


@given(joints=postures, near=postures)
def test_every_posture_found_reaches_the_pose_within_the_limits(joints, near):
    position, quaternion = forward(joints)
    for found in inverse(position, quaternion, near)[:20]:
        reached, turned = forward(found)
        assert np.linalg.norm(reached - position) < 1e-3
        assert turn_between(turned, quaternion) < 1e-2
        assert (found >= LOWER).all() and (found <= UPPER).all()


@given(
    joints=postures.map(lambda joints: 0.98 * joints + 0.02 * HOME).filter(lambda q: q[3] < -0.5 and abs(q[1]) > 0.01)
)
def test_a_bent_arm_finds_its_own_posture(joints):
    assert np.allclose(inverse(*forward(joints), joints)[0], joints, atol=1e-4)


@given(near=postures, joints=postures)
def test_nearest_postures_come_first(near, joints):
    found = inverse(*forward(joints), near)
    distances = np.linalg.norm(found[np.abs(found[:, 1]) > UPRIGHT] - near, axis=1)
    assert (np.diff(distances) >= 0.0).all()


def test_pose_of_the_present_posture_gives_that_posture():
    assert np.allclose(inverse(*forward(HOME), HOME)[0], HOME)


@pytest.mark.parametrize("position", [(2.0, 0.0, 0.2), (0.0, 0.0, 0.333), (0.9, 0.0, -0.5)])
def test_pose_out_of_reach_has_no_posture(position):
    assert inverse(position, (1.0, 0.0, 0.0, 0.0), HOME).shape == (0, JOINTS)


@given(numbers=st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternion_of_its_matrix_is_the_same_orientation(numbers):
    quaternion = np.array(numbers) / np.linalg.norm(numbers)
    assert turn_between(quaternion_of(matrix_of(np.array(numbers))), quaternion) < 1e-6
