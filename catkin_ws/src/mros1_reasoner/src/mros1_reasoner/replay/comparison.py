"""Compares recorded decisions with those of a replay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

from metacontrol_bags.decision import EXECUTED, Decision

from mros1_reasoner.replay.recording import Recording
from mros1_reasoner.replay.rerun import Replayed

_SAME_MOMENT = 2.0  # s of ROS time between decisions that are taken for the same
_NOT_COMPARED = (  # what depends on when and how fast it is computed
    "id",
    "stamp",
    "stamp_monitored",
    "reasons",
    "repair",  # no message has it
    "stamp_analysed",
    "stamp_planned",
    "stamp_executed",
    "analyse_wall_s",
    "plan_wall_s",
    "execute_wall_s",
)


@dataclass(frozen=True)
class Pair:
    """A recorded decision beside a replayed one; one of them may be missing.

    Attributes:
        now: when, s of ROS time.
        differences: names of the fields that differ; empty where both are there and equal.
    """

    now: float
    recorded: Decision | None
    replayed: Decision | None
    differences: tuple[str, ...] = ()

    @property
    def is_equal(self) -> bool:
        """Whether the replay has decided as recorded."""
        return self.recorded is not None and self.replayed is not None and not self.differences


def pairs(recording: Recording, replayed: Replayed) -> list[Pair]:
    """Pair each recorded decision with the replayed one of the same time, in the order of time.

    Decisions that do the same are paired first, then those with the same reason.
    """
    recorded = [record for _, record in first_messages(recording.decisions) if record.state != EXECUTED]
    own = [record for _, record in first_messages(replayed.decisions)]
    beside: dict[str, Decision] = {}
    for alike in (("objective", "to_configuration"), ("objective", "trigger")):
        for record in recorded:
            match = next((other for other in own if _is_same(record, other, alike)), None)
            if match is not None and record.id not in beside:
                own.remove(match)
                beside[record.id] = match
    found = [
        Pair(record.stamp_planned, record, match, _differences(record, match) if match else ())
        for record, match in ((record, beside.get(record.id)) for record in recorded)
    ]
    found += [Pair(record.stamp_planned, None, record) for record in own if record.stamp_planned >= recording.start]
    return sorted(found, key=lambda pair: pair.now)


def first_messages(decisions: Sequence[tuple[float, Decision]]) -> list[tuple[float, Decision]]:
    """Return the first message about each decision."""
    first: dict[str, tuple[float, Decision]] = {}
    for now, record in decisions:
        first.setdefault(record.id, (now, record))
    return list(first.values())


def _is_same(first: Decision, second: Decision, alike: Sequence[str]) -> bool:
    are_alike = all(getattr(first, name) == getattr(second, name) for name in alike)
    return are_alike and abs(first.stamp_planned - second.stamp_planned) <= _SAME_MOMENT


def _differences(first: Decision, second: Decision) -> tuple[str, ...]:
    names = [item.name for item in fields(Decision) if item.name not in _NOT_COMPARED]
    return tuple(name for name in names if getattr(first, name) != getattr(second, name))
