"""The uncertainty of a position."""

from __future__ import annotations

import math


def position_uncertainty(xx: float, xy: float, yy: float) -> float:
    """Return the largest standard deviation in m of a position, from its covariance in m2.

    Raises:
        ValueError: the numbers are no covariance: not finite, or negative in some direction.
    """
    if not all(map(math.isfinite, (xx, xy, yy))):
        raise ValueError(f"covariance ({xx}, {xy}, {yy}) is not finite")
    mean, half = (xx + yy) / 2.0, (xx - yy) / 2.0
    spread = math.hypot(half, xy)
    if xx < 0.0 or yy < 0.0 or mean - spread < -1e-9 * max(mean, 1.0):
        raise ValueError(f"({xx}, {xy}, {yy}) is no covariance")
    return math.sqrt(mean + spread)
