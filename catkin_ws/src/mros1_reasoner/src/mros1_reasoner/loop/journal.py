"""The journal of the loop's inputs. Late subscribers get it, and a replay applies it again."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from metacontrol_bags.decision import DECIDED, PROPOSED, Decision

from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop import entries
from mros1_reasoner.loop.entries import Entry
from mros1_reasoner.loop.mape import Mape

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
    return any(name in (objective.name, objective.function) for objective in core.objectives.values())


def brought(now: float, decisions: Sequence[Decision]) -> list[Entry]:
    """Return the entries about the decisions that an entry led to."""
    return [
        Entry(now, entries.Decided(decision.id, decision.objective, decision.to_configuration))
        for decision in decisions
        if decision.state in (DECIDED, PROPOSED)
    ]


class Journal:
    """The last entries, numbered from the reasoner's start, and older entries that still hold."""

    def __init__(self, limit: int = 50_000) -> None:
        """Keep at most so many entries, and a few more: some 20 minutes' worth on a busy robot."""
        self._limit = limit
        self._entries: deque[Entry] = deque()
        self._count = 0

    def append(self, entry: Entry) -> int:
        """Add an entry; return its number."""
        self._entries.append(entry)
        self._count += 1
        if len(self._entries) > self._limit:
            self._compact()
        return self._count - 1

    def snapshot(self) -> tuple[int, list[Entry]]:
        """Return the entries, and the number that the first one would have if there were no gaps."""
        return self._count - len(self._entries), list(self._entries)

    def _compact(self) -> None:
        """Drop the older half, except commands and the last entry about each lasting fact."""
        old = [self._entries.popleft() for _ in range(len(self._entries) // 2)]
        last = {entries.subject(item.content): item for item in old if isinstance(item.content, _LASTING)}
        others = [item for item in old if isinstance(item.content, _COMMANDS)]
        kept = sorted([*last.values(), *others], key=lambda item: item.now)
        self._entries.extendleft(reversed(kept))


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
