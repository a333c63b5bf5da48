"""The robot's light sensor: what it measures of the brightness around it."""

from __future__ import annotations

from pybullet_simulator.robot.random_errors import Normals

WELL_LIT = 300.0
"""Illuminance of a well-lit hall, lx: EN 12464-1 asks for it where goods are packed and handled."""
NOISE = 0.02
"""Standard deviation of a measurement, as a share of it (estimate for a photodiode with a filter)."""


class LightSensor:
    """Measures illuminance."""

    def __init__(self, seed: int) -> None:
        """Start the sensor's own random numbers."""
        self._normals = Normals(seed, 12)

    def measure(self, light: float) -> float:
        """Return the illuminance in lx where the brightness is `light`, 0 (dark) to 1 (a well-lit hall)."""
        return light * WELL_LIT * (1.0 + NOISE * self._normals.next())
