"""Observed levels of qualities: since when they violate a limit, and their ratio to expected levels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

Key = tuple[str, str]  # objective, quality


@dataclass(frozen=True)
class Level:
    """The last level of a quality of an objective.

    Attributes:
        value: the level.
        stamp: when it was taken in, s.
        last_good: the last level that kept the limit.
        passed_since: since when the limit has been passed without a break.
        count: levels since then whose ratio to the expected one is known.
        ratios: sum of those ratios.
        group: of designs that are corrected together, in which the deployed one is.
    """

    value: float
    stamp: float
    last_good: float | None = None
    passed_since: float | None = None
    count: int = 0
    ratios: float = 0.0
    group: str = ""


@dataclass(frozen=True)
class _Ratio:
    value: float
    stamp: float


class Levels:
    """The last level of each quality, and its average ratio to the expected one; times are s of ROS time."""

    def __init__(self, window: float, timeout: float, memory: float) -> None:
        """Know nothing yet.

        Args:
            window: how long a limit must be violated before it counts.
            timeout: how long a level is valid.
            memory: time constant of the average ratio of observed to expected levels.
        """
        self._window, self._timeout, self._memory = window, timeout, memory
        self._levels: dict[Key, Level] = {}
        self._ratios: dict[tuple[Key, str], _Ratio] = {}

    def __getitem__(self, key: Key) -> Level:
        return self._levels[key]

    def observe(
        self,
        now: float,
        key: Key,
        value: float,
        *,
        passed: bool,
        stamp: float,
        expected: float | None,
        group: str = "",
    ) -> None:
        """Take in a level.

        Args:
            now: present time.
            key: objective and quality.
            value: the level.
            passed: whether it passes the limit.
            stamp: of the diagnostic that brought it, 0 where it has none.
            expected: level that is expected of the deployed design.
            group: of designs that are corrected together, in which the deployed one is.
        """
        before = self._levels.get(key)
        known = before if before and now - before.stamp <= self._timeout else None
        ratio = value / expected if expected else None
        if ratio is not None:
            self._average(now, (key, group), ratio)
        if not passed:
            self._levels[key] = Level(value, now, last_good=value, group=group)
            return
        goes_on = known if known and known.passed_since is not None else None
        self._levels[key] = Level(
            value,
            now,
            last_good=known.last_good if known else None,
            passed_since=goes_on.passed_since if goes_on else stamp or now,
            count=(goes_on.count if goes_on else 0) + (ratio is not None),
            ratios=(goes_on.ratios if goes_on else 0.0) + (ratio or 0.0),
            group=group,
        )

    def forget(self, objective: str = "", quality: str = "", now: float | None = None) -> None:
        """Forget levels, but keep how they compared with the expected ones.

        Args:
            objective: whose levels; empty: of all.
            quality: levels of which quality; empty: of all.
            now: present time; None: that of the levels.
        """
        for key in [k for k in self._levels if objective in ("", k[0]) and quality in ("", k[1])]:
            stamp, group = self._levels[key].stamp, self._levels[key].group
            ratio = self.ratio(stamp if now is None else now, key, group)
            if ratio is not None:
                self._ratios[key, group] = _Ratio(ratio, stamp)
            del self._levels[key]

    def drop(self, objective: str) -> None:
        """Forget everything about an objective."""
        self._levels = {key: level for key, level in self._levels.items() if key[0] != objective}
        self._ratios = {place: ratio for place, ratio in self._ratios.items() if place[0][0] != objective}

    def counting(self, now: float, calm_until: Mapping[str, float]) -> dict[Key, float]:
        """Return the levels that count.

        A level that violates its limit counts after it has done so for the violation window, and after the cool-down.
        Until then, the last level that kept the limit counts.
        """
        found = {}
        for key, level in self._levels.items():
            if now - level.stamp > self._timeout:
                continue
            if level.passed_since is None or (self._counts(level, now) and now >= calm_until[key[0]]):
                found[key] = level.value
            elif level.last_good is not None:
                found[key] = level.last_good
        return found

    def latest(self, objective: str) -> dict[str, float]:
        """Return the last level of each quality of an objective."""
        return {quality: level.value for (name, quality), level in self._levels.items() if name == objective}

    def ratio(self, now: float, key: Key, group: str = "", *, fades: bool = False) -> float | None:
        """Return the ratio of observed to expected level; None if it is unknown.

        Once the limit has been violated for the window, it is the mean since then; before that, the average.

        Args:
            now: present time.
            key: objective and quality.
            group: of designs that are corrected together.
            fades: nobody observes the group now: what was observed counts less and less.
        """
        level = self._levels.get(key)
        if level and level.group == group and level.count and self._counts(level, now):
            return level.ratios / level.count
        average = self._ratios.get((key, group))
        if average is None or not fades:
            return average.value if average else None
        return 1.0 + (average.value - 1.0) * (1.0 - self._weight(now - average.stamp))

    def groups(self, key: Key) -> list[str]:
        """Return the groups of which something was observed."""
        return [group for known, group in self._ratios if known == key]

    def due(self, calm_until: Mapping[str, float]) -> Iterator[float]:
        """Yield the times at which a level begins or stops to count."""
        for (objective, _), level in self._levels.items():
            if level.passed_since is not None:
                yield max(level.passed_since + self._window, calm_until[objective])
            yield level.stamp + self._timeout

    def _counts(self, level: Level, now: float) -> bool:
        return level.passed_since is not None and now - level.passed_since >= self._window

    def _average(self, now: float, place: tuple[Key, str], ratio: float) -> None:
        before = self._ratios.get(place) or _Ratio(1.0, now)
        weight = self._weight(min(max(0.0, now - before.stamp), self._timeout))
        self._ratios[place] = _Ratio(before.value + weight * (ratio - before.value), now)

    def _weight(self, passed: float) -> float:
        """Return how much of what was observed some seconds ago is forgotten."""
        return 1.0 - math.exp(-passed / self._memory) if self._memory > 0 else 1.0
