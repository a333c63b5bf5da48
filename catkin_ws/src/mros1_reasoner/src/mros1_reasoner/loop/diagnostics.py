"""Reads facts from diagnostics and action statuses: levels, statuses of components, failures of tasks."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticStatus
from metacontrol_msgs.msg import DiagnosticWords as Words

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.loop.entries import (
    BindingFact,
    ComponentFact,
    DriftFact,
    Fact,
    LevelFact,
    StaleFact,
    TaskFact,
    subject,
)

TASK_KEYS = ("objetive_error", "objective_error")
"""Keys with which a "QA status" says that a task failed; the published observer of /obj_error writes the first."""
_FAILED = (GoalStatus.ABORTED, GoalStatus.REJECTED, GoalStatus.LOST)
_SHOWN = 60  # characters of foreign text in a warning
_LONGEST_REASON = 200  # characters
_OPEN = ("level", "binding", "task", "drift")  # facts with a foreign name
_EXPECTED = "expected/"  # before the name of a wrong parameter, in the key of the value that it should have
_TRUE, _FALSE = ("true", "1"), ("false", "0")


@dataclass(frozen=True)
class Remark:
    """A line about a status that makes no sense or is not meant for the reasoner.

    Attributes:
        kind: of the trouble; lines of one kind are limited together.
        text: one line, free of foreign control characters.
        is_warning: False where the status may be meant for somebody else.
    """

    kind: str
    text: str
    is_warning: bool = True


@dataclass(frozen=True)
class Reading:
    """Facts from statuses, at most one about each subject, and remarks."""

    facts: tuple[Fact, ...] = ()
    remarks: tuple[Remark, ...] = ()


class DiagnosticsReader:
    """Reads statuses, and leaves out those that are not meant for the reasoner.

    However many statuses come, the number of facts is bounded: a later fact about the same subject replaces an earlier
    one, and there are at most `MAX_NAMES` facts with names that the model does not hold. What is not in the model
    otherwise makes a remark, and there are at most `MAX_REMARKS` remarks.
    """

    MAX_REMARKS = 20
    MAX_NAMES = 200  # of groundings and tasks, which the reader can't check

    def __init__(
        self, qualities: Collection[str], components: Collection[str], nodes: Mapping[str, str] | None = None
    ) -> None:
        """Take what the model knows.

        Args:
            qualities: names of the quality attributes.
            components: names of the components.
            nodes: name of the component that a node is, by the node's name without a leading slash.
        """
        self._qualities = frozenset(qualities)
        self._components = frozenset(components)
        self._nodes = dict(nodes or {})
        self._readers: dict[str, Callable[[Any, float], Fact | Remark | None]] = {
            Words.QA_STATUS: self._quality,
            Words.QA_STALE: self._stale,
            Words.COMPONENT_STATUS: self._component,
            Words.MISSING_NODE: self._missing,
            Words.WRONG_PARAMETER: self._drift,
            Words.BINDING_ERROR: self._binding,
        }

    def read(self, statuses: Iterable[Any], stamp: float = 0.0) -> Reading:
        """Return what statuses say.

        Args:
            statuses: objects with the fields of diagnostic_msgs/DiagnosticStatus.
            stamp: of their array, s; 0 where it has none.
        """
        facts: dict[tuple[str, ...], Fact] = {}
        remarks: dict[Remark, None] = {}
        names = 0
        for status in statuses:
            reader = self._readers.get(status.message)
            found = reader(status, stamp) if reader else None
            match found:
                case None:
                    pass
                case Remark():
                    if len(remarks) < self.MAX_REMARKS:
                        remarks[found] = None
                case _:
                    key = subject(found)
                    found = _with_reason(found, facts.get(key))
                    if facts.pop(key, None) is None and key[0] in _OPEN:
                        names += 1
                    if names <= self.MAX_NAMES or key[0] not in _OPEN:
                        facts[key] = found
        return Reading(tuple(facts.values()), tuple(remarks))

    def _quality(self, status: Any, stamp: float) -> Fact | Remark:
        key, value = _first(status)
        if not key:
            return Remark(Words.QA_STATUS, f"QA status of {shown(status.name)} has no value: left out")
        if key in TASK_KEYS:
            return _task(status.name, key, value, stamp)
        if key not in self._qualities:
            return Remark("Unsupported QA", f"Unsupported QA TYPE received: {_plain(key)}")
        try:
            level = float(value)
        except ValueError:
            say = f"QA status {shown(key)} has the level {shown(value)}, which is no number: left out"
            return Remark(Words.QA_STATUS, say)
        if not math.isfinite(level):
            say = f"QA status {shown(key)} has the level {shown(value)}, which is not finite: left out"
            return Remark(Words.QA_STATUS, say)
        return LevelFact(key, level, status.name, stamp, _plain(value.strip()))

    def _stale(self, status: Any, _stamp: float) -> Fact | Remark:
        key, value = _first(status)
        if not key:
            return Remark(Words.QA_STALE, f"QA stale of {shown(status.name)} has no value: left out")
        if key not in self._qualities:
            return Remark("Unsupported QA", f"Unsupported QA TYPE received: {_plain(key)}")
        return StaleFact(key, _plain(value))

    def _component(self, status: Any, stamp: float) -> Fact | Remark:
        key, value = _first(status)
        text = value[:_SHOWN].strip().upper()
        if not key or text not in v.COMPONENT_STATUSES:
            say = f"Component status ({shown(key)}, {shown(value)}) is left out: expected (component, "
            return Remark(Words.COMPONENT_STATUS, say + "TRUE|FALSE|RECOVERED)")
        why = next((value.value for value in status.values[1:] if value.key == Words.REASON), "")
        return self._known(key, text, stamp, _plain(why.strip(), _LONGEST_REASON) if text == v.FAILED else "")

    def _missing(self, status: Any, stamp: float) -> Fact | Remark | None:
        if _level(status) < DiagnosticStatus.ERROR:
            return None
        node = status.name.strip("/")
        return self._known(self._nodes.get(node, node), v.FAILED, stamp)

    @staticmethod
    def _drift(status: Any, stamp: float) -> Fact | None:
        names = [value.value for value in status.values if value.key == Words.IN_CONFIGURATION]
        expected = {value.key for value in status.values}
        wrong = [value.key for value in status.values if f"{_EXPECTED}{value.key}" in expected]
        if not names:
            return None  # it belongs to nothing that can be deployed again
        return DriftFact(status.name.strip("/"), _plain(",".join(wrong)), ",".join(names), stamp)

    def _known(self, name: str, status: str, stamp: float, reason: str = "") -> Fact | Remark:
        component = name if name in self._components else name.strip("/")
        if component not in self._components:  # nothing in the model requires it
            say = f"component {_plain(name)} is not in the model: its status is left out"
            return Remark("unknown component", say, is_warning=False)
        return ComponentFact(component, status, stamp, reason)

    @staticmethod
    def _binding(status: Any, _stamp: float) -> Fact | Remark:
        if not status.name:
            return Remark(Words.BINDING_ERROR, "binding error without the name of a grounding: left out")
        return BindingFact(status.name, _level(status) >= DiagnosticStatus.ERROR)


def newest_goal(statuses: Any) -> tuple[str, bool] | None:
    """Return the newest goal's id in a GoalStatusArray, and whether it ended badly; None where there is no goal."""
    newest = max(statuses.status_list, key=lambda status: status.goal_id.stamp, default=None)
    return None if newest is None else (newest.goal_id.id, newest.status in _FAILED)


