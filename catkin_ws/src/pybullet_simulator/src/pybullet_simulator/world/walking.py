"""People who walk to and fro between waypoints and wait while the robot stands in their way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

RADIUS = 0.25
HEIGHT = 1.75
"""m; a person as a cylinder."""
SPEED = 1.0
"""m/s; a comfortable walk on a shop floor (a free walk is 1.3 m/s)."""
MAX_SPEED = 3.0
"""m/s; faster nobody walks."""
MAX_PEOPLE = 100
"""In a world file; halls have some tens."""
MAX_WAYPOINTS = 500
"""Of a person; nobody writes more, and each of them is looked at in every step."""
MAX_WAY = 10_000.0
"""m that all people of a world walk in one direction: every 0.25 m of it is compared with the boxes."""
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

    @cached_property
    def length(self) -> float:
        """Length of the way in one direction, m."""
        return sum(math.dist(*leg) for leg in zip(self.waypoints, self.waypoints[1:], strict=False))

    def places(self, spacing: float) -> NDArray[np.float64]:
        """Return points of the way in one direction, both ends too, at most `spacing` m apart: (n, 2), map frame."""
        x, y = np.array(self.waypoints).T
        walked = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
        at = np.linspace(0.0, walked[-1], math.ceil(self.length / spacing) + 1)
        return np.stack((np.interp(at, walked, x), np.interp(at, walked, y)), axis=1)

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
