"""Postures that hit something, and postures that do not."""

from dataclasses import replace

import numpy as np
import pybullet
import pytest
from arm_motion.grasping import top_down
from arm_motion.panda import HOME, LOWER, TCP_LINK, UPPER
from arm_motion.scene import Box, Scene

TABLE = Box((0.70, 0.0, -0.10), (0.80, 1.60, 0.40))
CUBE = Box((0.0, 0.0, 0.0), (0.05, 0.05, 0.05))


@pytest.fixture
def scene():
    with Scene() as scene:
        yield scene


def at(scene, x, y, z, yaw=0.0):
    """Return a posture with the hand downwards at a place."""
    joints = scene.inverse((x, y, z), top_down(yaw), HOME)
    assert joints is not None
    return joints


def test_home_is_free_beside_another_arm_and_a_table():
    with Scene([TABLE], ((0.0, -0.6, 0.0), HOME)) as scene:
        assert scene.is_free(HOME)


def test_the_other_arm_stands_where_it_is_told(scene):
    for offset in ((0.0, 0.6, 0.0), (0.1, -0.6, 0.2)):
        scene.set(other_arm=(offset, HOME))
        place = pybullet.getLinkState(
            scene._other, TCP_LINK, computeForwardKinematics=True, physicsClientId=scene._client
        )[4]
        assert place == pytest.approx(scene.forward(HOME)[0] + np.array(offset), abs=1e-6)


def test_fingers_in_a_box_are_not_free(scene):
    posture = at(scene, 0.5, 0.0, 0.115)
    scene.set([TABLE])
    assert scene.is_free(posture)
    assert not scene.is_free(at(scene, 0.5, 0.0, 0.09))


def test_a_box_within_the_clearance_is_too_near(scene):
    fingertip = scene.forward(HOME)[0] - (0.0, 0.0, 0.0074)  # the fingers reach that far beyond the TCP
    scene.set([Box((float(fingertip[0]), 0.0, float(fingertip[2]) - 0.103), (0.2, 0.2, 0.2))])
    assert not scene.is_free(HOME)
    assert scene.is_free(HOME, clearance=0.001)


def test_a_mast_beside_the_elbow_is_hit(scene):
    scene.set([Box((-0.20, -0.30, 0.75), (0.06, 0.06, 1.5))])
    assert scene.is_free(HOME)
    backwards = HOME.copy()
    backwards[0] = -2.2
    assert not scene.is_free(backwards)


def test_the_other_arm_is_hit_where_it_is_now(scene):
    middle = at(scene, 0.45, -0.30, 0.30)
    scene.set(other_arm=((0.0, -0.6, 0.0), HOME))
    assert scene.is_free(middle)
    mirrored = middle * (-1, 1, -1, 1, -1, 1, -1)
    scene.set(other_arm=((0.0, -0.6, 0.0), mirrored))
    assert not scene.is_free(middle)
    scene.set()
    assert scene.is_free(middle)


def test_a_posture_beyond_a_limit_is_not_free(scene):
    for limit, sign in ((LOWER, -1), (UPPER, 1)):
        beyond = HOME.copy()
        beyond[6] = limit[6] + sign * 0.01
        assert not scene.is_free(beyond)


def test_an_arm_folded_into_its_own_base_is_not_free(scene):
    assert not scene.is_free((0.0, 1.7, 0.0, -3.0, 0.0, 1.6, 0.0))


def test_a_held_box_is_part_of_the_arm(scene):
    scene.set([TABLE])
    posture = at(scene, 0.5, 0.0, 0.12)
    assert scene.is_free(posture)
    assert not scene.is_free(posture, CUBE)
    assert scene.is_free(posture)


def test_a_held_box_may_stand_on_a_table(scene):
    scene.set([TABLE])
    assert scene.is_free(at(scene, 0.5, 0.0, 0.125), CUBE)
    assert not scene.is_free(at(scene, 0.5, 0.0, 0.122), CUBE)


def test_a_held_box_is_where_the_tcp_is(scene):
    pole = Box((0.0, 0.0, 0.15), (0.02, 0.02, 0.2))  # 0.25 m ahead of the fingertips
    scene.set([TABLE])
    assert scene.is_free(at(scene, 0.5, 0.0, 0.36), pole)
    assert not scene.is_free(at(scene, 0.5, 0.0, 0.34), pole)


def test_a_held_box_may_not_hit_the_arm_itself(scene):
    assert scene.is_free(HOME, CUBE)
    assert not scene.is_free(HOME, Box((0.0, 0.0, -0.2), (0.3, 0.3, 0.05)))


def test_free_inverse_takes_a_posture_around_an_obstacle(scene):
    pose = (0.5, 0.1, 0.3), top_down(0.0)
    nearest = scene.inverse(*pose, HOME)
    elbow = Box((0.05, 0.0, 0.75), (0.2, 0.1, 0.1))
    scene.set([elbow])
    assert not scene.is_free(nearest)
    free = scene.free_inverse(*pose, HOME)
    assert free is not None
    assert scene.is_free(free)
    assert np.allclose(scene.forward(free)[0], pose[0], atol=1e-3)


def test_no_posture_is_free_inside_a_box(scene):
    scene.set([Box((0.5, 0.0, 0.3), (0.3, 0.3, 0.3))])
    assert scene.inverse((0.5, 0.0, 0.3), top_down(0.0), HOME) is not None
    assert scene.free_inverse((0.5, 0.0, 0.3), top_down(0.0), HOME) is None


def test_scenes_are_apart(scene):
    with Scene([TABLE]) as other:
        low = at(scene, 0.5, 0.0, 0.05)
        assert scene.is_free(low)
        assert not other.is_free(low)
    assert scene.is_free(low)


def test_a_way_is_swept_from_end_to_end(scene):
    path = np.linspace(at(scene, 0.5, 0.3, 0.2), at(scene, 0.5, -0.3, 0.4), 40)
    boxes = scene.swept(path)
    low = np.array([np.subtract(box.position, np.divide(box.size, 2.0)) for box in boxes])
    high = np.array([np.add(box.position, np.divide(box.size, 2.0)) for box in boxes])
    for posture in path:
        hand = scene.forward(posture)[0]
        assert ((low < hand - 0.02) & (hand + 0.02 < high)).all(axis=1).any(), "what the hand holds is outside"
    scene.set(ways=boxes)
    assert not any(scene.is_free(posture) for posture in path)
    assert not scene.is_free(at(scene, 0.5, 0.0, 0.3), clearance=0.0), "the way between its ends is free"
    scene.set(ways=[replace(box, position=tuple(np.add(box.position, (0.0, -0.9, 0.0)))) for box in boxes])
    assert scene.is_free((1.2, *HOME[1:]))


def test_ways_hit_as_single_boxes_do(scene):
    random = np.random.default_rng(1)
    with Scene() as other:
        for _ in range(20):
            boxes = [
                Box(tuple(random.uniform((-0.8, -0.8, 0.0), 0.8)), tuple(random.uniform(0.05, 0.15, 3)))
                for _ in range(random.integers(1, 40))
            ]
            scene.set(boxes)
            other.set(ways=boxes)
            for posture in HOME + random.normal(0.0, 0.5, (10, 7)):
                assert scene.is_free(posture, CUBE) == other.is_free(posture, CUBE)
    scene.set()
    assert scene.is_free(HOME)