def shown(text: str, longest: int = _SHOWN) -> str:
    """Return foreign text in quotes, shortened, on one line."""
    return repr(text if len(text) <= longest else text[:longest] + "...")


def _plain(text: str, longest: int = _SHOWN) -> str:
    """Return foreign text unchanged if it is short and printable, else as `shown`."""
    return text if len(text) <= longest and text.isprintable() else shown(text, longest)


def _with_reason(fact: Fact, earlier: Fact | None) -> Fact:
    """Return a fact; one that a component has failed keeps the reason that an earlier one had."""
    if isinstance(fact, ComponentFact) and isinstance(earlier, ComponentFact) and fact.status == earlier.status:
        return replace(fact, reason=fact.reason or earlier.reason)
    return fact


def _task(name: str, key: str, value: str, stamp: float) -> Fact | Remark:
    text = value[:_SHOWN].strip().lower()
    if text not in (*_TRUE, *_FALSE):
        return Remark(
            Words.QA_STATUS, f"QA status {key} has the value {shown(value)}: expected True or False: left out"
        )
    return TaskFact(name, text in _TRUE, stamp, "reported as a diagnostic")


def _first(status: Any) -> tuple[str, str]:
    return (status.values[0].key, status.values[0].value) if status.values else ("", "")


def _level(status: Any) -> int:
    level = status.level
    return level[0] if isinstance(level, bytes) and level else int(level or 0)
