"""Means with Student's 95 % confidence interval."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scipy.stats import t as student

if TYPE_CHECKING:
    from collections.abc import Sequence

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Interval:
    """A mean and the half width of its confidence interval."""

    mean: float
    half: float

    def text(self, digits: int) -> str:
        """Return the interval as a table shows it."""
        half = f" ± {self.half:.{digits}f}" if math.isfinite(self.half) else ""
        return f"{self.mean:.{digits}f}{half}"


def interval(values: Sequence[float]) -> Interval:
    """Return the mean of values with its confidence interval; an infinite interval for a single value."""
    if len(values) < 2:
        return Interval(values[0], math.inf)
    factor = float(student.ppf(0.5 + CONFIDENCE / 2.0, len(values) - 1))
    return Interval(statistics.fmean(values), factor * statistics.stdev(values) / math.sqrt(len(values)))
