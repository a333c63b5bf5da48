"""Texts that control no terminal: a bag or a message may come from anybody."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

Told = TypeVar("Told")


def printable(text: str) -> str:
    """Return a text without characters that control a terminal."""
    return "".join(mark if mark.isprintable() else mark.encode("unicode_escape").decode() for mark in text)


def all_printable(told: Told) -> Told:
    """Return a dataclass, a mapping or a sequence with all its texts made printable."""
    made: Told = _printable(told)
    return made


def _printable(told: Any) -> Any:
    if isinstance(told, str):
        return printable(told)
    if isinstance(told, Mapping):
        return {_printable(key): _printable(value) for key, value in told.items()}
    if isinstance(told, (list, tuple)):
        return tuple(_printable(item) for item in told)
    if is_dataclass(told) and not isinstance(told, type):
        return type(told)(**{field.name: _printable(getattr(told, field.name)) for field in fields(told)})
    return told
