"""Poses in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pose:
    """A pose in the plane: m, m, rad."""

    x: float
    y: float
    yaw: float

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


ORIGIN = Pose(0.0, 0.0, 0.0)


def wrap(angle: float) -> float:
    """Return an angle within -pi and pi."""
    return math.remainder(angle, 2.0 * math.pi)
