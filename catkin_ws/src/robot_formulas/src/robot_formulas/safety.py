"""Safety as a risk: 0 is harmless, 1 the largest deviation. Constants are those of the published observer of D2."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

BRAKING_GAIN = 0.40
"""1/s. Published observer: the braking distance is 2.5 s of travel."""


def braking_distance(speed: float, gain: float = BRAKING_GAIN) -> float:
    """Return the published braking distance: speed / gain.

    Args:
        speed: magnitude of the velocity in m/s; the sign is ignored.
        gain: 1/s.

    Returns:
        Distance in m.

    Raises:
        ValueError: the gain is not positive.
    """
    if not gain > 0.0:
        raise ValueError(f"gain of the braking distance is {gain}; it must be positive")
    return abs(speed) / gain


def physical_braking_distance(speed: float, max_deceleration: float, reaction_time: float) -> float:
    """Return v^2/(2a) + v*t in m, the alternative to the published formula (Chung et al. 2009).

    Args:
        speed: magnitude of the velocity in m/s; the sign is ignored.
        max_deceleration: m/s2, positive.
        reaction_time: s, not negative.

    Raises:
        ValueError: an argument is out of its range.
    """
    if not max_deceleration > 0.0 or not reaction_time >= 0.0:
        raise ValueError(f"max_deceleration {max_deceleration} must be positive, reaction_time {reaction_time} >= 0")
    return speed * speed / (2.0 * max_deceleration) + abs(speed) * reaction_time


def safety_risk(obstacle_distance: float, d_break: float) -> float:
    """Return 0 if the obstacle is at least the braking distance away, else 1 - distance / braking distance.

    Args:
        obstacle_distance: distance in m of the closest obstacle in the direction of motion; inf where there is none.
        d_break: braking distance in m; 0 at rest, where nothing is a risk.

    Raises:
        ValueError: an argument is NaN.
    """
    if math.isnan(obstacle_distance) or math.isnan(d_break):
        raise ValueError(f"obstacle distance {obstacle_distance}, braking distance {d_break}: not a number")
    if d_break <= 0.0 or obstacle_distance >= d_break:
        return 0.0
    return 1.0 - max(obstacle_distance, 0.0) / d_break


def closest_in_direction(
    x: ArrayLike, y: ArrayLike, direction_rad: float, half_angle_rad: float = math.pi / 2
) -> float:
    """Return the distance of the closest point within a sector around the direction of motion.

    Args:
        x: coordinates in m relative to the sensor (any shape); points that are not finite are ignored.
        y: the same shape as x.
        direction_rad: direction of motion in the frame of the points.
        half_angle_rad: half the opening of the sector; points on its edge count.

    Returns:
        Distance in m; inf where the sector is empty.
    """
    px = np.asarray(x, dtype=float).ravel()
    py = np.asarray(y, dtype=float).ravel()
    if px.size == 0:
        return math.inf
    distance = np.hypot(px, py)
    # cos(angle to the direction) >= cos(half angle), without the arc tangent; the margin keeps the edge in.
    along = px * math.cos(direction_rad) + py * math.sin(direction_rad)
    inside = np.isfinite(distance) & (along >= distance * math.cos(half_angle_rad) - 1e-9)
    return float(distance[inside].min()) if inside.any() else math.inf
