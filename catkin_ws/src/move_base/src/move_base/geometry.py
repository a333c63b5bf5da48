"""Poses and rigid transforms in the plane.

Frames are named by the caller; lengths are in metres and angles in radians, counter-clockwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def wrap_angle(angle: float) -> float:
    """Returns the angle in (-pi, pi] that is the same direction as `angle`."""
    return math.atan2(math.sin(angle), math.cos(angle))


@dataclass(frozen=True)
class Pose:
    """A pose in the plane.

    Attributes:
        x: metres.
        y: metres.
        yaw: radians.
    """

    x: float
    y: float
    yaw: float

    @classmethod
    def from_matrix(cls, matrix: NDArray[np.float64]) -> Pose:
        """Projects a homogeneous 4 x 4 transform on the plane."""
        return cls(float(matrix[0, 3]), float(matrix[1, 3]), math.atan2(matrix[1, 0], matrix[0, 0]))

    def compose(self, other: Pose) -> Pose:
        """Returns `other`, given in the frame of this pose, in this pose's parent frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(
            self.x + cos * other.x - sin * other.y,
            self.y + sin * other.x + cos * other.y,
            wrap_angle(self.yaw + other.yaw),
        )

    def inverse(self) -> Pose:
        """Returns the pose of the parent frame in the frame of this pose."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, -self.yaw)

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Maps points (N, 2) from the frame of this pose to its parent frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return points @ np.array([[cos, sin], [-sin, cos]]) + (self.x, self.y)

    def distance(self, other: Pose) -> float:
        """Returns the Euclidean distance to `other` in metres."""
        return math.hypot(self.x - other.x, self.y - other.y)


@dataclass(frozen=True)
class Velocity:
    """A velocity of the base in its own frame.

    Attributes:
        x: forward, m/s.
        y: to the left, m/s.
        yaw: rad/s.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


STOP = Velocity()


def planar_matrix(pose: Pose, z: float = 0.0) -> NDArray[np.float64]:
    """Returns the homogeneous 4 x 4 transform of a pose at height `z` (m)."""
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    return np.array([[cos, -sin, 0.0, pose.x], [sin, cos, 0.0, pose.y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]])


def inscribed_radius(corners: NDArray[np.float64]) -> float:
    """Returns the distance from the origin to the nearest edge of a polygon (N, 2)."""
    ends = np.roll(corners, -1, axis=0)
    edges = ends - corners
    along = np.clip(-(corners * edges).sum(1) / np.maximum((edges**2).sum(1), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(corners + along[:, None] * edges).T).min())
