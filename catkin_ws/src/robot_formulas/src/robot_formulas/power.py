"""The power load of the robot: the published model of D2, its level, the meter that feeds it, and the battery."""

from __future__ import annotations

import math

SPEED_COEFFICIENT = 1.3
"""Load per m/s of the largest forward speed (published node battery_load_control)."""
ACCELERATION_COEFFICIENT = 0.1
"""Load per m/s2 of the largest forward acceleration (as above)."""
RATE_COEFFICIENT = 0.04
"""Load per Hz of the rate of velocity commands (as above)."""
MIN_LOAD, MAX_LOAD = 0.2, 5.0
"""The load is clipped to this interval (as above)."""
WATTS_PER_LOAD = 160.0
"""W of one unit of load. Chosen so that the full load, 5.0, is 800 W: it empties the battery in three hours, which is
the Ridgeback's rated run time at full use."""
BATTERY_CAPACITY_WH = 2400.0
"""Wh of the Ridgeback's battery, 24 V and 100 Ah."""


LARGEST = 1e6
"""m/s of a speed, m/s2 of an acceleration, and the largest factor: more can only be an error of its source."""

BACKING_SPEED = 0.15
"""m/s. To drive backwards faster than this takes as much power as to drive ahead. Slower, it counts as standing, as in
the published model, whose robot only backs off (0.1 m/s)."""


class PowerError(ValueError):
    """The power model refuses a value."""


def power_load(
    speed: float, acceleration: float, rate: float, factor: float = 1.0, additional_consumption: float = 0.0
) -> float:
    """Return the load of the published energy model, clipped to [0.2, 5.0].

    Args:
        speed: largest forward speed since the last tick, m/s.
        acceleration: largest forward acceleration since the last tick, m/s2.
        rate: measured rate of velocity commands, Hz.
        factor: multiplies the consumption; the power contingency raises it above 1.
        additional_consumption: added to the load before the factor.

    Raises:
        PowerError: an argument is not finite or far too large, or the factor is negative.
    """
    check_factor(factor)
    model = SPEED_COEFFICIENT * speed + ACCELERATION_COEFFICIENT * acceleration + RATE_COEFFICIENT * rate
    load = (model + additional_consumption) * factor
    if not math.isfinite(load):
        raise PowerError(
            f"speed {speed}, acceleration {acceleration}, rate {rate}: every value must be finite, and not absurd"
        )
    return min(max(load, MIN_LOAD), MAX_LOAD)


def check_factor(factor: float) -> float:
    """Return the factor.

    Raises:
        PowerError: it is not within 0 and `LARGEST`.
    """
    if not 0.0 <= factor <= LARGEST:
        raise PowerError(f"consumption factor {factor} refused: it must be a number from 0 to {LARGEST:g}")
    return factor


def energy_level(load: float) -> float:
    """Return the power load (the published model's scale, 0.2 to 5.0) as a level from 0 to 1.

    Raises:
        ValueError: the load is not finite.
    """
    if not math.isfinite(load):
        raise ValueError(f"power load {load} is not finite")
    return min(max((load - MIN_LOAD) / (MAX_LOAD - MIN_LOAD), 0.0), 1.0)


class PowerMeter:
    """Collects speed, acceleration and commands between two ticks, and turns them into a load at each."""

    _since: float | None
    _speed: float
    _acceleration: float
    _commands: int

    def __init__(self, now: float | None) -> None:
        """Start to measure.

        Args:
            now: ROS time in s; None while there is no clock yet: then the first tick starts it.
        """
        self.factor = 1.0
        self._start(now)

    def add_speed(self, forward: float) -> None:
        """Take a forward speed in m/s; of a negative one, the magnitude counts from `BACKING_SPEED` on.

        Raises:
            PowerError: it is not finite, or its magnitude is above `LARGEST`.
        """
        if not abs(forward) <= LARGEST:
            raise PowerError(f"forward speed {forward} m/s is no speed of a robot")
        self._speed = max(self._speed, -forward if forward < -BACKING_SPEED else forward)

    def add_acceleration(self, forward: float) -> None:
        """Take a forward acceleration in m/s2.

        Raises:
            PowerError: it is not finite, or its magnitude is above `LARGEST`.
        """
        if not abs(forward) <= LARGEST:
            raise PowerError(f"forward acceleration {forward} m/s2 is no acceleration of a robot")
        self._acceleration = max(self._acceleration, forward)

    def add_command(self) -> None:
        """Count a velocity command."""
        self._commands += 1

    def tick(self, now: float) -> float | None:
        """Return the load since the last tick, and start anew; None if no time has passed or time ran backwards.

        Raises:
            PowerError: the factor cannot be used; the meter starts anew all the same.
        """
        since, speed, acceleration, commands = self._since, self._speed, self._acceleration, self._commands
        self._start(now)
        if since is None or now <= since:
            return None
        return power_load(speed, acceleration, commands / (now - since), self.factor)

    def _start(self, now: float | None) -> None:
        self._since = now
        self._speed = 0.0
        self._acceleration = 0.0
        self._commands = 0


class Battery:
    """State of charge, drained by the load."""

    def __init__(self, charge: float = 1.0) -> None:
        """Start with a state of charge from 0 to 1.

        Raises:
            PowerError: the charge is not within 0 and 1.
        """
        if not 0.0 <= charge <= 1.0:
            raise PowerError(f"state of charge {charge} must lie between 0 and 1")
        self.charge = charge

    def drain(self, load: float, duration: float) -> None:
        """Remove the charge that a load (model's scale) consumes in a time (s)."""
        self.charge = max(self.charge - load * WATTS_PER_LOAD * duration / 3600.0 / BATTERY_CAPACITY_WH, 0.0)

    @property
    def voltage(self) -> float:
        """Open-circuit voltage in V: linear from 22 V (empty) to 26 V (full), like a lead-acid pack of 24 V."""
        return 22.0 + 4.0 * self.charge

    def current(self, load: float) -> float:
        """Return the current in A that a load draws; negative when discharging, as sensor_msgs/BatteryState has it."""
        return -load * WATTS_PER_LOAD / self.voltage
