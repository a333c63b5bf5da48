"""Repairs of components: which of them may begin, which are under way, and how those before have gone.

Times are s of ROS time.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from metacontrol_bags.decision import Decision

from mros1_reasoner.knowledge.model import Repair
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.planning.repairing import Odds

_PATIENCE = 2.0  # times the usual duration, after which a repair has failed
_AS_MANY = 2.0  # repairs, for which the model's share of success counts beside those that were seen


@dataclass(frozen=True)
class UnderWay:
    """A repair that is under way.

    Attributes:
        decision: by which it has begun.
        since: when it has begun.
        until: when it has failed if the component does not work by then.
        wall: wall time at which it has begun, s.
    """

    decision: Decision
    since: float
    until: float
    wall: float


@dataclass(frozen=True)
class _Record:
    """What is known of a component's repairs.

    Attributes:
        tried: how many in a row have not led to a component that works for long.
        succeeded: how many have, of all.
        failed: how many have not, of all.
        in_vain: how many in a row could not be tried.
        not_before: none begins before.
        works_since: when it worked again last; -inf where that is not known.
    """

    tried: int = 0
    succeeded: int = 0
    failed: int = 0
    in_vain: int = 0
    not_before: float = -math.inf
    works_since: float = -math.inf


class Repairs:
    """The repairs of all components that can be repaired."""

    def __init__(self, known: Mapping[str, Repair], settings: Settings) -> None:
        """Know how components are repaired, by their names."""
        self._known = dict(known) if settings.repairs else {}
        self._settings = settings
        self._records = {component: _Record() for component in self._known}
        self._under_way: dict[str, UnderWay] = {}

    def may_begin(self, component: str, now: float) -> bool:
        """Return whether a repair of a component that does not work may begin now."""
        return self._is_left(component) and now >= self._records[component].not_before

    def is_under_way(self, component: str) -> bool:
        """Return whether a component is being repaired."""
        return component in self._under_way

    def begun_by(self, decision: str) -> UnderWay | None:
        """Return the repair that is under way by the decision of that id; None if none is."""
        return next((repair for repair in self._under_way.values() if repair.decision.id == decision), None)

    def odds(self, components: Iterable[str], now: float) -> Odds:
        """Return what to expect of repairs of components: those under way, and those that begin now.

        The share of success of the model counts like two repairs beside those that were seen.
        """
        duration, success = 0.0, 1.0
        for component in components:
            known, record, under_way = self._known[component], self._records[component], self._under_way.get(component)
            left = known.duration if under_way is None else max(0.0, under_way.since + known.duration - now)
            duration = max(duration, left)
            seen = record.succeeded + record.failed
            success *= (_AS_MANY * known.success + record.succeeded) / (_AS_MANY + seen)
        return Odds(duration, success)

    def attempt(self, component: str) -> str:
        """Return which attempt the next repair of a component is, in words."""
        return f"attempt {self._records[component].tried + 1} of {self._known[component].attempts}"

    def begin(self, now: float, decision: Decision, wall: float) -> None:
        """Note that the component of a decision is repaired from now on."""
        known, record = self._known[decision.repair], self._records[decision.repair]
        until = now + _PATIENCE * known.duration + self._settings.restart_grace
        self._under_way[decision.repair] = UnderWay(decision, now, until, wall)
        self._records[decision.repair] = replace(record, tried=record.tried + 1)

    def note(self, now: float, component: str, *, works: bool) -> None:
        """Note that a component works again, or no longer works."""
        record = self._records.get(component)
        if record is None:
            return
        if works:
            is_repaired = component in self._under_way
            self._records[component] = replace(record, works_since=now, tried=record.tried if is_repaired else 0)
        elif now - record.works_since >= self._settings.error_log_expiry and component not in self._under_way:
            self._records[component] = replace(record, tried=0)

    def ended(self, now: float, failed: Collection[str]) -> list[tuple[UnderWay, str]]:
        """End the repairs whose components work, and those that take too long; return them and why they have failed.

        Args:
            now: present time.
            failed: components that do not work.
        """
        found = []
        for component, repair in list(self._under_way.items()):
            if component not in failed:
                del self._under_way[component]
                record = self._records[component]
                self._records[component] = replace(record, succeeded=record.succeeded + 1, in_vain=0)
                found.append((repair, ""))
            elif now >= repair.until:
                why = f"{component} does not work after {now - repair.since:.1f} s"
                found.append((self.fail(now, component), why))
        return found

    def fail(self, now: float, component: str, *, counts: bool = True) -> UnderWay:
        """End a repair that is under way and has failed; where it could not be tried, it does not count as one."""
        record = self._records[component]
        wait = self._settings.wait_after(max(0, record.tried - 1) if counts else record.in_vain)
        self._records[component] = replace(
            record,
            tried=record.tried - (not counts),
            failed=record.failed + counts,
            in_vain=0 if counts else record.in_vain + 1,
            not_before=now + wait,
        )
        return self._under_way.pop(component)

    def refuse(self, now: float, component: str) -> None:
        """Have no repair of a component begin until the error log forgets that the operator has rejected it."""
        not_before = now + self._settings.error_log_expiry
        self._records[component] = replace(self._records[component], not_before=not_before)

    def what_counts(self, now: float) -> tuple[tuple[bool, bool], ...]:
        """Return all that a decision depends on."""
        return tuple((self.may_begin(name, now), name in self._under_way) for name in self._known)

    def due(self) -> list[float]:
        """Return the moments at which a step is needed."""
        waits = [record.not_before for name, record in self._records.items() if self._is_left(name)]
        return [*waits, *(repair.until for repair in self._under_way.values())]

    def _is_left(self, component: str) -> bool:
        known = self._known.get(component)
        return (
            known is not None and component not in self._under_way and self._records[component].tried < known.attempts
        )
