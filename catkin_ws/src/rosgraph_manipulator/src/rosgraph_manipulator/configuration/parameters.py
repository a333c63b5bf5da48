"""Checks of single parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence


class SettingError(Exception):
    """A parameter can't be used; the message names it."""


def number(name: str, value: object, low: float = -math.inf) -> float:
    """Return a number that is finite and at least `low`.

    Raises:
        SettingError: it is not.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or value < low:
        raise SettingError(f"parameter '{name}' must be a number of at least {low:g}, is {value!r}")
    return float(value)


def boolean(name: str, value: object) -> bool:
    """Return a truth value.

    Raises:
        SettingError: it is none.
    """
    if not isinstance(value, bool):
        raise SettingError(f"parameter '{name}' must be true or false, is {value!r}")
    return value


def choice(name: str, value: object, choices: Sequence[str]) -> str:
    """Return one of the choices.

    Raises:
        SettingError: it is none.
    """
    if value not in choices:
        raise SettingError(f"parameter '{name}' must be one of {', '.join(choices)}, is {value!r}")
    return str(value)
