"""Measured values as levels: 0 is the best, 1 the worst."""

from __future__ import annotations

import math


def normalised(value: float, best: float, worst: float) -> float:
    """Return a measured value as a level from 0 (at `best`, or better) to 1 (at `worst`, or worse).

    Raises:
        ValueError: the value is not finite, or the ends are the same.
    """
    if not math.isfinite(value) or best == worst:
        raise ValueError(f"{value} can't be a level between {best} and {worst}")
    return min(max((value - best) / (worst - best), 0.0), 1.0)
