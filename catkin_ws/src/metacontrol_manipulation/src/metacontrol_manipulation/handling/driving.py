"""How the base gets to a place beside the cell: speeds from what is left to go."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robot_formulas.geometry import Pose

AT_PLACE = 0.004
"""m, and rad, within which the base is at its place."""
SPEED = 0.25
"""m/s at most: the base of the cell can do 0.3."""
TURN_RATE = 0.3
"""rad/s at most."""
_GAIN = 1.5
"""m/s per m that is left: with it the base brakes more softly than it can (0.5 m/s2) and does not swing."""
_STANDING = 0.01
"""m/s and rad/s below which the base stands."""


def speeds(to_go: Pose) -> tuple[float, float, float]:
    """Return the speeds (forward, left in m/s, turn in rad/s) towards a place.

    Args:
        to_go: pose of the place in base_link; one that is not finite gives no speed.
    """
    if not all(map(math.isfinite, (to_go.x, to_go.y, to_go.yaw))):
        return 0.0, 0.0, 0.0
    distance = math.hypot(to_go.x, to_go.y)
    share = min(_GAIN, SPEED / distance) if distance > 0.0 else 0.0
    return share * to_go.x, share * to_go.y, max(-TURN_RATE, min(TURN_RATE, _GAIN * to_go.yaw))


def has_arrived(to_go: Pose, velocity: tuple[float, float, float]) -> bool:
    """Return whether the base stands at a place.

    Args:
        to_go: pose of the place in base_link.
        velocity: of the base, in m/s and rad/s.
    """
    is_there = math.hypot(to_go.x, to_go.y) < AT_PLACE and abs(to_go.yaw) < AT_PLACE
    return is_there and all(abs(part) < _STANDING for part in velocity)
