"""Forward and inverse kinematics of the Panda in closed form.

Seven joints reach a pose of six dimensions in infinitely many ways. If the last joint's angle is fixed, at most four
ways are left, and they follow from triangles (He and Liu 2021, "Analytical inverse kinematics for Franka Emika Panda").
So all postures of a pose are found by a scan of the last joint: nothing is iterated, no posture is missed because of a
bad first guess, and the result is exact.

PyBullet's own solver is no substitute: of 300 poses of a hand downwards over a table, it reached 227 within 1 mm and
the joint limits in up to four attempts; the closed form reaches all 300 (decision 35).

Poses are those of the tool centre point (TCP, panda_grasptarget between the fingertips) in the arm's base frame
(link0). Lengths are in m, angles in rad, quaternions are (x, y, z, w).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from arm_motion.panda import LOWER, UPPER

if TYPE_CHECKING:
    from arm_motion.vectors import Array, Vector

UPRIGHT = 0.1
"""rad of joint 2; less is an upright upper arm."""

_SHOULDER_HEIGHT = 0.333
_UPPER_ARM, _FOREARM, _ELBOW = 0.316, 0.384, 0.0825  # the elbow's axis is beside both
_WRIST = 0.088
_TOOL = 0.107 + 0.105  # from joint 7 to the hand, from there to the TCP
_TO_TCP = np.array([0.0, 0.0, _TOOL])
_HAND = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0**0.5]]) / 2.0**0.5  # 45 deg backwards about z

_SHOULDER_TO_ELBOW = np.hypot(_UPPER_ARM, _ELBOW)
_ELBOW_TO_WRIST = np.hypot(_FOREARM, _ELBOW)
_UPPER_ANGLE = np.arctan2(_UPPER_ARM, _ELBOW)
_FORE_ANGLE = np.arctan2(_FOREARM, _ELBOW)

_QUARTER = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # a quarter turn about x
_BACK = _QUARTER.T
_JOINTS = (
    (np.eye(3), (0.0, 0.0, _SHOULDER_HEIGHT)),
    (_BACK, (0.0, 0.0, 0.0)),
    (_QUARTER, (0.0, -_UPPER_ARM, 0.0)),
    (_QUARTER, (_ELBOW, 0.0, 0.0)),
    (_BACK, (-_ELBOW, _FOREARM, 0.0)),
    (_QUARTER, (0.0, 0.0, 0.0)),
    (_QUARTER, (_WRIST, 0.0, 0.0)),
)
"""Orientation and position of each joint in the frame of the link before it, as in panda.urdf."""

_STEP = 0.05  # rad, between the angles of joint 7 that are scanned
_ROUNDING = 1e-6  # rad


def forward(joints: Vector) -> tuple[Array, Array]:
    """Return position and quaternion of the TCP."""
    rotation, position = np.eye(3), np.zeros(3)
    for turn, (orientation, offset) in zip(_turn(np.asarray(joints, float)), _JOINTS, strict=True):
        position = position + rotation @ offset
        rotation = rotation @ orientation @ turn
    return position + rotation @ _TO_TCP, quaternion_of(rotation @ _HAND)


def inverse(position: Vector, quaternion: Vector, near: Vector) -> Array:
    """Return the postures of a pose, those nearest to the posture `near` first.

    Joint 7 is scanned in steps of 0.05 rad from its angle in `near`. All limits of joints are kept. Where the upper arm
    is upright, joints 1 and 3 have the same axis, and the arm hardly moves on from there: such a posture counts as
    twice as far.

    Returns:
        joints (n, 7); none if the pose is out of reach.
    """
    last = near[6] + _STEP * np.arange(np.ceil((LOWER[6] - near[6]) / _STEP), (UPPER[6] - near[6]) / _STEP)
    found = postures(np.asarray(position)[None], np.asarray(quaternion)[None], last).reshape(-1, 7)
    found = found[~np.isnan(found[:, 0])]
    distances = np.linalg.norm(found - np.asarray(near), axis=1) * np.where(np.abs(found[:, 1]) < UPRIGHT, 2.0, 1.0)
    return found[np.argsort(distances, kind="stable")]


def postures(positions: Array, quaternions: Array, last: Array) -> Array:
    """Return the four postures of each pose for each angle of joint 7.

    Args:
        positions: (n, 3), or (1, 3) for all angles.
        quaternions: (n, 4), or (1, 4) for all angles.
        last: (n,), angles of joint 7.

    Returns:
        joints (n, 4, 7); NaN where there is no such posture within the limits of the joints. The four are in the same
        order for poses and angles that are close to each other.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        joints = _postures(np.asarray(positions, float), np.asarray(quaternions, float), np.asarray(last, float))
        joints[..., 5] = np.where(joints[..., 5] < LOWER[5] - _ROUNDING, joints[..., 5] + 2.0 * np.pi, joints[..., 5])
        inside = ((joints >= LOWER - _ROUNDING) & (joints <= UPPER + _ROUNDING)).all(-1, keepdims=True)
    return np.where(inside, np.clip(joints, LOWER, UPPER), np.nan)


