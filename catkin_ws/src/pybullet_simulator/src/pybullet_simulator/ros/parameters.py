"""Checks of node parameters, so that a wrong value ends a node's start with one clear line."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any


class ParameterError(ValueError):
    """A node parameter with a value that cannot be used."""


def number(value: Any, name: str, minimum: float = -math.inf, maximum: float = math.inf) -> float:
    """Return a parameter as a float.

    Args:
        value: as read from the parameter server.
        name: of the parameter, for the message.
        minimum: smallest allowed value.
        maximum: largest allowed value.

    Raises:
        ParameterError: not a finite number, or out of its limits.
    """
    good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not good or not minimum <= value <= maximum:
        limits = [f"at least {minimum:g}"] * math.isfinite(minimum) + [f"at most {maximum:g}"] * math.isfinite(maximum)
        raise ParameterError(f"parameter {name} is {value!r}; it must be a number {' and '.join(limits)}".rstrip())
    return float(value)


def seed(value: Any, name: str = "~seed") -> int:
    """Return a seed: a whole number, 0 or more.

    Raises:
        ParameterError: anything else.
    """
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ParameterError(f"parameter {name} is {value!r}; it must be a whole number, 0 or more")
    return value


def flag(value: Any, name: str) -> bool:
    """Return a Boolean parameter.

    Raises:
        ParameterError: not a Boolean.
    """
    if not isinstance(value, bool):
        raise ParameterError(f"parameter {name} is {value!r}; it must be true or false")
    return value


def file_path(value: Any, name: str) -> Path:
    """Return a path.

    Raises:
        ParameterError: not a string, or empty.
    """
    if not isinstance(value, str) or not value:
        raise ParameterError(f"parameter {name} is {value!r}; it must be the path of a file")
    return Path(value).expanduser()
