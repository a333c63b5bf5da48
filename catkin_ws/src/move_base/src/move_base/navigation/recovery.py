"""The recovery sequence of one goal: which behaviour is next, and how far a turn has come."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robot_formulas.geometry import Pose, wrap

if TYPE_CHECKING:
    from collections.abc import Sequence

    from move_base.parameters.parameters import RecoveryBehavior

PATIENCE = 15.0
"""The turn is given up after this time, s: over twice what it takes."""

TURN_TOLERANCE = 0.1
"""A turn is complete within this angle, rad."""

AFRESH_DISTANCE = 1.0
"""Having come this far from where it last recovered (m), the robot may try all behaviours again."""


@dataclass
class Recovery:
    """The sequence's state.

    Attributes:
        behaviour: the present one.
        tried: number of behaviours that have begun.
    """

    behaviour: RecoveryBehavior | None = None
    tried: int = 0
    _since: float = 0.0
    _where: Pose | None = None
    _turned: float = 0.0
    _yaw: float = 0.0

    def begin(self, behaviours: Sequence[RecoveryBehavior], now: float, robot: Pose) -> RecoveryBehavior | None:
        """Go on to the next behaviour and return it; return None when all were tried."""
        if self.tried >= len(behaviours):
            return None
        self.behaviour = behaviours[self.tried]
        self.tried += 1
        self._since, self._where = now, robot
        self._turned, self._yaw = 0.0, robot.yaw
        return self.behaviour

    def follow(self, robot: Pose) -> None:
        """Restart the sequence if the robot has moved away."""
        if self._where is not None and robot.distance(self._where) > AFRESH_DISTANCE:
            self.tried, self._where = 0, None

    def left_to_turn(self, now: float, robot: Pose) -> float:
        """Return what is left of a full turn, rad; 0 when it is complete or took too long."""
        self._turned += wrap(robot.yaw - self._yaw)
        self._yaw = robot.yaw
        left = 2.0 * math.pi - self._turned
        return left if left > TURN_TOLERANCE and now - self._since < PATIENCE else 0.0
