"""Processing of raw data in the sensor drivers: noise and range limits of a laser, points of a depth image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


LASER_NOISE = 0.01
"""Standard deviation of a range, m."""
DEPTH_NOISE = 0.001
"""Standard deviation of a depth of 1 m, m; it grows with the depth's square."""


class SensorError(ValueError):
    """Raw data make no sense."""


def measure_ranges(
    ranges: ArrayLike, range_min: float, range_max: float, noise: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Return what a laser reports for true ranges.

    Args:
        ranges: (n,) true distances in m; inf where a ray hits nothing.
        range_min: m; what the noise brings below it is reported as range_min.
        range_max: m; what lies at it or beyond is reported as inf.
        noise: standard deviation in m.
        rng: source of the noise; one value is drawn per ray, hit or not, so that a seed gives one sequence.

    Raises:
        SensorError: no ranges, a NaN or negative range, or limits out of order.
    """
    true = np.asarray(ranges, dtype=np.float32)
    if true.ndim != 1 or true.size == 0:
        raise SensorError(f"raw scan has shape {true.shape}; expected one row of ranges")
    if not 0.0 <= range_min < range_max:
        raise SensorError(f"raw scan has range_min {range_min} and range_max {range_max}")
    if np.isnan(true).any() or (true < 0.0).any():
        raise SensorError("raw scan holds a NaN or negative range")
    noisy = true + noise * rng.standard_normal(true.size, dtype=np.float32)
    noisy = np.maximum(noisy, np.float32(range_min))
    return np.where(true < range_max, np.minimum(noisy, np.float32(range_max)), np.float32(np.inf))


FULL_LIGHT = 0.25
"""Light (1 is a well-lit hall) from which on the depth camera sees all; below, it loses pixels in proportion."""


def measure_depth(
    depth: NDArray[np.float32], light: float, noise: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Return what a stereo depth camera reports for true depths.

    Args:
        depth: (height, width) true depths in m; inf where there is nothing.
        light: brightness, 0 to 1; in the dark the two images have nothing to match.
        noise: standard deviation in m at a depth of 1 m; it grows with the depth's square.
        rng: source of the noise; the same number of values is drawn for every image of one size.

    Returns:
        (height, width) depths in m; NaN where a pixel is lost.
    """
    errors = rng.standard_normal(depth.shape, dtype=np.float32)
    chances = rng.random(depth.shape, dtype=np.float32)
    finite = np.where(np.isfinite(depth), depth, np.float32(0.0))
    noisy = depth + np.float32(noise) * finite * finite * errors
    return np.where(chances * FULL_LIGHT < light, noisy, np.float32(np.nan)).astype(np.float32)


class DepthProjector:
    """Turns depth images of one size and field of view into points; keeps the directions of the pixels."""

    def __init__(self, width: int, height: int, field_of_view: float) -> None:
        """Prepare for images of one size.

        Args:
            width: pixels.
            height: pixels.
            field_of_view: horizontal, rad.

        Raises:
            SensorError: a value is not positive, or the field of view is 180 degrees or more.
        """
        if width < 1 or height < 1 or not 0.0 < field_of_view < np.pi:
            raise SensorError(f"depth image of {width} x {height} pixels over {field_of_view} rad")
        self.shape = (height, width)
        focal_length = width / 2.0 / np.tan(field_of_view / 2.0)
        left = ((width - 1) / 2.0 - np.arange(width)) / focal_length
        up = ((height - 1) / 2.0 - np.arange(height)) / focal_length
        directions = np.empty((height, width, 3), dtype=np.float32)
        directions[..., 0] = 1.0
        directions[..., 1] = left[np.newaxis, :]
        directions[..., 2] = up[:, np.newaxis]
        self._directions = directions.reshape(-1, 3)

    def points(self, depth: NDArray[np.float32], range_min: float, range_max: float) -> NDArray[np.float32]:
        """Return the points of a depth image in the camera's frame: x forward, y left, z up.

        Args:
            depth: (height, width), m along the optical axis; pixels that are not finite have no point.
            range_min: m, closest depth that counts.
            range_max: m, farthest depth that counts.

        Returns:
            (n, 3) points in m.

        Raises:
            SensorError: the image has another size than the projector was made for.
        """
        if depth.shape != self.shape:
            raise SensorError(f"depth image of {depth.shape[::-1]} pixels, expected {self.shape[::-1]}")
        with np.errstate(invalid="ignore"):
            valid = np.flatnonzero((depth >= range_min) & (depth <= range_max))
        points = self._directions.take(valid, axis=0)
        points *= depth.take(valid)[:, np.newaxis]
        return points
