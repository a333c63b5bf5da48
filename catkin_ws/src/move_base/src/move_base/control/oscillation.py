"""Flags against oscillation on the spot, as base_local_planner has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose, Velocity

TURN, STRAFE = 2, 1
"""Columns of a velocity (x, y, yaw)."""


class OscillationFlags:
    """If the robot has turned (or strafed) to one side and back, it must move before it may use that side again."""

    def __init__(self) -> None:
        self._last = {TURN: 0.0, STRAFE: 0.0}
        self._forbidden: dict[int, float] = {}
        self._from: Pose | None = None

    def follow(self, robot: Pose, reset_distance: float) -> None:
        """Forget everything once the robot has moved by the distance (m) since it last turned or strafed."""
        if self._from is not None and robot.distance(self._from) >= reset_distance:
            self._last = dict.fromkeys(self._last, 0.0)
            self._forbidden = {}
            self._from = None

    def take(self, robot: Pose, velocity: Velocity) -> None:
        """Learn what the robot does now."""
        axis, speed = (STRAFE, velocity.y) if velocity.y else (TURN, velocity.yaw)
        if not speed or (velocity.x > 0.0 and not velocity.y):
            return
        direction = float(np.sign(speed))
        if self._last[axis] == -direction:
            self._forbidden[axis] = -direction
        self._last[axis] = direction
        self._from = robot

    def allowed(self, samples: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the velocities (C, 3) that are not forbidden."""
        bad = np.zeros(len(samples), dtype=bool)
        for axis, direction in self._forbidden.items():
            bad |= samples[:, axis] * direction > 0.0
        return samples[~bad]
