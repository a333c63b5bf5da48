"""People who walk to and fro between waypoints and wait while the robot stands in their way."""

from __future__ import annotations

import math
from dataclasses import dataclass

RADIUS = 0.25
HEIGHT = 1.75
"""m; a person as a cylinder."""
SPEED = 1.0
"""m/s; a comfortable walk on a shop floor (a free walk is 1.3 m/s)."""
MAX_SPEED = 3.0
"""m/s; faster nobody walks."""
CLEARANCE = 0.4
"""m between a person and the robot's outline, at less of which the person waits instead of walking on towards it."""


@dataclass(frozen=True)
class Walker:
    """A person's way.

    Attributes:
        name: unique within the world.
        waypoints: (x, y) in the map frame, m; walked to and fro.
        speed: m/s.
    """

    name: str
    waypoints: tuple[tuple[float, float], ...]
    speed: float = SPEED

    @property
    def length(self) -> float:
        """Length of the way in one direction, m."""
        return sum(math.dist(*leg) for leg in zip(self.waypoints, self.waypoints[1:], strict=False))

    def place(self, walked: float) -> tuple[float, float]:
        """Return where the person is (m, map frame) after a walk of a given length in m."""
        length = self.length
        if length <= 0.0:
            return self.waypoints[0]
        left = walked % (2.0 * length)
        left = min(left, 2.0 * length - left)
        for begin, end in zip(self.waypoints, self.waypoints[1:], strict=False):
            leg = math.dist(begin, end)
            if left <= leg and leg > 0.0:
                share = left / leg
                return begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1])
            left -= leg
        return self.waypoints[-1]
