"""Follows a reasoner by its journal, and tells what it would do: nothing of that is carried out.

A shadow is a loop that takes in what the followed one has taken in. So it knows what that one knows, and a copy of it
tells what the reasoner would decide if something else happened now.
"""

from __future__ import annotations

import copy
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from metacontrol_bags.decision import Decision

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.loop import journal
from mros1_reasoner.loop.asked import carry_out
from mros1_reasoner.loop.entries import Approve, ComponentFact, Decided, Entry, Reject, Result, SetNfr, Step
from mros1_reasoner.loop.entry_text import kind_of
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError, View

_PERIOD = 0.25  # s of ROS time between two looks of a copy
_LONGEST = 30.0  # s of ROS time for which a copy looks
_KEPT_REMARKS = 20


@dataclass(frozen=True)
class Supposed:
    """What a reasoner would do.

    Attributes:
        after: s of ROS time until it would decide; how long it was waited for where it would not.
        decisions: what it would publish then; none: it would leave all as it is.
        note: what is to know about that, in words.
    """

    after: float
    decisions: tuple[Decision, ...]
    note: str = ""


class Shadow:
    """A loop that follows another one.

    Attributes:
        remarks: the last entries that did not fit, in words: the shadow may differ from the reasoner since.
    """

    def __init__(self, core: Mape, knowledge_base: KnowledgeBase, reasoner: Reasoner) -> None:
        """Follow from the beginning.

        Args:
            core: a new loop, as the followed one was at its start.
            knowledge_base: of the loop.
            reasoner: that it analyses with.
        """
        self._core, self._kb, self._reasoner = core, knowledge_base, reasoner
        self._own: list[Decision] = []  # decisions of the last step, for which the recorded ids follow
        self._ids: dict[str, str] = {}  # own id by the recorded one
        self.remarks: list[str] = []

    @property
    def view(self) -> View:
        """What the loop knows, for reading only."""
        return self._core.view

    def follow(self, entries: Iterable[Entry]) -> None:
        """Take in entries of the journal, in their order.

        Raises:
            ReasonerError: an analysis failed.
        """
        for entry in entries:
            if isinstance(entry.content, Decided):
                self._note_id(entry.content)
                continue
            try:
                decisions = journal.apply(self._core, self._with_own_id(entry))
            except MapeError as error:
                self.remarks = [*self.remarks, f"{kind_of(entry.content)}: {error}"][-_KEPT_REMARKS:]
                continue
            if decisions:
                self._own = decisions

    def suppose(self, now: float, failed: Collection[str] = (), limits: Mapping[str, float] | None = None) -> Supposed:
        """Return what the reasoner would do if components failed now, or if limits were others; levels stay.

        Args:
            now: present ROS time, s.
            failed: names of components.
            limits: of qualities, for all objectives.

        Raises:
            MapeError: a component or a quality is unknown.
            ReasonerError: an analysis failed.
        """
        core = self._copy()
        if core.pending:  # what is under way counts as carried out
            core.report(now, core.pending.id, ok=True)
        core.step(now)
        before = core.proposal
        for component in failed:
            journal.apply(core, Entry(now, ComponentFact(component, v.FAILED, now)))
        wanted = [SetNfr("", quality, limit) for quality, limit in (limits or {}).items()]
        for _, error in carry_out(wanted, lambda command: journal.apply(core, Entry(now, command))):
            raise error
        levels = {quality: level for (_, quality), level in core.facts.levels.items()}
        moment = now
        while moment <= now + _LONGEST:
            for quality, level in levels.items():
                core.observe_level(moment, quality, level)
            decisions = core.step(moment, heartbeat=True)
            if decisions:
                return Supposed(moment - now, tuple(decisions), "")
            moment += _PERIOD
        note = "the reasoner is paused: it would decide nothing" if core.view.paused else ""
        if before is not None:
            note = f"the proposal {before.to_configuration} still waits for approval"
        return Supposed(_LONGEST, (), note)

    def _copy(self) -> Mape:
        """Return a copy of the loop; what never changes is shared."""
        return copy.deepcopy(self._core, {id(self._kb): self._kb, id(self._reasoner): self._reasoner})

    def _note_id(self, decided: Decided) -> None:
        own = next(
            (d for d in self._own if (d.objective, d.to_configuration) == (decided.objective, decided.configuration)),
            None,
        )
        if own is not None:
            self._ids[decided.decision] = own.id

    def _with_own_id(self, entry: Entry) -> Entry:
        match entry.content:
            case Result() | Approve() | Reject() as content if content.decision in self._ids:
                return replace(entry, content=replace(content, decision=self._ids[content.decision]))
        return entry


def without_heartbeats(entries: Iterable[Entry]) -> list[Entry]:
    """Return entries in which only what counts is analysed: for a shadow that begins late, which has to catch up."""
    return [
        replace(entry, content=Step(heartbeat=False)) if isinstance(entry.content, Step) else entry for entry in entries
    ]
