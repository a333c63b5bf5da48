"""Poses and velocities in the plane, and their conversion from and to matrices and quaternions.

Lengths are in m and angles in rad, counter-clockwise (REP 103). A matrix is a homogeneous 4 x 4 transform.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Pose:
    """A pose in the plane.

    Attributes:
        x: m.
        y: m.
        yaw: rad.
    """

    x: float
    y: float
    yaw: float = 0.0

    @classmethod
    def from_matrix(cls, matrix: NDArray[np.float64]) -> Pose:
        """Return the projection of a transform on the plane."""
        return cls(float(matrix[0, 3]), float(matrix[1, 3]), math.atan2(matrix[1, 0], matrix[0, 0]))

    def matrix(self, z: float = 0.0) -> NDArray[np.float64]:
        """Return the transform of this pose at a height `z` in m."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[cos, -sin, 0.0, self.x], [sin, cos, 0.0, self.y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]])

    def __matmul__(self, other: Pose) -> Pose:
        """Return the pose `other`, given in this pose's frame, in the frame that this pose is given in."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(
            self.x + cos * other.x - sin * other.y,
            self.y + sin * other.x + cos * other.y,
            wrap(self.yaw + other.yaw),
        )

    def inverse(self) -> Pose:
        """Return the inverse transform."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, wrap(-self.yaw))

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points (N, 2) of this pose's frame, converted to the frame in which this pose is given."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return points @ np.array([[cos, sin], [-sin, cos]]) + (self.x, self.y)

    def distance(self, other: Pose) -> float:
        """Return the Euclidean distance to another pose in m."""
        return math.hypot(self.x - other.x, self.y - other.y)


ORIGIN = Pose(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Velocity:
    """A velocity of a base in its own frame.

    Attributes:
        x: forward, m/s.
        y: to the left, m/s.
        yaw: rad/s.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


STOP = Velocity()


def wrap(angle: float) -> float:
    """Return an angle within -pi and pi."""
    return math.remainder(angle, 2.0 * math.pi)


def quaternion_of(yaw: float) -> tuple[float, float]:
    """Return z and w of the quaternion of a yaw; its x and y are 0."""
    return math.sin(yaw / 2.0), math.cos(yaw / 2.0)


def yaw_of(z: float, w: float) -> float:
    """Return the yaw of a quaternion whose x and y are 0."""
    return wrap(2.0 * math.atan2(z, w))


def transform_of(translation: Sequence[float], quaternion: Sequence[float]) -> NDArray[np.float64]:
    """Return the transform of a translation (x, y, z) in m and a unit quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    matrix = np.eye(4)
    matrix[:3, :3] = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    matrix[:3, 3] = translation
    return matrix


def inscribed_radius(corners: NDArray[np.float64]) -> float:
    """Return the distance from the origin to the nearest edge of a polygon (N, 2)."""
    ends = np.roll(corners, -1, axis=0)
    edges = ends - corners
    along = np.clip(-(corners * edges).sum(1) / np.maximum((edges**2).sum(1), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(corners + along[:, None] * edges).T).min())
