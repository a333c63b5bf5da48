"""A colour camera: linear light becomes an image of 8 bit, with the noise of a real sensor.

A pixel collects electrons in proportion to light and exposure time. Their number scatters (shot noise), and reading
them adds noise. The gain multiplies both before the converter cuts the signal into 256 steps. Too little light drowns
in noise and in the converter's steps; too much fills every pixel, and white and black are the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

FULL_WELL = 4000.0
"""Electrons that a pixel holds: one of 1.4 um, as in the colour cameras of depth sensors (estimate)."""
READ_NOISE = 25.0
"""Electrons, standard deviation of a reading: 1.6 steps of the converter at a gain of 1 (estimate, a cheap sensor)."""
SENSITIVITY = 8e5
"""Electrons per s that white paper in full light gives a pixel: 1600 in 2 ms."""
GLARE = 0.01
"""Share of the image's mean light that lens and housing scatter over the whole image (estimate)."""
_STEPS = 255.0


@dataclass(frozen=True)
class CameraSettings:
    """How a camera takes images.

    Attributes:
        exposure: s.
        gain: 1 brings a full well to the brightest step.
    """

    exposure: float
    gain: float


BRIGHT = CameraSettings(exposure=0.002, gain=1.0)
"""For a light of 1: white paper fills 40 % of a well."""
DIM = CameraSettings(exposure=0.03, gain=4.0)
"""For a light of 0.03: sixty times as sensitive, as long as 30 images a second leave time for."""


def take(light: NDArray[np.float32], settings: CameraSettings, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return the image that a camera takes.

    Args:
        light: (height, width, 3) linear light, 1 for white paper in full light.
        settings: exposure and gain.
        rng: source of the noise; the same number of values is drawn for every image of one size.
    """
    electrons = (light + np.float32(GLARE) * light.mean(dtype=np.float64).astype(np.float32)) * np.float32(
        SENSITIVITY * settings.exposure
    )
    # The number of electrons is a Poisson variable; with a reading's noise it is as good as normal.
    deviation = np.sqrt(electrons + np.float32(READ_NOISE**2))
    electrons = electrons + deviation * rng.standard_normal(light.shape, dtype=np.float32)
    signal = np.clip(electrons, 0.0, FULL_WELL) * np.float32(settings.gain * _STEPS / FULL_WELL)
    return np.clip(np.rint(signal), 0.0, _STEPS).astype(np.uint8)
