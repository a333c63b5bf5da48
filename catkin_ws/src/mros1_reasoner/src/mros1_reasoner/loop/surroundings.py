"""What is known of the surroundings: the present value of each observed property.

A value is the median of the last ones. One that no longer fits a design counts at once; one that fits again counts only
when it is beyond the limit by a margin, so that designs do not take turns at a value about the limit. What has been
observed holds until something else is: in the dark, a silent sensor is no light.
"""

from __future__ import annotations

import math
import statistics
from collections import deque
from collections.abc import Iterable, Mapping

from mros1_reasoner.knowledge.model import Need


class Surroundings:
    """Values of properties of the surroundings, and which needs they do not meet."""

    def __init__(self, needs: Iterable[Need], history: int, margin: float) -> None:
        """Know no value.

        Args:
            needs: of all designs.
            history: how many values are judged together.
            margin: by which share of a limit a value must be beyond it to fit again.
        """
        self._needs = tuple(dict.fromkeys(needs))
        self._history, self._margin = history, margin
        self._last: dict[str, deque[float]] = {}
        self._values: dict[str, float] = {}
        self._since: dict[Need, float] = {}

    @property
    def values(self) -> Mapping[str, float]:
        """The present value of each property."""
        return self._values

    @property
    def unmet(self) -> Mapping[Need, float]:
        """The needs that are not met, each with the stamp since when, s."""
        return self._since

    def observe(self, stamp: float, attribute: str, value: float) -> None:
        """Take in an observed value; the stamp is in s."""
        last = self._last.setdefault(attribute, deque(maxlen=self._history))
        last.append(value)
        median = told = statistics.median(last)
        for need in self._needs:
            if need.attribute != attribute:
                continue
            if need.lack(median):
                self._since.setdefault(need, stamp)
            elif need in self._since and self._is_well_within(need, median):
                del self._since[need]
            elif need in self._since:  # it does not fit yet: what is told is just beyond the limit
                is_low = median - need.least < need.most - median
                told = min(told, _beyond(need.least, -1)) if is_low else max(told, _beyond(need.most, 1))
        self._values[attribute] = told

    def _is_well_within(self, need: Need, value: float) -> bool:
        limits = [limit for limit in (need.least, need.most) if math.isfinite(limit)]
        return all(abs(value - limit) >= self._margin * abs(limit) for limit in limits)


def _beyond(limit: float, side: int) -> float:
    return limit + side * 1e-6 * max(1.0, abs(limit))
