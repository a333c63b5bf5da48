"""Observed levels of qualities: whether they keep their limits, and how they compare with the expected ones.

Each level is judged by the *high level*: the quantile that the next levels will not pass (`loop.estimate`). Where the
model tells a usual level beside the expected one, the high level is at least the expected level, changed as the usual
one is known to have changed: rare peaks need not be waited for.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from mros1_reasoner.knowledge.scale import Correction, Scale
from mros1_reasoner.loop.estimate import estimate, rank_below_median

Key = tuple[str, str]  # objective, quality

_USUAL = 10  # levels by which the usual one is judged


@dataclass(frozen=True)
class Judging:
    """How levels are judged.

    Attributes:
        history: how many levels are judged together.
        confidence: the quantile of the next levels that must keep the limit.
        horizon: how far a trend is followed, s.
        window: after which time a violation counts, however few levels there are, s.
        timeout: how long a level is valid, s.
        memory: time constant by which corrections fade that nothing confirms, s.
        relief: share by which a level must have become better before the cause of a violation is gone.
        most: the greatest correction that is plausible, a factor.
    """

    history: int = 5
    confidence: float = 0.95
    horizon: float = 0.1
    window: float = 2.0
    timeout: float = 5.0
    memory: float = 30.0
    relief: float = 0.2
    most: float = 2.5


@dataclass(frozen=True)
class Expectation:
    """What a level is compared with.

    Attributes:
        scale: of the quality.
        limit: that the level must keep; None where there is none.
        reaching_violates: whether the limit itself is too much.
        expected: level that is expected of the deployed design; on a ratio scale, it is positive.
        typical: the usual level that is expected of it, where the expected one is a high quantile; likewise.
        better: the best level that is expected of any design that is more useful than the deployed one.
        group: of designs that are corrected together, in which the deployed one is.
        low: the least possible level.
        high: the greatest possible level.
    """

    scale: Scale = field(default_factory=Scale)
    limit: float | None = None
    reaching_violates: bool = False
    expected: float | None = None
    typical: float | None = None
    better: float | None = None
    group: str = ""
    low: float = -math.inf
    high: float = math.inf

    def violates(self, level: float) -> bool:
        """Return whether a level violates the limit."""
        if self.limit is None:
            return False
        excess = self.scale.direction.excess(level, self.limit)
        return excess > 0.0 or (self.reaching_violates and excess == 0.0)


@dataclass(frozen=True)
class Level:
    """The last level of a quality of an objective.

    Attributes:
        value: the level.
        stamp: when it was taken in, s.
        high: the level that the next ones will not pass.
        history: (time, level) of the last ones.
        passed_since: since when the high level has violated the limit without a break.
        strain: the level by the expected one; None where nothing is expected, or too little is known.
        group: of designs that are corrected together, in which the deployed one is.
    """

    value: float
    stamp: float
    high: float
    history: tuple[tuple[float, float], ...]
    passed_since: float | None = None
    strain: Correction | None = None
    group: str = ""


@dataclass(frozen=True)
class _Strain:
    """How observed levels compared with expected ones, when, and for which group of designs."""

    value: Correction
    stamp: float
    group: str = ""


@dataclass(frozen=True)
class _Blame:
    """What a design was left for.

    Attributes:
        strain: how observed levels compared with expected ones then.
        group: of designs that are corrected together, in which it was.
        gone_since: since when they have been better by the relief, without a break.
    """

    strain: Correction
    group: str = ""
    gone_since: float | None = None


class Levels:
    """The last levels of each quality; times are s of ROS time."""

    def __init__(self, judging: Judging | None = None) -> None:
        """Know nothing yet."""
        self._judging = judging or Judging()
        self._z = statistics.NormalDist().inv_cdf(self._judging.confidence)
        self._levels: dict[Key, Level] = {}
        self._strains: dict[tuple[Key, str], _Strain] = {}
        self._blames: dict[Key, _Blame] = {}
        self._usual: dict[Key, tuple[_Strain, ...]] = {}

    def __getitem__(self, key: Key) -> Level:
        return self._levels[key]

    def observe(self, now: float, key: Key, value: float, against: Expectation, *, stamp: float = 0.0) -> None:
        """Take in a level.

        Args:
            now: present time.
            key: objective and quality.
            value: the level.
            against: what it is compared with.
            stamp: of the diagnostic that brought it, 0 where it has none.
        """
        before = self._levels.get(key)
        known = before if before and now - before.stamp <= self._judging.timeout else None
        history = (*(known.history if known else ()), (now, value))[-self._judging.history :]
        usual = self._usual_with(now, key, value, against, is_first=known is None)
        self._usual[key] = usual
        high = self._high(history, usual, against)
        is_known = against.typical is None or len(usual) >= _USUAL or against.violates(high)
        strain = against.scale.strain(high, against.expected) if against.expected is not None and is_known else None
        since = known.passed_since if known and known.passed_since is not None else stamp or now
        passed = since if against.violates(high) else None
        self._levels[key] = Level(value, now, high, history, passed, strain, against.group)
        if strain is not None and self._tells(self._levels[key]):
            self._strains[key, against.group] = _Strain(strain, now)
            self._relieve(now, key, against)

    def usual(self, key: Key) -> float:
        """Return the median of the last levels."""
        return statistics.median(level for _, level in self._levels[key].history)

    def forget(self, objective: str = "", quality: str = "") -> None:
        """Forget levels, but keep how they compared with the expected ones.

        Args:
            objective: whose levels; empty: of all.
            quality: levels of which quality; empty: of all.
        """
        for key in [k for k in self._levels if objective in ("", k[0]) and quality in ("", k[1])]:
            del self._levels[key]
            if quality:
                self._usual.pop(key, None)
            if key in self._blames:
                self._blames[key] = replace(self._blames[key], gone_since=None)

    def drop(self, objective: str) -> None:
        """Forget everything about an objective."""
        self._levels = {key: level for key, level in self._levels.items() if key[0] != objective}
        self._strains = {place: strain for place, strain in self._strains.items() if place[0][0] != objective}
        self._blames = {key: blame for key, blame in self._blames.items() if key[0] != objective}
        self._usual = {key: strains for key, strains in self._usual.items() if key[0] != objective}

    def present(self, now: float) -> dict[Key, float]:
        """Return the levels that are valid, as they were observed."""
        return {key: level.value for key, level in self._levels.items() if self._is_valid(level, now)}

    def violations(self, now: float, calm_until: Mapping[str, float]) -> frozenset[Key]:
        """Return what violates its limit, so that it counts.

        Args:
            now: present time.
            calm_until: until when no limit of an objective counts.
        """
        found = (key for key, level in self._levels.items() if self._counts(level, now))
        return frozenset(key for key in found if now >= calm_until[key[0]])

    def high(self, now: float, objective: str) -> dict[str, float]:
        """Return the high level of each quality of an objective of which enough is known."""
        return {
            quality: level.high
            for (name, quality), level in self._levels.items()
            if name == objective and (self._tells(level) or self._counts(level, now))
        }

    def strain(self, now: float, key: Key, group: str = "", *, fades: bool = False) -> Correction | None:
        """Return how observed levels compare with expected ones; None if it is unknown.

        Args:
            now: present time.
            key: objective and quality.
            group: of designs that are corrected together.
            fades: nobody observes the group now: what was observed counts less and less.
        """
        level = self._levels.get(key)
        if level and level.group == group and level.strain and self._counts(level, now):
            return level.strain
        known = self._strains.get((key, group))
        if known is None or not fades:
            return known.value if known else None
        memory = self._judging.memory
        return known.value.faded(1.0 - math.exp((known.stamp - now) / memory) if memory > 0 else 1.0)

    def groups(self, key: Key) -> list[str]:
        """Return the groups of which something was observed."""
        found = {group: None for known, group in self._strains if known == key}
        level = self._levels.get(key)
        return list({**found, level.group: None} if level and level.strain else found)

    # What a design was left for

    def blame(self, now: float, key: Key) -> None:
        """Note that a design is left because of a quality."""
        level = self._levels.get(key)
        strain = self.strain(now, key, level.group) if level else None
        if level and strain is not None:
            self._blames[key] = _Blame(strain, level.group)

    def restore(self, key: Key, strain: Correction, group: str) -> None:
        """Note that a design of a group was left because of a quality, when levels compared so with expected ones."""
        self._blames[key] = _Blame(strain, group)

    def blames(self, objective: str) -> dict[str, tuple[Correction, str]]:
        """Return for which qualities designs of an objective were left, with what `restore` takes."""
        return {key[1]: (blame.strain, blame.group) for key, blame in self._blames.items() if key[0] == objective}

    def with_blames(self) -> list[str]:
        """Return the objectives of which designs were left because of a quality; some may come into being later."""
        return list(dict.fromkeys(objective for objective, _ in self._blames))

    def acquit(self, objective: str) -> None:
        """Forget what designs of an objective were left for."""
        self._blames = {key: blame for key, blame in self._blames.items() if key[0] != objective}

    def blamed(self, objective: str) -> tuple[str, ...]:
        """Return the qualities for which designs of an objective were left."""
        return tuple(sorted(quality for name, quality in self._blames if name == objective))

    def gone_since(self, now: float, objective: str) -> float | None:
        """Return since when all causes for which designs of an objective were left have been gone; None: not so."""
        moments = []
        for key, blame in self._blames.items():
            if key[0] == objective:
                level = self._levels.get(key)
                moments.append(blame.gone_since if level and self._is_valid(level, now) else None)
        known = [moment for moment in moments if moment is not None]
        return max(known) if known and len(known) == len(moments) else None

    def due(self, calm_until: Mapping[str, float]) -> Iterator[float]:
        """Yield the times at which a level begins or stops to count."""
        for (objective, _), level in self._levels.items():
            if level.passed_since is not None:
                yield max(level.passed_since + self._judging.window, calm_until[objective])
                yield calm_until[objective]
            yield level.stamp + self._judging.timeout

    # Parts

    def _usual_with(
        self, now: float, key: Key, value: float, against: Expectation, *, is_first: bool
    ) -> tuple[_Strain, ...]:
        """Return how the last levels compare with the usual ones, whatever design they are of, with a new one.

        The first level of a design is in part that of the one before it, and tells nothing.
        """
        if against.typical is None:
            return ()
        before = self._usual.get(key, ())
        if before and (now - before[-1].stamp > self._judging.timeout or before[-1].group != against.group):
            before = ()
        if is_first and before:
            return before
        return (*before, _Strain(against.scale.strain(value, against.typical), now, against.group))[-_USUAL:]

    def _high(self, history: Sequence[tuple[float, float]], usual: Sequence[_Strain], against: Expectation) -> float:
        sign = against.scale.direction.sign
        seen = estimate(history)
        worse = seen.slope * self._judging.horizon if sign * seen.slope > 0.0 else 0.0
        bound = seen.level + worse + sign * self._z * seen.scatter
        if against.expected is not None and len(usual) >= _USUAL:
            # A lasting cause worsens the better moments, too; a stretch of bad moments leaves some as they were.
            rank = rank_below_median(len(usual), self._judging.confidence)
            lasting = sorted(sign * strain.value.apply(against.expected) for strain in usual)[rank]
            bound = sign * max(sign * bound, lasting)
        return min(max(bound, against.low), against.high)

    def _relieve(self, now: float, key: Key, against: Expectation) -> None:
        """Note whether the cause for which a design was left is gone; what nobody observes fades."""
        blame = self._blames.get(key)
        fades = blame is not None and blame.group != against.group
        strain = self.strain(now, key, blame.group, fades=fades) if blame else None
        if blame and strain:
            if against.typical is None:
                # Better by a share than nothing is anything: what fades has to come back to what is plausible first.
                before, after = blame.strain, strain
                if fades:
                    before, after = (against.scale.bounded(found, self._judging.most) for found in (before, after))
                is_gone = against.scale.is_relieved(before, after, self._judging.relief)
            else:
                is_gone = self._permits_better(self._usual[key], against)
            since = blame.gone_since if blame.gone_since is not None else now
            self._blames[key] = replace(blame, gone_since=since if is_gone else None)

    def _permits_better(self, usual: Sequence[_Strain], against: Expectation) -> bool:
        """Return whether a more useful design would keep the limit now, by what the usual level has become."""
        if against.better is None or len(usual) < _USUAL:
            return False
        bounded = (against.scale.bounded(strain.value, math.inf) for strain in usual)
        better = against.better
        return not against.violates(statistics.median(strain.apply(better) for strain in bounded))

    def _is_valid(self, level: Level, now: float) -> bool:
        return now - level.stamp <= self._judging.timeout

    def _tells(self, level: Level) -> bool:
        """Return whether most of the levels are there that are judged together."""
        return len(level.history) >= (self._judging.history + 1) // 2

    def _counts(self, level: Level, now: float) -> bool:
        if level.passed_since is None or not self._is_valid(level, now):
            return False
        return self._tells(level) or now - level.passed_since >= self._judging.window
