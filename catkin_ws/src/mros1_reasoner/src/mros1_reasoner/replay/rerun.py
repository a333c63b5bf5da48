"""Runs the same core over the journal of a bag, with other parameters, to see what it would decide.

While its decisions equal the recorded ones, it follows the recording. Once they differ, the recorded acts of the
manipulator are no longer valid. From then on, each request counts as carried out after the usual time, while levels and
components stay as they were observed.
"""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from metacontrol_bags.decision import DECIDED, EXECUTED, PROPOSED, Decision

from mros1_reasoner.loop import journal
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.entries import ActiveFact, Approve, Decided, Entry, Reject, Released, Result, Step
from mros1_reasoner.loop.entry_text import kind_of
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.replay.recording import Recording

DEFAULT_DURATION = 1.0  # s of ROS time, of a reconfiguration, where the bag has none
_CAME_OF_DECISIONS = ActiveFact | Result | Released | Approve | Reject | Decided  # tells what was done then


@dataclass(frozen=True)
class Replayed:
    """The result of a replay.

    Attributes:
        decisions: as they were made, with the moment in s of ROS time.
        parted: when the replay first decided otherwise than recorded, None where it never did.
        remarks: entries that did not fit, in words.
    """

    decisions: tuple[tuple[float, Decision], ...]
    parted: float | None
    remarks: tuple[str, ...]


def rerun(core: Mape, entries: Sequence[Entry], duration: float = DEFAULT_DURATION, *, follow: bool = True) -> Replayed:
    """Apply the entries of a journal to a loop.

    Args:
        core: a new loop; its decisions' ids begin as the recorded ones.
        entries: of the journal, in order.
        duration: of a reconfiguration, s, once the replay goes its own way.
        follow: the entries tell what was decided and how it went; otherwise the replay goes its own way from the start.

    Raises:
        ReasonerError: an analysis failed.
    """
    return _Rerun(core, duration, follow).run(entries)


class _Rerun:
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
            elif self._parted is None or not isinstance(item.content, _CAME_OF_DECISIONS):
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
        """Approve a proposed decision; carry out a decision after a while."""
        for decision in decisions:
            if decision.state == PROPOSED:
                self._go_on_with(self._apply(Entry(self._now, Approve(decision.id))))
        pending = self._core.pending
        if pending is not None and (self._request is None or self._request[1] != pending.id):
            self._request = self._now + self._duration, pending.id

    def _advance(self, until: float) -> None:
        """Do what happens by itself before the next entry."""
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
    """Return objective and configuration of the decision to which an entry led."""
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
    """Make a journal from diagnostics, for a bag that has none and a replay without `follow`.

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
