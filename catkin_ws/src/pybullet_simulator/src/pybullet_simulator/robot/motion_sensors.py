"""The sensors of the robot's own motion: wheel odometry, IMU, the filter over both, and localisation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from robot_formulas.geometry import ORIGIN, Pose, wrap

from pybullet_simulator.robot.random_errors import Normals, Wander

if TYPE_CHECKING:
    from collections.abc import Sequence

VIBRATION = 2.0
"""Standard deviation of the IMU's forward acceleration between jolts, in m/s2 per m/s of speed, at 50 Hz."""

JOLT_SPACING = 15.0
"""m between two jolts on average: joints and damaged places of the floor that a wheel runs over."""

JOLT = 38.0
"""Scale of the Rayleigh distribution of a jolt's acceleration, in m/s2 per m/s of speed."""

SLIP_SIDEWAYS = 3.0
"""Mecanum wheels slip about three times as much sideways as ahead: their rollers carry the load (estimate)."""
SLIP_CORRELATION = 0.5
"""s; the floor under a wheel is another after some tenths of a metre."""
LOCALISATION_CORRELATION = 5.0
"""s; a scan matcher's error changes with the view, that is over some metres."""


@dataclass(frozen=True)
class Errors:
    """How good the robot's sensors of motion are; all zero is perfect.

    Attributes:
        slip: standard deviation of the wheels' slip ahead and in turning, as a share of the motion.
        odometry_drift: constant error of the wheels per distance travelled: share of it and, in rad per m, heading.
        imu: standard deviation of the accelerations at rest, m/s2.
        gyro: standard deviation of the turn rate, rad/s.
        localisation: standard deviation of the localised position in m; the heading's is a tenth of it in rad.
    """

    slip: float = 0.0
    odometry_drift: float = 0.0
    imu: float = 0.0
    gyro: float = 0.0
    localisation: float = 0.0


PERFECT = Errors()
REAL = Errors(slip=0.01, odometry_drift=0.002, imu=0.02, gyro=0.003, localisation=0.02)
"""Errors of the order of real devices: a MEMS IMU at 50 Hz (0.3 mg/sqrt(Hz), 0.02 deg/s/sqrt(Hz)), mecanum wheels on
concrete, a scan matcher on a map of 0.05 m."""


class Slip:
    """The wheels' slip: the base moves a little less, or more, than its wheels turn.

    Attributes:
        factors: motion of the base as a share of the wheels': ahead, to the left, turning.
    """

    def __init__(self, deviation: float, seed: int) -> None:
        """Start with the standard deviation of Errors.slip."""
        normals = Normals(seed, 4)
        self._axes = [Wander(deviation * share, SLIP_CORRELATION, normals) for share in (1.0, SLIP_SIDEWAYS, 1.0)]
        self.factors = self._factors()

    def advance(self, duration: float) -> None:
        """Let time (s) pass."""
        for axis in self._axes:
            axis.advance(duration)
        self.factors = self._factors()

    def _factors(self) -> tuple[float, float, float]:
        ahead, left, turn = (1.0 - axis.error for axis in self._axes)
        return ahead, left, turn


class Odometry:
    """Dead reckoning, by the wheels alone and with the IMU's turn rate in place of theirs.

    Attributes:
        wheels: pose by the wheels, in the frame where the robot started.
        filtered: pose by the wheels' speed and the gyro's turn rate.
        velocity: (ahead, left, turn rate) by the wheels, m/s, m/s, rad/s.
    """

    def __init__(self, errors: Errors, seed: int) -> None:
        """Start at the origin."""
        self._drift = errors.odometry_drift
        self._gyro = errors.gyro
        self._normals = Normals(seed, 5)
        self.wheels = ORIGIN
        self.filtered = ORIGIN
        self.velocity = (0.0, 0.0, 0.0)
        self.turn_rate = 0.0

    def advance(self, moved: Pose, velocity: Sequence[float], factors: Sequence[float], duration: float) -> None:
        """Take the true motion of the base since the last time.

        Args:
            moved: the new pose in the frame of the last one.
            velocity: (ahead, left, turn rate) now, m/s, m/s, rad/s.
            factors: the slip that lies between base and wheels, see `Slip`.
            duration: s.
        """
        scale = 1.0 + self._drift
        ahead, left, turn = (true / factor for true, factor in zip(velocity, factors, strict=True))
        self.velocity = (ahead * scale, left * scale, turn)
        gyro_error = self._gyro * self._normals.next() if self._gyro else 0.0
        self.turn_rate = velocity[2] + gyro_error
        x, y = scale * moved.x / factors[0], scale * moved.y / factors[1]
        heading = moved.yaw / factors[2] + self._drift * math.hypot(moved.x, moved.y)
        self.wheels = self.wheels @ Pose(x, y, heading)
        self.filtered = self.filtered @ Pose(x, y, moved.yaw + gyro_error * duration)


def vibration_variance(speed: float, duration: float) -> float:
    """Return the variance of the shaken acceleration, (m/s2)^2, at a speed (m/s), for samples so far apart (s)."""
    jolts = 2.0 * speed * duration / JOLT_SPACING  # samples with a jolt, or with the rebound after it
    return (VIBRATION * speed) ** 2 + jolts * 2.0 * (JOLT * speed) ** 2


class Imu:
    """Accelerations in base_link, shaken by the wheels on a hard floor.

    The bulk of the vibration is normal. Jolts come as a Poisson process along the way, each forwards in one sample and
    back in the next. The constants are fitted to published energies (docs/yardstick.md).
    """

    def __init__(self, noise: float, seed: int) -> None:
        """Start at rest; `noise` is Errors.imu."""
        self._noise = noise
        self._shaking = Normals(seed, 1)
        self._resting = Normals(seed, 6)
        self._floor = np.random.default_rng([seed, 10])
        self._next_jolt = float(self._floor.exponential(JOLT_SPACING))  # m from here
        self._rebound = 0.0

    def measure(self, change: Sequence[float], speed: float, duration: float) -> tuple[float, float]:
        """Return the acceleration (ahead, left) in m/s2 over the last sample.

        Args:
            change: of the velocity (ahead, left) in base_link, m/s.
            speed: of the base, m/s.
            duration: since the last sample, s.
        """
        shaking = VIBRATION * speed * self._shaking.next() + self._jolt(speed, duration)
        ahead, left = (value / duration + self._noise * self._resting.next() for value in change)
        return ahead + shaking, left

    def _jolt(self, speed: float, duration: float) -> float:
        """Return what the floor's joints add to the forward acceleration of this sample, m/s2."""
        jolt, self._rebound = self._rebound, 0.0
        self._next_jolt -= speed * duration
        if self._next_jolt <= 0.0:
            self._next_jolt += float(self._floor.exponential(JOLT_SPACING))
            size = JOLT * speed * float(self._floor.rayleigh())
            jolt, self._rebound = jolt + size, -size
        return jolt


class Localisation:
    """Where the robot is on the map, with an error that wanders."""

    def __init__(self, deviation: float, seed: int) -> None:
        """Start with the standard deviation of Errors.localisation."""
        normals = Normals(seed, 2)
        self._x, self._y, self._yaw = (
            Wander(share * deviation, LOCALISATION_CORRELATION, normals) for share in (1.0, 1.0, 0.1)
        )

    def locate(self, pose: Pose) -> Pose:
        """Return the localised pose for the true one."""
        return Pose(pose.x + self._x.error, pose.y + self._y.error, wrap(pose.yaw + self._yaw.error))

    def advance(self, duration: float) -> None:
        """Let time (s) pass."""
        for axis in (self._x, self._y, self._yaw):
            axis.advance(duration)
