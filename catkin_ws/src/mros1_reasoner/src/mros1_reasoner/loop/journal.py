"""What the reasoner takes in and does, as entries of a journal, pure: the node and the replay of a bag apply the same.

| kind | values |
|---|---|
| level | quality, level, grounding, stamp of the diagnostic |
| stale | quality |
| component | component, status, stamp of the diagnostic |
| binding | grounding, in error |
| task | objective or its function, failed, stamp, message; any other name stands for the only root objective |
| active | function, configuration, state |
| step | whether it is a heartbeat |
| result | decision, whether it is carried out, message, whether the configuration is to blame |
| pause, resume | |
| lock, unlock | objective; none: all |
| approve, reject | decision |
| add_objective | objective, function, then quality and limit of each NFR |
| remove_objective | objective |
| set_nfr | objective, quality, limit |
| decided | decision, objective, configuration: not taken in, but what a step has brought |
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from metacontrol_bags.decision import DECIDED, PROPOSED, Decision

from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.diagnostics import BindingFact, ComponentFact, Fact, LevelFact, StaleFact, TaskFact
from mros1_reasoner.loop.mape import Mape

_YES, _NO = "1", "0"
DECIDED_KIND = "decided"


@dataclass(frozen=True)
class Entry:
    """One thing taken in: at what ROS time in s, of what kind, and its values as text."""

    now: float
    kind: str
    values: tuple[str, ...] = ()


def entry(now: float, kind: str, *values: object) -> Entry:
    """Make an entry; numbers are written so that they read back exactly."""
    return Entry(now, kind, tuple(_text(value) for value in values))


def of_fact(fact: Fact, stamp: float) -> tuple[Any, ...]:
    """Return kind and values of the entry about a fact from a diagnostic with a stamp."""
    match fact:
        case LevelFact():
            return "level", fact.quality, fact.level, fact.grounding, stamp
        case StaleFact():
            return "stale", fact.quality
        case ComponentFact():
            return "component", fact.component, fact.status, stamp
        case BindingFact():
            return "binding", fact.grounding, fact.in_error
        case TaskFact():
            return "task", fact.name, fact.failed, stamp, "reported as a diagnostic"


def apply(core: Mape, item: Entry) -> list[Decision]:
    """Have the loop take in an entry.

    Returns:
        Decisions to publish.

    Raises:
        MapeError: the entry does not fit.
        ReasonerError: the analysis failed.
        ValueError: the kind is unknown, or a value can't be read.
    """
    handler = _HANDLERS.get(item.kind)
    if handler is None:
        raise ValueError(f"a journal's entry has the unknown kind {item.kind!r}")
    return handler(core, item.now, *item.values) or []


def decided(now: float, decisions: Sequence[Decision]) -> list[Entry]:
    """Return entries that say what a step has brought."""
    return [
        entry(now, DECIDED_KIND, decision.id, decision.objective, decision.to_configuration)
        for decision in decisions
        if decision.state in (DECIDED, PROPOSED)
    ]


class Journal:
    """The last entries, numbered from the reasoner's start; of what goes, the state that it left is kept."""

    def __init__(self, limit: int = 50_000) -> None:
        """Keep at most so many entries, and a few more: some 20 minutes' worth on a busy robot."""
        self._limit = limit
        self._entries: deque[Entry] = deque()
        self._count = 0

    def append(self, item: Entry) -> int:
        """Add an entry; return its number."""
        self._entries.append(item)
        self._count += 1
        if len(self._entries) > self._limit:
            self._compact()
        return self._count - 1

    def snapshot(self) -> tuple[int, list[Entry]]:
        """Return the number of the first entry and the entries; those kept from before count backwards from there."""
        return self._count - len(self._entries), list(self._entries)

    def _compact(self) -> None:
        """Drop the older half, but for the last word on each thing that stays as it is until told otherwise."""
        old = [self._entries.popleft() for _ in range(len(self._entries) // 2)]
        last = {(item.kind, *item.values[:1]): item for item in old if item.kind in _LASTING}
        others = [item for item in old if item.kind in _COMMANDS]
        kept = sorted([*last.values(), *others], key=lambda item: item.now)
        self._entries.extendleft(reversed(kept))


_LASTING = ("active", "component", "binding", "task")
_COMMANDS = (
    "pause",
    "resume",
    "lock",
    "unlock",
    "add_objective",
    "remove_objective",
    "set_nfr",
)


def _text(value: object) -> str:
    if isinstance(value, bool):
        return _YES if value else _NO
    return repr(value) if isinstance(value, float) else str(value)


def _add_objective(core: Mape, _now: float, name: str, function: str, *limits: str) -> None:
    pairs = zip(limits[::2], limits[1::2], strict=True)
    core.add_objective(Objective(name, function, {quality: float(limit) for quality, limit in pairs}))


def _objective(core: Mape, name: str) -> str:
    """Return the name where it is of an objective or a function; a published observer gives its own."""
    return name if any(name in (o.name, o.function) for o in core.objectives.values()) else ""


def _set_nfr(core: Mape, _now: float, objective: str, quality: str, limit: str) -> None:
    for name in [objective] if objective else list(core.objectives):
        core.set_nfr(name, quality, float(limit))


_HANDLERS: dict[str, Callable[..., list[Decision] | None]] = {
    "level": lambda core, now, quality, level, grounding, stamp: core.observe_level(
        now, quality, float(level), grounding, float(stamp)
    ),
    "stale": lambda core, _, quality: core.observe_stale(quality),
    "component": lambda core, now, component, status, stamp: core.observe_component(
        now, component, status, float(stamp)
    ),
    "binding": lambda core, now, grounding, in_error: core.observe_binding(now, grounding, in_error == _YES),
    "task": lambda core, now, name, failed, stamp, message: core.observe_task(
        now, _objective(core, name), failed == _YES, float(stamp), message
    ),
    "active": lambda core, now, function, configuration, state: core.observe_active(
        now, function, configuration, state
    ),
    "step": lambda core, now, heartbeat: core.step(now, heartbeat=heartbeat == _YES),
    "result": lambda core, now, decision, ok, message, blame: [
        core.report(now, decision, ok == _YES, message, blame=blame == _YES)
    ],
    "pause": lambda core, _: core.pause(),
    "resume": lambda core, _: core.resume(),
    "lock": lambda core, _, objective="": core.lock(objective),
    "unlock": lambda core, _, objective="": core.unlock(objective),
    "approve": lambda core, _, decision: [core.approve(decision)],
    "reject": lambda core, now, decision: [core.reject(decision, now)],
    "add_objective": _add_objective,
    "remove_objective": lambda core, _, name: core.remove_objective(name),
    "set_nfr": _set_nfr,
    DECIDED_KIND: lambda *_: None,
}
