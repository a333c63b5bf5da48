"""What a node had begun with, and what of it is to be set again: as text, and as decisions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

NO_JSON = ""
"""Stands for a value that JSON can't tell, such as a date: it is another one than any that was kept."""


@dataclass(frozen=True)
class Kept:
    """What the processes of a node leave for the next one of their name. Values are JSON, by full parameter name.

    Attributes:
        by: the node, and the supervisor that started the process which wrote this.
        values: what the last process that has begun had found; None: none of this supervisor has begun yet.
        found: what there was before values were set again; None: they were not, since the last process has begun.
        names: what was set again last.
        in_vain: whether that did not help: what was found then was put back.
    """

    by: str
    values: Mapping[str, str] | None
    found: Mapping[str, str] | None = None
    names: tuple[str, ...] = ()
    in_vain: bool = False

    def to_text(self) -> str:
        """Return this as the value of a parameter."""
        return json.dumps(asdict(self), sort_keys=True)


@dataclass(frozen=True)
class Remedy:
    """What a node does that can't begin.

    Attributes:
        wanted: parameters to set, name -> JSON, and to delete: None.
        kept: what is left for the next process; None: what is there stays.
        again: whether it is started again at once.
    """

    wanted: Mapping[str, str | None] = field(default_factory=dict)
    kept: Kept | None = None
    again: bool = False


def kept_of(text: Any, by: str) -> Kept | None:
    """Return what was kept for a process of a node and supervisor; None: nothing was, or for others.

    Args:
        text: the value of the parameter in which it is kept; whatever it is.
        by: the node and its supervisor; empty: it has none, and nothing is kept.
    """
    try:
        content = json.loads(text)
        kept = Kept(content["by"], content["values"], content["found"], tuple(content["names"]), content["in_vain"])
        for values in (kept.values, kept.found):
            for name, value in () if values is None else values.items():
                if value != NO_JSON:
                    json.loads(value)
                if not isinstance(name, str) or not name.startswith("/"):
                    return None
        if not all(isinstance(name, str) for name in kept.names):
            return None
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError):
        return None
    return kept if by and kept.by == by else None


def missing(kept: Kept | None, present: Mapping[str, str]) -> dict[str, str]:
    """Return what the last process had begun with and is not there any more."""
    values = (kept.values if kept else None) or {}
    return {name: value for name, value in values.items() if name not in present}


def remedy(kept: Kept | None, present: Mapping[str, str], by: str) -> Remedy:
    """Return what a node does that can't begin with what it has found.

    What is other than at the last start, or new, is set again as it was then. Where that does not help, what was found
    before is put back: something else is wrong, such as a file, and the user's values are as good as the others.

    Args:
        kept: by the process before.
        present: what the node has found, name -> JSON.
        by: the node and its supervisor.
    """
    if kept is None:  # another supervisor's, which has nothing to say any more, or nobody's
        return Remedy(kept=Kept(by, None))
    if kept.values is None:
        return Remedy()
    values = kept.values
    names = tuple(sorted(name for name in {*values, *present} if values.get(name) != present.get(name)))
    if kept.in_vain and present == kept.found:
        return Remedy()
    if kept.found is not None and not kept.in_vain and (not names or names == kept.names):
        back = {name: kept.found.get(name) for name in {*kept.found, *present}}
        changed = {name: value for name, value in back.items() if value != present.get(name) and value != NO_JSON}
        return Remedy(changed, Kept(by, values, kept.found, (), in_vain=True))
    if not names:
        return Remedy()
    found = present if kept.found is None or kept.in_vain else kept.found
    return Remedy({name: values.get(name) for name in names}, Kept(by, values, found, names), again=True)


def json_texts(values: Mapping[str, Any]) -> dict[str, str]:
    """Return values as JSON, or `NO_JSON`."""
    texts = {}
    for name, value in values.items():
        try:
            texts[name] = json.dumps(value, sort_keys=True)
        except (TypeError, ValueError, RecursionError):
            texts[name] = NO_JSON
    return texts
