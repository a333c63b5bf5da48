"""The controller of the base, which turns velocity commands into motion of the wheels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pybullet_simulator.robot.robot import Robot

Velocity = tuple[float, float, float]
"""Forward, left, turn rate in base_link: m/s, m/s, rad/s."""
_REST = (0.0, 0.0, 0.0)


class Drive:
    """Follows commands within the limits of speed and acceleration; a command expires."""

    def __init__(self, robot: Robot) -> None:
        """Start at rest."""
        self._robot = robot
        self._target = _REST
        self._command_ns: int | None = None
        self._setpoint = _REST

    def command(self, forward: float, left: float, turn: float, now_ns: int) -> None:
        """Take a command of finite numbers; the speed is clipped, its direction kept."""
        robot = self._robot
        scale = min(1.0, robot.max_speed / max(math.hypot(forward, left), 1e-9))
        turn = min(max(turn, -robot.max_turn_rate), robot.max_turn_rate)
        self._target = (forward * scale, left * scale, turn)
        self._command_ns = now_ns

    def advance(self, now_ns: int, duration: float) -> Velocity:
        """Return the velocity of the wheels after a further time in s."""
        robot = self._robot
        expired = self._command_ns is None or now_ns - self._command_ns > robot.command_timeout * 1e9
        target = _REST if expired else self._target
        forward, left, turn = self._setpoint
        if (forward, left, turn) != target:
            change_x, change_y = target[0] - forward, target[1] - left
            change = math.hypot(change_x, change_y)
            share = min(1.0, robot.max_acceleration * duration / change) if change > 0.0 else 1.0
            limit = robot.max_turn_acceleration * duration
            change_turn = min(max(target[2] - turn, -limit), limit)
            self._setpoint = (forward + share * change_x, left + share * change_y, turn + change_turn)
        return self._setpoint


def turned(x: float, y: float, yaw: float) -> tuple[float, float]:
    """Return a vector of the plane, turned by an angle in rad: one of base_link in the map, for base_link's yaw."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    return cos * x - sin * y, sin * x + cos * y