def _postures(positions: Array, quaternions: Array, last: Array) -> Array:
    flange = matrix_of(quaternions) @ _HAND.T @ _turn(-last)  # frame of joint 7 before it turns
    x6, y6 = flange[:, :, 0], -flange[:, :, 2]
    wrist = positions - _TOOL * flange[:, :, 2] - _WRIST * x6
    to_shoulder = (0.0, 0.0, _SHOULDER_HEIGHT) - wrist
    distance = np.linalg.norm(to_shoulder, axis=1)
    elbow = _angle(_SHOULDER_TO_ELBOW, _ELBOW_TO_WRIST, distance)
    q4 = elbow + _UPPER_ANGLE + _FORE_ANGLE - 2.0 * np.pi
    at_wrist = (np.pi / 2.0 - _FORE_ANGLE) + _angle(_ELBOW_TO_WRIST, distance, _SHOULDER_TO_ELBOW)
    along, across = (to_shoulder * x6).sum(1), (to_shoulder * y6).sum(1)
    middle = np.arctan2(along, across)
    half = _arccos(-distance * np.cos(at_wrist) / np.hypot(along, across))
    frame6 = np.stack([x6, y6, np.cross(x6, y6)], axis=-1)
    found = []
    for q6 in (middle + half, middle - half):
        frame5 = frame6 @ (_QUARTER @ _turn(q6)).swapaxes(-1, -2)  # after joint 5
        forearm = frame5[:, :, 2]
        x4 = to_shoulder - (to_shoulder * forearm).sum(1)[:, None] * forearm
        x4 = x4 / np.linalg.norm(x4, axis=1)[:, None]
        frame4 = np.stack([x4, forearm, np.cross(x4, forearm)], axis=-1)
        turned = (frame4 @ _BACK).swapaxes(-1, -2) @ frame5
        q5 = np.arctan2(turned[:, 1, 0], turned[:, 0, 0])
        frame3 = frame4 @ (_QUARTER @ _turn(q4)).swapaxes(-1, -2)
        tilt = np.arccos(np.clip(frame3[:, 2, 2], -1.0, 1.0))
        for sign in (1.0, -1.0):
            q1 = np.arctan2(sign * frame3[:, 1, 2], sign * frame3[:, 0, 2])
            cos, sin = np.cos(q1), np.sin(q1)  # q3 follows from q1, which is arbitrary where the upper arm is upright
            q3 = np.arctan2(
                cos * frame3[:, 1, 0] - sin * frame3[:, 0, 0], cos * frame3[:, 1, 1] - sin * frame3[:, 0, 1]
            )
            found.append(
                np.stack([q1, sign * tilt, q3, q4, q5, _wrapped(q6), np.broadcast_to(last, q4.shape)], axis=-1)
            )
    return np.stack(found, axis=1)


def matrix_of(quaternion: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of quaternions (..., 4), which need not have the length 1."""
    x, y, z, w = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def quaternion_of(matrix: Array) -> Array:
    """Return the quaternion of a rotation matrix; the largest of its numbers is positive."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    squares = np.array([1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i, 1.0 + a + e + i])
    largest = int(squares.argmax())
    rows = (
        (squares[0], b + d, c + g, h - f),
        (b + d, squares[1], f + h, c - g),
        (c + g, f + h, squares[2], d - b),
        (h - f, c - g, d - b, squares[3]),
    )
    return np.array(rows[largest]) / (2.0 * float(squares[largest]) ** 0.5)


def _turn(angles: Array) -> Array:
    """Return the matrices (n, 3, 3) of turns about z."""
    matrices = np.zeros((*angles.shape, 3, 3))
    matrices[..., 0, 0] = matrices[..., 1, 1] = np.cos(angles)
    matrices[..., 1, 0] = np.sin(angles)
    matrices[..., 0, 1] = -matrices[..., 1, 0]
    matrices[..., 2, 2] = 1.0
    return matrices


def _angle(side: Array | float, other: Array | float, opposite: Array | float) -> Array:
    """Return the angle between two sides of a triangle, NaN if there is no such triangle."""
    return _arccos((side**2 + other**2 - opposite**2) / (2.0 * side * other))


def _arccos(cosine: Array | float) -> Array:
    """Return the angle of a cosine, NaN if it is larger than 1 by more than rounding."""
    return np.arccos(np.where(np.abs(cosine) < 1.0 + _ROUNDING**2, np.clip(cosine, -1.0, 1.0), np.nan))


def _wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi
