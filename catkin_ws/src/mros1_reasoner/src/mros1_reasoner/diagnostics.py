"""What the statuses of a DiagnosticArray say, pure: levels of qualities and statuses of components."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from mros1_reasoner import vocabulary as v

ERROR_LEVEL = 2  # diagnostic_msgs/DiagnosticStatus
_SHOWN = 60  # characters of foreign text in a warning


@dataclass(frozen=True)
class LevelFact:
    """A quality has a level; `grounding` may be empty."""

    quality: str
    level: float
    grounding: str = ""


@dataclass(frozen=True)
class StaleFact:
    """A quality can't be observed at present."""

    quality: str
    reason: str = ""


@dataclass(frozen=True)
class ComponentFact:
    """A component has a status."""

    component: str
    status: str


@dataclass(frozen=True)
class BindingFact:
    """A binding of a grounding is in error, or no longer is."""

    grounding: str
    in_error: bool


@dataclass(frozen=True)
class BadFact:
    """A status that makes no sense: why, in words."""

    warning: str


Fact = LevelFact | StaleFact | ComponentFact | BindingFact | BadFact


def read_statuses(statuses: Iterable[Any], components: Mapping[str, str]) -> list[Fact]:
    """Return the facts that statuses hold; what is not meant for the reasoner is left out.

    Args:
        statuses: objects with the fields of diagnostic_msgs/DiagnosticStatus.
        components: name of the component that a node is, by the node's name without a leading slash.
    """
    facts: list[Fact] = []
    for status in statuses:
        if status.message in _READERS:
            facts.append(_READERS[status.message](status))
        elif status.message == "Missing node" and _level(status) >= ERROR_LEVEL:
            node = status.name.strip("/")
            facts.append(ComponentFact(components.get(node, node), v.FAILED))
    return facts


def _quality(status: Any) -> Fact:
    key, value = _first(status)
    if not key:
        return BadFact(f"QA status of {_shown(status.hardware_id)} has no value: left out")
    try:
        level = float(value)
    except ValueError:
        return BadFact(f"QA status {_shown(key)} has the level {_shown(value)}, which is no number: left out")
    if not math.isfinite(level):
        return BadFact(f"QA status {_shown(key)} has the level {_shown(value)}, which is not finite: left out")
    return LevelFact(key, level, status.name)


def _stale(status: Any) -> Fact:
    key, value = _first(status)
    return StaleFact(key, value) if key else BadFact(f"QA stale of {_shown(status.hardware_id)} has no value: left out")


def _component(status: Any) -> Fact:
    key, value = _first(status)
    text = value.strip().upper()
    if not key or text not in v.COMPONENT_STATUSES:
        return BadFact(
            f"Component status ({_shown(key)}, {_shown(value)}) is left out: expected (component, TRUE|FALSE|RECOVERED)"
        )
    return ComponentFact(key, text)


def _binding(status: Any) -> Fact:
    if not status.name:
        return BadFact("binding error without the name of a grounding: left out")
    return BindingFact(status.name, _level(status) >= ERROR_LEVEL)


_READERS = {
    "QA status": _quality,
    "QA stale": _stale,
    "Component status": _component,
    "binding error": _binding,
}


def _first(status: Any) -> tuple[str, str]:
    return (status.values[0].key, status.values[0].value) if status.values else ("", "")


def _level(status: Any) -> int:
    level = status.level
    return level[0] if isinstance(level, bytes) and level else int(level or 0)


def _shown(text: str) -> str:
    return repr(text if len(text) <= _SHOWN else text[:_SHOWN] + "...")
