"""What an operator may ask for by the page, checked: names of actions and their values. Pure."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from node_kit.one_line import OneLineError

_LONGEST = 200  # characters of a name
_MOST = 50  # names in a list

_TEXTS: Mapping[str, tuple[str, ...]] = {
    "pause": (),
    "resume": (),
    "lock": (),
    "unlock": (),
    "approve": ("id",),
    "reject": ("id",),
    "set_limit": ("objective", "quality"),
    "deploy": ("configuration",),
    "suppose": (),
    "feasible": (),
}
"""The actions, and the texts that each needs."""

LOOKS_ONLY = frozenset(["suppose", "feasible"])
"""Actions that change nothing: whoever may look may ask for them."""


class RequestError(OneLineError, ValueError):
    """A request makes no sense; one line that says why."""


@dataclass(frozen=True)
class Request:
    """What an operator asks for.

    Attributes:
        action: its name.
        texts: names that it is about.
        value: a limit; None where there is none.
        failed: components that are supposed to fail.
        limits: of qualities, that are supposed.
    """

    action: str
    texts: Mapping[str, str] = field(default_factory=dict)
    value: float | None = None
    failed: tuple[str, ...] = ()
    limits: Mapping[str, float] = field(default_factory=dict)


def read_request(data: Any) -> Request:
    """Return the request that a page has sent.

    Raises:
        RequestError: it makes no sense.
    """
    if not isinstance(data, dict):
        raise RequestError("a request is an object with the field action")
    action = data.get("action")
    if not isinstance(action, str) or action not in _TEXTS:
        raise RequestError(f"unknown action: there are {', '.join(_TEXTS)}")
    texts = {name: _text(data.get(name, ""), name) for name in _TEXTS[action]}
    if action == "deploy" and not texts["configuration"]:
        raise RequestError("deploy needs the name of a configuration")
    if action == "set_limit":
        if not texts["quality"]:
            raise RequestError("set_limit needs the name of a quality")
        return Request(action, texts, _number(data.get("value"), "value"))
    if action != "suppose":
        return Request(action, texts)
    failed, limits = data.get("failed", []), data.get("limits", {})
    if not isinstance(failed, list) or len(failed) > _MOST:
        raise RequestError(f"failed is a list of at most {_MOST} names of components")
    names = tuple(_text(name, "failed") for name in failed)
    return Request(action, texts, None, names, read_limits(limits))


def read_limits(limits: Any) -> dict[str, float]:
    """Return limits by the names of qualities.

    Raises:
        RequestError: they make no sense.
    """
    if not isinstance(limits, dict) or len(limits) > _MOST:
        raise RequestError(f"limits is an object with at most {_MOST} numbers by the names of qualities")
    return {_text(name, "limits"): _number(value, f"limits/{name}"[:_LONGEST]) for name, value in limits.items()}


def _text(value: Any, name: str) -> str:
    if not isinstance(value, str) or len(value) > _LONGEST or not (value.isprintable() or not value):
        raise RequestError(f"{name} is a text of at most {_LONGEST} printable characters")
    return value


def _number(value: Any, name: str) -> float:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not abs(value) <= sys.float_info.max:  # nor is NaN; a whole number may have 400 digits
        raise RequestError(f"{name} is a finite number")
    return float(value)
