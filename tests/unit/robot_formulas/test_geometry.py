"""Poses agree with the matrices and quaternions that they are converted to."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robot_formulas.geometry import ORIGIN, Pose, inscribed_radius, quaternion_of, transform_of, wrap, yaw_of

lengths = st.floats(-100.0, 100.0)
angles = st.floats(-math.pi, math.pi)
poses = st.builds(Pose, lengths, lengths, angles)


def same(one: Pose, other: Pose) -> bool:
    """Tell whether two poses are equal but for rounding; -pi and pi are one direction."""
    return one.distance(other) < 1e-9 and abs(wrap(one.yaw - other.yaw)) < 1e-9


@given(poses, poses)
def test_product_of_poses_is_that_of_their_matrices(one, other):
    assert same(one @ other, Pose.from_matrix(one.matrix() @ other.matrix()))


@given(poses)
def test_pose_and_its_inverse_cancel(pose):
    assert same(pose @ pose.inverse(), ORIGIN)
    assert same(pose.inverse() @ pose, ORIGIN)


@given(poses, lengths, lengths)
def test_points_are_placed_as_poses_are(pose, x, y):
    placed = pose @ Pose(x, y)
    assert pose.apply(np.array([[x, y]]))[0] == pytest.approx([placed.x, placed.y], abs=1e-9)


@given(st.floats(-1e3, 1e3))
def test_wrapped_angle_is_the_same_direction(angle):
    assert abs(wrap(angle)) <= math.pi
    assert (math.cos(wrap(angle)), math.sin(wrap(angle))) == pytest.approx((math.cos(angle), math.sin(angle)), abs=1e-9)


@given(angles)
def test_angle_in_range_is_kept_exactly(angle):
    assert abs(wrap(angle)) == abs(angle)


@given(poses, lengths)
def test_quaternion_of_a_yaw_turns_as_the_pose_does(pose, z):
    turn = quaternion_of(pose.yaw)
    assert abs(wrap(yaw_of(*turn) - pose.yaw)) < 1e-9
    assert transform_of((pose.x, pose.y, z), (0.0, 0.0, *turn)) == pytest.approx(pose.matrix(z), abs=1e-9)


def test_transform_turns_about_any_axis():
    half = math.sqrt(0.5)
    about_x = transform_of((0.0, 0.0, 1.0), (half, 0.0, 0.0, half))  # a quarter turn: y becomes z
    assert about_x @ (0.0, 1.0, 0.0, 1.0) == pytest.approx([0.0, 0.0, 2.0, 1.0])


def test_inscribed_radius_is_the_distance_to_the_nearest_edge():
    corners = np.array([[0.5, 0.3], [-0.5, 0.3], [-0.5, -0.3], [0.5, -0.3]])
    assert inscribed_radius(corners) == pytest.approx(0.3)
