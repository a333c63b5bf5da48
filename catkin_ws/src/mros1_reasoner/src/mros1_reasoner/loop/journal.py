"""The journal of the loop's inputs. Late subscribers get it, and a replay applies it again."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Generic, TypeVar

from metacontrol_bags.decision import DECIDED, PROPOSED, Decision

from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop import entries
from mros1_reasoner.loop.entries import Entry
from mros1_reasoner.loop.mape import Mape

Form = TypeVar("Form")
"""What a journal keeps of an entry: the entry, or what a message has of it."""

_LASTING = entries.ActiveFact | entries.ComponentFact | entries.BindingFact | entries.TaskFact | entries.BeforeFact
_COMMANDS = (
    entries.Pause
    | entries.Resume
    | entries.Lock
    | entries.Unlock
    | entries.AddObjective
    | entries.Pursue
    | entries.RemoveObjective
    | entries.SetNfr
)


def apply(core: Mape, entry: Entry) -> list[Decision]:
    """Have the loop take in an entry.

    Returns:
        Decisions to publish.

    Raises:
        MapeError: the entry does not fit.
        ReasonerError: the analysis failed.
    """
    now, content = entry.now, entry.content
    match content:
        case entries.Step():
            return core.step(now, heartbeat=content.heartbeat)
        case entries.Result():
            outcome = core.report(now, content.decision, content.ok, content.message, blame=content.blame)
            return [outcome] if outcome else []
        case entries.Released():
            core.report_released(content.function)
        case entries.Decided():
            pass
        case _ if isinstance(content, entries.Fact):
            _observe(core, now, content)
        case _:
            return _carry_out(core, now, content)
    return []


def is_pursued(core: Mape, name: str) -> bool:
    """Return whether a name is that of an objective, or of its function."""
    return _is_of(name, core.objectives.values())


def _is_of(name: str, objectives: Iterable[Objective]) -> bool:
    return any(name in (objective.name, objective.function) for objective in objectives)


def brought(now: float, decisions: Sequence[Decision]) -> list[Entry]:
    """Return the entries about the decisions that an entry led to."""
    return [
        Entry(now, entries.Decided(decision.id, decision.objective, decision.to_configuration))
        for decision in decisions
        if decision.state in (DECIDED, PROPOSED)
    ]


class Journal(Generic[Form]):
    """The last entries, numbered from the reasoner's start, and older entries that still hold."""

    def __init__(
        self, form: Callable[[Entry], Form], limit: int = 50_000, at_start: Collection[str] | None = None
    ) -> None:
        """Begin without entries.

        Args:
            form: makes of an entry what is kept of it and returned; the smaller it is, the less memory it takes.
            limit: how many of the last entries are kept: 50,000 are some 20 minutes' worth on a busy robot.
            at_start: names of the objectives that are asked for from the start: to remove another one needs not be
                kept when what has asked for it is not; None: any may be one of these.
        """
        self._form = form
        self._limit = limit
        self._at_start = at_start
        self._last: deque[Form] = deque()
        self._lasting: deque[tuple[int, Entry]] = deque()  # what of these is to be kept later, with their numbers
        self._kept: dict[tuple[str, ...], tuple[int, Entry]] = {}  # older ones with their numbers, by their subjects
        self._count = 0

    def append(self, entry: Entry, objectives: Mapping[str, Objective] | None = None) -> tuple[int, Form]:
        """Add an entry; return its number, and what is kept of it.

        Args:
            entry: it.
            objectives: those that there are, by name: an older command for all of them is kept as one for each.
        """
        formed = self._form(entry)
        self._last.append(formed)
        for content in _lasting(entry.content, objectives):
            self._lasting.append((self._count, replace(entry, content=content)))
        self._count += 1
        if len(self._last) > self._limit:
            self._compact()
        return self._count - 1, formed

    def snapshot(self) -> tuple[int, list[Form]]:
        """Return what is kept of the entries, and the number that the first one would have if there were no gaps."""
        kept = [self._form(entry) for _, entry in sorted(self._kept.values(), key=lambda item: item[0])]
        found = [*kept, *self._last]
        return self._count - len(found), found

    def _compact(self) -> None:
        """Drop the older half of the last entries, except what holds: of each subject, the last one."""
        for _ in range(len(self._last) // 2):
            self._last.popleft()
        first = self._count - len(self._last)
        while self._lasting and self._lasting[0][0] < first:
            self._keep(*self._lasting.popleft())

    def _keep(self, number: int, entry: Entry) -> None:
        """Keep an older entry, in place of those that it makes void."""
        match entry.content:
            case entries.Resume():
                self._drop("pause")
            case entries.Unlock(name):
                self._drop("lock", *([name] if name else []))
            case entries.RemoveObjective(name):
                self._drop_objective(name)
                if self._at_start is None or name in self._at_start:
                    self._kept["removed", name] = number, entry
            case entries.Pursue(name) if ("asked for", name) in self._kept:
                self._kept["pursued", name] = number, entry  # the first one stays: it has a place among the others
            case entries.AddObjective(name) | entries.Pursue(name):
                self._kept["asked for", name] = number, entry
            case entries.Pause():
                self._kept["pause",] = number, entry
            case entries.Lock(name):
                self._kept["lock", name] = number, entry
            case entries.SetNfr(name, quality):
                self._kept["limit", name, quality] = number, entry
            case content if isinstance(content, _LASTING):
                self._kept[entries.subject(content)] = number, entry

    def _drop_objective(self, name: str) -> None:
        """Drop all about an objective; limits stay that it has whenever a design requires it."""
        begun, _ = self._kept.get(("asked for", name), (-1, None))
        for kind in ("asked for", "pursued", "lock", "task"):
            self._drop(kind, name)
        for key in [key for key in self._kept if key[:2] == ("limit", name) and self._kept[key][0] > begun]:
            del self._kept[key]

    def _drop(self, *subject: str) -> None:
        """Drop the entries whose subjects begin so."""
        for key in [key for key in self._kept if key[: len(subject)] == subject]:
            del self._kept[key]


def _lasting(content: entries.Content, objectives: Mapping[str, Objective] | None) -> tuple[entries.Content, ...]:
    """Return what is to be kept of an entry that is an old one.

    Args:
        content: of the entry.
        objectives: those that there are, by name; None: unknown.
    """
    match content:
        case entries.TaskFact(name) if objectives is not None and not _is_of(name, objectives.values()):
            return (replace(content, name=""),)  # any name stands for the only root objective
        case entries.Lock("") | entries.SetNfr("") if objectives:
            return tuple(replace(content, objective=name) for name in objectives)
    return (content,) if isinstance(content, _LASTING | _COMMANDS) else ()


def _observe(core: Mape, now: float, fact: entries.Fact) -> None:
    """Have the loop take in a fact."""
    match fact:
        case entries.LevelFact():
            core.observe_level(now, fact.quality, fact.level, fact.grounding, fact.stamp)
        case entries.StaleFact():
            core.observe_stale(fact.quality)
        case entries.ComponentFact():
            core.observe_component(now, fact.component, fact.status, fact.stamp, fact.reason)
        case entries.DriftFact():
            core.observe_drift(now, fact.node, fact.parameters, fact.configurations.split(","), fact.stamp)
        case entries.BindingFact():
            core.observe_binding(now, fact.grounding, fact.in_error)
        case entries.TaskFact():
            core.observe_task(now, _objective(core, fact.name), fact.failed, fact.stamp, fact.message)
        case entries.ActiveFact():
            core.observe_active(now, fact.function, fact.configuration, fact.state)
        case entries.LeftFact() | entries.FailedFact() | entries.UnneededFact():
            core.observe_before(fact)


def _carry_out(core: Mape, now: float, command: entries.Command) -> list[Decision]:
    """Have the loop do what an operator asks for."""
    match command:
        case entries.Pause():
            core.operator.pause()
        case entries.Resume():
            core.operator.resume()
        case entries.Lock(objective):
            core.operator.lock(objective)
        case entries.Unlock(objective):
            core.operator.unlock(objective)
        case entries.Approve(decision):
            return [core.operator.approve(decision, now)]
        case entries.Reject(decision):
            return [core.operator.reject(decision, now)]
        case entries.AddObjective(name, function, limits):
            core.operator.add_objective(Objective(name, function, limits))
        case entries.Pursue(name, function, limits, improve):
            core.operator.pursue(Objective(name, function, limits, improve))
        case entries.RemoveObjective(name):
            core.operator.remove_objective(name)
        case entries.SetNfr(objective, quality, limit):
            core.operator.set_nfr(objective, quality, limit)
    return []


def _objective(core: Mape, name: str) -> str:
    """Return the name of an objective or a function unchanged; empty for others, such as an observer's name."""
    return name if is_pursued(core, name) else ""
