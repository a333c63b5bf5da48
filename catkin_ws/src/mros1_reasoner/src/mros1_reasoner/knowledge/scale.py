"""The scale of a quality: how levels compare, and how observed ones correct expected ones."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from mros1_reasoner.knowledge.model import Direction


@dataclass(frozen=True)
class Correction:
    """What is expected now, by what was expected at first: times a factor, or plus a difference."""

    factor: float = 1.0
    difference: float = 0.0

    def apply(self, expected: float) -> float:
        """Return a corrected level."""
        return expected * self.factor + self.difference

    def faded(self, share: float) -> Correction:
        """Return what is left of it when a share of it is forgotten."""
        return Correction(1.0 + (self.factor - 1.0) * (1.0 - share), self.difference * (1.0 - share))

    @property
    def tells(self) -> bool:
        """Whether it is big enough to be told."""
        return round(self.factor, 2) != 1.0 or float(f"{self.difference:.2g}") != 0.0

    def __str__(self) -> str:
        if self.difference:
            return f"{abs(self.difference):.3g} {'more' if self.difference > 0 else 'less'} than"
        return f"{self.factor:.3g} times"


@dataclass(frozen=True)
class Scale:
    """How levels of a quality are compared with each other.

    Levels that are all positive are on a ratio scale: a cause multiplies them, such as a load. On any other scale, such
    as dB or degrees, a factor would turn the sign against the cause, so a cause adds a difference.

    Attributes:
        direction: which levels are the better ones.
        is_ratio: whether levels are compared by ratio.
        span: difference between the greatest and the least level that is expected of any design.
    """

    direction: Direction = Direction.LOWER_IS_BETTER
    is_ratio: bool = True
    span: float = 0.0

    @classmethod
    def of(cls, direction: Direction, expected: Collection[float], low: float | None = None) -> Scale:
        """Return the scale of a quality.

        Args:
            direction: which levels are the better ones.
            expected: levels and limits in the model.
            low: the least possible level; None where it is not known.
        """
        is_ratio = all(level > 0.0 for level in expected) and (low is None or low >= 0.0)
        return cls(direction, is_ratio, max(expected) - min(expected) if expected else 0.0)

    def can_compare_with(self, expected: float) -> bool:
        """Return whether observed levels can be compared with an expected one: on a ratio scale, it is positive."""
        return not self.is_ratio or expected > 0.0

    def strain(self, observed: float, expected: float) -> Correction:
        """Return the correction that makes an observed level of an expected one that can be compared with."""
        if self.is_ratio:
            return Correction(factor=max(observed, 0.0) / expected)
        return Correction(difference=observed - expected)

    def bounded(self, correction: Correction, most: float) -> Correction:
        """Return a correction that makes no level look better, and that is not greater than is plausible.

        Args:
            correction: what was observed.
            most: the greatest factor; the least one is its reciprocal. A difference is at most `most` - 1 times the
                span of the expected levels.
        """
        lower = self.direction is Direction.LOWER_IS_BETTER
        if self.is_ratio:
            factor = correction.factor
            return Correction(factor=min(max(1.0, factor), most) if lower else max(min(1.0, factor), 1.0 / most))
        room = (most - 1.0) * self.span
        difference = correction.difference
        return Correction(difference=min(max(0.0, difference), room) if lower else max(min(0.0, difference), -room))

    def margin(self, limit: float, share: float) -> float:
        """Return the distance from a limit that counts as a relief.

        Args:
            limit: of the quality.
            share: of the limit on a ratio scale, else of the span of the expected levels.
        """
        return share * (abs(limit) if self.is_ratio else self.span)

    def is_relieved(self, before: Correction, now: Correction, share: float) -> bool:
        """Return whether levels are better by a share than they were, compared with the expected ones."""
        sign = self.direction.sign
        if self.is_ratio:
            scaled = before.factor * (1.0 - sign * share)
            return sign * (now.factor - scaled) <= 0.0 or math.isclose(now.factor, scaled)
        return sign * (now.difference - before.difference) <= -share * self.span
