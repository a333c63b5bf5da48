"""What a node had begun with, as text, and what of it is to be set again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def kept_of(text: Any, supervisor: str) -> dict[str, str] | None:
    """Return the parameters, name -> value as JSON, that a process of the same supervisor has kept; None: none has.

    Args:
        text: the value of the parameter in which they are kept; whatever it is.
        supervisor: of this process; empty: it has none, and nothing is kept.
    """
    try:
        by, kept = json.loads(text)
        for value in kept.values():
            json.loads(value)
    except (AttributeError, RecursionError, TypeError, ValueError):
        return None
    return dict(kept) if supervisor and by == supervisor else None


def to_restore(kept: Mapping[str, str], present: Mapping[str, str]) -> list[str]:
    """Return which parameters are to be set or deleted, by what was kept and by what is found now."""
    missing = sorted(kept.keys() - present.keys())
    return missing or sorted(name for name in {*kept, *present} if kept.get(name) != present.get(name))


def json_texts(values: Mapping[str, Any]) -> dict[str, str]:
    """Return values as JSON; without those that JSON can't tell, such as dates."""
    texts = {}
    for name, value in values.items():
        try:
            texts[name] = json.dumps(value, sort_keys=True)
        except (TypeError, ValueError, RecursionError):
            continue
    return texts
