"""Entries of the journal as text, as metacontrol_msgs/JournalEntry holds them: a kind, and the values in order.

| kind | values |
|---|---|
| level | quality, level, grounding, stamp of the diagnostic |
| stale | quality |
| component | component, status, stamp of the diagnostic, and, if it is known, why it has failed |
| drift | node, parameters, configurations that set them, stamp of the diagnostic |
| binding | grounding, in error |
| task | objective or its function, failed, stamp, message; any other name means the only root objective |
| active | function, configuration (empty: nothing runs), state |
| left | objective, what ran, quality, factor and difference of levels, group of designs, whether limits were not kept |
| failed | component that did not work when the reasoner before this one died |
| unneeded | function that the reasoner before this one was to release when it died |
| step | whether it is a heartbeat |
| result | decision, whether it is carried out, message, whether the configuration is to blame |
| pause, resume | |
| lock, unlock | objective; none: all |
| approve, reject | decision |
| add_objective | objective, function, then quality and limit of each NFR |
| pursue | objective, function, whether it is always improved (empty: as set), then quality and limit of each NFR |
| remove_objective | objective |
| set_nfr | objective, quality, limit |
| decided | decision, objective, configuration: the outcome of the entry before it |
| released | function |

Numbers are written so that they read back exactly; yes is 1, no is 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any

from mros1_reasoner.loop import entries

_YES, _NO = "1", "0"
_KINDS: Mapping[str, type[entries.Content]] = {
    "level": entries.LevelFact,
    "stale": entries.StaleFact,
    "component": entries.ComponentFact,
    "drift": entries.DriftFact,
    "binding": entries.BindingFact,
    "task": entries.TaskFact,
    "active": entries.ActiveFact,
    "left": entries.LeftFact,
    "failed": entries.FailedFact,
    "unneeded": entries.UnneededFact,
    "step": entries.Step,
    "result": entries.Result,
    "pause": entries.Pause,
    "resume": entries.Resume,
    "lock": entries.Lock,
    "unlock": entries.Unlock,
    "approve": entries.Approve,
    "reject": entries.Reject,
    "add_objective": entries.AddObjective,
    "pursue": entries.Pursue,
    "remove_objective": entries.RemoveObjective,
    "set_nfr": entries.SetNfr,
    "decided": entries.Decided,
    "released": entries.Released,
}
_NAMES = {content: kind for kind, content in _KINDS.items()}
_READERS: Mapping[str, Callable[[str], Any]] = {"str": str, "float": float, "bool": lambda text: text == _YES}


def kind_of(content: entries.Content) -> str:
    """Return the kind of an entry with this content."""
    return _NAMES[type(content)]


def values_of(content: entries.Content) -> tuple[str, ...]:
    """Return the values of an entry with this content."""
    match content:
        case entries.Lock(objective="") | entries.Unlock(objective=""):
            return ()
        case entries.AddObjective(name, function, limits):
            return (name, function, *_limit_texts(limits))
        case entries.Pursue(name, function, limits, improve):
            return (name, function, "" if improve is None else _text(improve), *_limit_texts(limits))
        case entries.ComponentFact(component, status, stamp, reason=""):
            return (component, status, _text(stamp))
    return tuple(_text(getattr(content, name)) for name, _ in _written(type(content)))


def read_entry(now: float, kind: str, values: Sequence[str]) -> entries.Entry:
    """Return the entry of a kind with these values.

    Raises:
        ValueError: the kind is unknown, or a value is missing or can't be read.
    """
    content = _KINDS.get(kind)
    if content is None:
        raise ValueError(f"a journal's entry has the unknown kind {kind!r}")
    unfit = ValueError(f"an entry {kind!r} of the journal has {len(values)} values")
    if content is entries.AddObjective:
        if len(values) < 2 or len(values) % 2:
            raise unfit
        return entries.Entry(now, entries.AddObjective(values[0], values[1], _limits(values[2:])))
    if content is entries.Pursue:
        if len(values) < 3 or not len(values) % 2:
            raise unfit
        improve = values[2] == _YES if values[2] else None
        return entries.Entry(now, entries.Pursue(values[0], values[1], _limits(values[3:]), improve))
    written = _written(content)
    if content is entries.ComponentFact and len(values) == len(written) - 1:
        values = (*values, "")
    is_without = not values and content in (entries.Lock, entries.Unlock)
    if len(values) != len(written) and not is_without:
        raise unfit
    read: dict[str, Any] = {
        name: _READERS[kind](value) for (name, kind), value in zip(written, values, strict=not is_without)
    }
    return entries.Entry(now, content(**read))


def _written(content: type[entries.Content]) -> list[tuple[str, str]]:
    """Return name and type of the written fields: the fields that are used to compare contents."""
    return [(item.name, str(item.type)) for item in fields(content) if item.compare]


def _limit_texts(limits: Mapping[str, float]) -> list[str]:
    return [_text(part) for limit in limits.items() for part in limit]


def _limits(values: Sequence[str]) -> dict[str, float]:
    return {quality: float(limit) for quality, limit in zip(values[::2], values[1::2], strict=True)}


def _text(value: object) -> str:
    if isinstance(value, bool):
        return _YES if value else _NO
    return repr(value) if isinstance(value, float) else str(value)
