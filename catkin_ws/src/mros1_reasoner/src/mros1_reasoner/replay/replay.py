"""What the loop would decide on a recorded run, pure: the same core over the journal of a bag, with other parameters.

As long as it decides what was decided then, it takes in what was recorded. From where it decides otherwise, what the
manipulator did then no longer tells anything: each request is taken for carried out after the usual time, while levels
and components stay those that were observed then.
"""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, fields

from metacontrol_bags.decision import DECIDED, EXECUTED, PROPOSED, Decision

from mros1_reasoner.io.recording import Recording
from mros1_reasoner.loop import journal
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.entries import ActiveFact, Approve, Decided, Entry, Reject, Result, Step
from mros1_reasoner.loop.entry_text import kind_of
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.view import MapeError

DEFAULT_DURATION = 1.0  # s of ROS time, of a reconfiguration, where the bag has none
_SAME_MOMENT = 2.0  # s of ROS time between decisions that are taken for the same
_OF_THE_MANIPULATOR = ActiveFact | Result | Approve | Reject | Decided
_NOT_COMPARED = (  # what depends on when and how fast it is computed
    "id",
    "stamp",
    "stamp_monitored",
    "reasons",
    "stamp_analysed",
    "stamp_planned",
    "stamp_executed",
    "analyse_wall_s",
    "plan_wall_s",
    "execute_wall_s",
)


@dataclass(frozen=True)
class Replayed:
    """What a replay has brought.

    Attributes:
        decisions: as they were made, with the moment in s of ROS time.
        parted: when the replay first decided otherwise than recorded, None where it never did.
        remarks: entries that did not fit, in words.
    """

    decisions: tuple[tuple[float, Decision], ...]
    parted: float | None
    remarks: tuple[str, ...]


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


def replay(
    core: Mape, entries: Sequence[Entry], duration: float = DEFAULT_DURATION, *, follow: bool = True
) -> Replayed:
    """Have a loop take in the entries of a journal.

    Args:
        core: a new loop; its decisions' ids begin as the recorded ones.
        entries: of the journal, in order.
        duration: of a reconfiguration, s, once the replay goes its own way.
        follow: the entries tell what was decided and how it went; otherwise the replay goes its own way from the start.

    Raises:
        ReasonerError: an analysis failed.
    """
    return _Replay(core, duration, follow).run(entries)


class _Replay:
    def __init__(self, core: Mape, duration: float, follow: bool) -> None:
        self._core = core
        self._duration = duration
        self._decisions: list[tuple[float, Decision]] = []
        self._remarks: list[str] = []
        self._is_free = not follow
        self._parted: float | None = None
        self._request: tuple[float, str] | None = None  # when the pending one is carried out, and its id
        self._now = 0.0

    def run(self, entries: Sequence[Entry]) -> Replayed:
        for index, item in enumerate(entries):
            if not self._is_free:
                self._now = item.now
                decisions = self._apply(item)
                if _targets(decisions) != _brought(entries, index):
                    self._is_free, self._parted = True, item.now
                    self._go_on_with(decisions)
            elif self._parted is None or not isinstance(item.content, _OF_THE_MANIPULATOR):
                self._advance(item.now)
                self._now = item.now
                self._go_on_with(self._apply(item))
        return Replayed(tuple(self._decisions), self._parted, tuple(self._remarks))

    def _apply(self, item: Entry) -> list[Decision]:
        try:
            decisions = journal.apply(self._core, item)
        except MapeError as error:
            self._remarks.append(f"{item.now:.3f} s: {kind_of(item.content)}: {error}")
            return []
        self._decisions += [(item.now, decision) for decision in decisions]
        return decisions

    def _go_on_with(self, decisions: list[Decision]) -> None:
        """Approve what is proposed, and have what is decided carried out after a while."""
        for decision in decisions:
            if decision.state == PROPOSED:
                self._go_on_with(self._apply(Entry(self._now, Approve(decision.id))))
        pending = self._core.pending
        if pending is not None and (self._request is None or self._request[1] != pending.id):
            self._request = self._now + self._duration, pending.id

    def _advance(self, until: float) -> None:
        """Bring about what happens by itself before the next entry."""
        while True:
            due = self._core.due(self._now)
            carried_out = self._request[0] if self._request else None
            moments = [moment for moment in (due, carried_out) if moment is not None and moment <= until]
            if not moments:
                return
            self._now = max(self._now, min(moments))
            if self._request and self._request[0] <= self._now:
                (_, decision), self._request = self._request, None
                self._apply(Entry(self._now, Result(decision, ok=True)))
            self._go_on_with(self._apply(Entry(self._now, Step(heartbeat=False))))


def _targets(decisions: Sequence[Decision]) -> list[tuple[str, str]]:
    return [(d.objective, d.to_configuration) for d in decisions if d.state in (DECIDED, PROPOSED)]


def _brought(entries: Sequence[Entry], index: int) -> list[tuple[str, str]]:
    """Return objective and configuration of what an entry has brought then."""
    if isinstance(entries[index].content, Decided):
        return []
    found = []
    for item in itertools.islice(entries, index + 1, None):
        if not isinstance(item.content, Decided):
            break
        found.append((item.content.objective, item.content.configuration))
    return found


def usual_duration(decisions: Sequence[tuple[float, Decision]]) -> float:
    """Return the median duration of the reconfigurations in a bag, s of ROS time."""
    durations = [d.stamp_executed - d.stamp_planned for _, d in decisions if d.state == EXECUTED]
    return statistics.median(durations) if durations else DEFAULT_DURATION


def without_journal(
    recording: Recording, reader: DiagnosticsReader, initial: Sequence[tuple[float, ActiveFact]] = ()
) -> list[Entry]:
    """Make a journal, for a replay without `follow`, of the diagnostics that a bag without one holds.

    Args:
        recording: of the bag.
        reader: of its diagnostics.
        initial: what ran at its beginning; else as the bag tells.
    """
    first: dict[str, tuple[float, ActiveFact]] = {}
    for now, fact in (*initial, *recording.active):
        first.setdefault(fact.function, (now, fact))
    entries = [Entry(now, fact) for now, fact in first.values()]
    for array in recording.diagnostics:
        entries += [Entry(array.now, fact) for fact in reader.read(array.statuses, array.stamp).facts]
    entries.sort(key=lambda item: item.now)
    return [step for item in entries for step in (item, Entry(item.now, Step(heartbeat=True)))]


def pairs(recording: Recording, replayed: Replayed) -> list[Pair]:
    """Put each recorded decision beside the replayed one of the same time, in the order of time.

    Those that do the same are put together first, then those that have the same reason.
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
