"""Limits that are violated, as a program without models would find out: by the mean level of the last seconds.

It is apart from the reasoner's own evidence, so that the managers that the reasoner is compared with stay as they are.
"""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mros1_reasoner.knowledge.model import Quality


class Violations:
    """The levels of the last seconds."""

    def __init__(self, qualities: Mapping[str, Quality], limits: Mapping[str, float], window: float) -> None:
        """Know nothing yet.

        Args:
            qualities: how levels compare.
            limits: what each quality must keep.
            window: over which levels are averaged, s.
        """
        self._qualities, self._limits, self._window = qualities, limits, window
        self._levels: dict[str, list[tuple[float, float]]] = {}

    def observe(self, now: float, quality: str, level: float) -> None:
        """Take in a level."""
        if quality in self._limits:
            levels = self._levels.setdefault(quality, [])
            levels.append((now, level))
            while len(levels) > 1 and levels[1][0] <= now - self._window:
                del levels[0]

    def forget(self, quality: str = "") -> None:
        """Forget the levels of a quality; of all where none is named."""
        for name in [quality] if quality else list(self._levels):
            self._levels.pop(name, None)

    def found(self, now: float) -> list[str]:
        """Return the qualities whose mean level violates the limit, once levels cover the window, worst first."""
        means = {
            name: statistics.fmean(level for _, level in levels)
            for name, levels in self._levels.items()
            if levels[0][0] <= now - self._window
        }
        violated = [name for name, mean in means.items() if self._qualities[name].violates(mean, self._limits[name])]
        return sorted(violated, key=lambda name: (-self._share(name, means[name]), name))

    def _share(self, name: str, level: float) -> float:
        """Return by how much a level passes the limit, as a share of the limit."""
        limit = self._limits[name]
        return self._qualities[name].excess(level, limit) / (abs(limit) or 1.0)
