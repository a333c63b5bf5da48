"""The values that expressions of a program may have, as far as its text tells, and in which cases."""

from __future__ import annotations

import ast
import sys
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ros_model_extraction.python.modules import Module, Scope


@dataclass(frozen=True)
class Const:
    """A known number, text, truth value, bytes or None."""

    value: Any


@dataclass(frozen=True)
class Hole:
    """A part of a text that is not known: its source, or a word for it."""

    source: ast.AST | str

    @property
    def expression(self) -> str:
        """The expression, on one line, short."""
        return self.source if isinstance(self.source, str) else source_of(self.source)


@dataclass(frozen=True)
class Text:
    """A text of which parts are not known."""

    parts: tuple[str | Hole, ...]

    def __str__(self) -> str:
        """Return the text with expressions in braces."""
        return "".join(part if isinstance(part, str) else f"{{{part.expression}}}" for part in self.parts)


@dataclass(frozen=True)
class Items:
    """A list, tuple or set of known length."""

    values: tuple[Value, ...]


@dataclass(frozen=True)
class Table:
    """A dict with known keys and values."""

    items: tuple[tuple[Value, Value], ...]


@dataclass(frozen=True)
class External:
    """Something defined outside the sources: `rospy.Publisher`, `std_msgs.msg.String`."""

    name: str


@dataclass(frozen=True)
class ModuleValue:
    """A module of the sources."""

    module: Module


@dataclass(frozen=True)
class Class:
    """A class of the sources."""

    scope: Scope


@dataclass(frozen=True)
class Function:
    """A function of the sources, with the frame around it, and the object that a method is bound to."""

    scope: Scope
    lexical: Frame
    instance: Instance | None = None


@dataclass(frozen=True)
class Partial:
    """`functools.partial(function, ...)`: the function, and the call that made it."""

    function: Value
    call: ast.Call
    frame: Frame


@dataclass(frozen=True)
class Super:
    """`super()` in a method of a class, on an object."""

    instance: Instance
    after: Scope  # the class whose bases are meant


class _Hashed:
    """Keeps its hash, which for frames within frames costs."""

    def __hash__(self) -> int:
        kept: int | None = self.__dict__.get("_hash")
        if kept is None:
            kept = hash(tuple(value for name, value in self.__dict__.items() if name != "_hash"))
            object.__setattr__(self, "_hash", kept)
        return kept


@dataclass(frozen=True)
class Instance(_Hashed):
    """An object of a class of the sources, made by a call in a frame, where that is known."""

    scope: Scope
    call: ast.Call | None = None
    frame: Frame | None = None

    __hash__ = _Hashed.__hash__


@dataclass(frozen=True)
class Unknown:
    """Anything: the source says where it comes from."""

    source: ast.AST | str = "?"


Value = Const | Text | Items | Table | External | ModuleValue | Class | Function | Partial | Super | Instance | Unknown


@dataclass(frozen=True)
class Frame(_Hashed):
    """An activation of a scope: of which scope, inside which other, called from where, on which object.

    A function's frame with neither call nor instance is "some activation": who called is chosen when it matters.
    """

    scope: Scope
    lexical: Frame | None = None
    call: ast.Call | None = None
    caller: Frame | None = None
    instance: Instance | None = None
    skip: int = 0  # arguments of the call that are not passed on, e.g. the object in `Base.__init__(self, x)`

    __hash__ = _Hashed.__hash__


@dataclass(frozen=True)
class World:
    """Choices made where several things are possible, so that two arguments of one call belong together."""

    choices: Mapping[Hashable, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def chosen(self, key: Hashable, index: int) -> World:
        """Return the world in which one more choice is made."""
        return World({**self.choices, key: index}, self.notes)

    def noting(self, note: str) -> World:
        """Return the world with a note about what follows."""
        return self if note in self.notes else World(self.choices, (*self.notes, note))


_MAX_BITS = 64  # of an integer that weighs as much as any other value

Results = list[tuple[Value, World]]


def source_of(node: ast.AST) -> str:
    """Return an expression as its source has it, on one line, short."""
    try:
        text = " ".join(ast.unparse(node).split())
    except (ValueError, RecursionError, AttributeError):
        return "..."
    return text if len(text) <= 60 else f"{text[:57]}..."


def text_of(value: Value) -> Text | None:
    """Return a value as a text with holes, or None where it can be none."""
    match value:
        case Const(str(text)):
            return Text((text,))
        case Const(bool() | int() | float() as number):
            return Text((str(number),))
        case Text():
            return value
        case Unknown(source):
            return Text((Hole(source),))
    return None


def weight(value: Value) -> int:
    """Return how large a value is: characters and elements of it, and of what it holds; no model has huge numbers."""
    match value:
        case Const(str() | bytes() as text):
            return len(text)
        case Const(int(number)) if number.bit_length() > _MAX_BITS:
            return number.bit_length() if number.bit_length() <= sys.float_info.max_exp else sys.maxsize
        case Text(parts):
            return sum(len(part) if isinstance(part, str) else 1 for part in parts)
        case Items(values):
            return len(values) + sum(map(weight, values))
        case Table(items):
            return len(items) + sum(weight(key) + weight(item) for key, item in items)
    return 1


def joined(parts: list[Text]) -> Const | Text:
    """Return texts in a row as one; a Const where nothing is unknown."""
    flat: list[str | Hole] = []
    for part in (piece for text in parts for piece in text.parts):
        if flat and isinstance(part, str) and isinstance(flat[-1], str):
            flat[-1] += part
        elif part != "":
            flat.append(part)
    if not flat:
        return Const("")
    if len(flat) == 1 and isinstance(flat[0], str):
        return Const(flat[0])
    return Text(tuple(flat))
