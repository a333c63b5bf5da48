"""Builds what both languages have while a parser reduces: fields, ports, types, values."""

# ruff: noqa: D102 (the methods of a builder are named for the rules of the grammars, and these tell what they are)

from __future__ import annotations

import math
import re
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from lark import Transformer

from ros_model.errors import ModelError, short
from ros_model.language.metamodel import ParameterType, PortKind, Position, TypedParameter, Value

if TYPE_CHECKING:
    from collections.abc import Iterable

    from lark import Token

MAX_NESTING = 64
"""Levels of lists and structs within each other that are read; published files have two."""
MAX_ERRORS = 20
"""Errors of one file that are told."""

_INTEGER = re.compile(r"[-+]?\d{1,300}")  # longer ones are no double either
_DOUBLE = re.compile(r"[-+]?(?:\d++\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|(.))", re.DOTALL)
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "'": "'", '"': '"', "\\": "\\"}
_BOOLEANS = {"true": True, "True": True, "false": False, "False": False}

Field = tuple[str, Any, "Token"]
"""What a field of an element becomes: its key, its value, the word that opens it."""
_Parameter = TypeVar("_Parameter", bound=TypedParameter)


@dataclass
class _Reading:
    """A file that is being read."""

    file: str
    header: str
    depth: int = 0
    errors: list[ModelError] = field(default_factory=list)
    doubtful: list[ModelError] = field(default_factory=list)  # that may come from what was left out


_reading: ContextVar[_Reading] = ContextVar("reading")
"""The file that this thread reads: a grammar has one builder, which threads share."""


class Builder(Transformer):
    """Builds a model bottom-up while the parser reduces: here, what both languages have."""

    def begin(self, file: str, header: str) -> None:
        """Get ready for the next file."""
        _reading.set(_Reading(file, header))

    @property
    def header(self) -> str:
        """The comments at the top of the file."""
        return _reading.get().header

    @property
    def errors(self) -> list[ModelError]:
        """What is wrong so far."""
        return _reading.get().errors

    @property
    def doubtful(self) -> list[ModelError]:
        """The errors so far, except those that may follow from a part that was left out."""
        return _reading.get().doubtful

    # Fields

    def title(self, items: list[Token]) -> Field:
        return "name", text_of(items[1]), items[0]

    def type_field(self, items: list[Any]) -> Field:
        return "type", items[1], items[0]

    def value_field(self, items: list[Any]) -> Field:
        keyword, value = items
        return "value", (self.plain(value), self._place_of(value) or self.at(keyword)), keyword

    # Namespaces, written as ROS writes them: /global, relative, ~private

    def namespace(self, items: list[Any]) -> Field:
        keyword, name = items
        return "namespace", name if type(name) is str else text_of(name), keyword

    def global_namespace(self, items: list[Token | None]) -> str:
        return f"/{_joined(items)}"

    def relative_namespace(self, items: list[Token | None]) -> str:
        return _joined(items)

    def private_namespace(self, items: list[Token | None]) -> str:
        return f"~{_joined(items)}"

    # Ports

    def publishers(self, items: list[Any]) -> Field:
        return self._ports(PortKind.PUBLISHER, items)

    def subscribers(self, items: list[Any]) -> Field:
        return self._ports(PortKind.SUBSCRIBER, items)

    def service_servers(self, items: list[Any]) -> Field:
        return self._ports(PortKind.SERVICE_SERVER, items)

    def service_clients(self, items: list[Any]) -> Field:
        return self._ports(PortKind.SERVICE_CLIENT, items)

    def action_servers(self, items: list[Any]) -> Field:
        return self._ports(PortKind.ACTION_SERVER, items)

    def action_clients(self, items: list[Any]) -> Field:
        return self._ports(PortKind.ACTION_CLIENT, items)

    def _ports(self, kind: PortKind, items: list[Any]) -> Field:
        return kind.value, tuple(self.port_of(kind, item) for item in items[1:]), items[0]

    def port_of(self, kind: PortKind, item: Any) -> Any:
        """Return a port of a kind, from what the rule `port` of the language has become."""
        raise NotImplementedError

    # Types

    def primitive(self, items: list[Any]) -> ParameterType:
        return self._type(str(items[0]), items)

    def list_type(self, items: list[Any]) -> ParameterType:
        elements = tuple(item for item in items if isinstance(item, ParameterType))
        return self._type("List", items, elements=elements)

    def array_type(self, items: list[Any]) -> ParameterType:
        """Build an Array; a default within its braces is its own, though its element's type may have taken it."""
        elements = [item for item in items if isinstance(item, ParameterType)]
        declared = self._type("Array", items)
        if declared.default is None and elements:
            declared = _with_default(declared, elements[0].default, elements[0].default_position)
            elements[0] = _with_default(elements[0], None, Position())
        return replace(declared, elements=tuple(elements))

    def struct_type(self, items: list[Any]) -> ParameterType:
        members = tuple(item.member for item in items if isinstance(item, _MemberType))
        return self._type("Struct", items, members=members)

    def member_type(self, items: list[Any]) -> _MemberType:
        return _MemberType((text_of(items[0]), items[1]))

    def old_member_type(self, items: list[Any]) -> _MemberType:
        declared = next(item for item in items if isinstance(item, ParameterType))
        default = _default(items)
        if default.value is not None:
            declared = _with_default(declared, default.value, default.position)
        return _MemberType((text_of(items[0]), declared))

    def _type(self, kind: str, items: list[Any], **inside: Any) -> ParameterType:
        default = _default(items)
        return ParameterType(
            kind, default=default.value, position=self.at(items[0]), default_position=default.position, **inside
        )

    def default(self, items: list[Any]) -> _Default:
        if not items:
            return _Default()
        return _Default(self.plain(items[-1]), self._place_of(items[-1]) or Position())

    # Values

    def any_value(self, items: list[Any]) -> _Value:
        text = items[-1] if items else None
        return _Value("" if text is None else text_of(text), text)

    def struct_value(self, items: list[Any]) -> _Value:
        return _Value(self._struct([item for item in items if isinstance(item, _Member)]), items[0])

    def list_value(self, items: list[Any]) -> _Value | _Members:
        """Build a list, a struct, or the braces around a member of a struct, by what is inside."""
        opening, *entries = (item for item in items if item is not None)
        members = [entry for entry in entries if isinstance(entry, _Member)]
        if members and len(members) == len(entries) == 1:
            return _Members(members, opening)
        members += [entry.members[0] for entry in entries if isinstance(entry, _Members)]
        if not members:
            return _Value([self.plain(entry) for entry in entries], opening)
        if len(members) < len(entries):
            self._doubt("members of a struct and values of a list are mixed here", opening)
        return _Value(self._struct(members), opening)

    def member(self, items: list[Any]) -> _Member:
        name, _, value = items
        return _Member(text_of(name), self.plain(value), name)

    def open(self, items: list[Token]) -> Token:
        reading = _reading.get()
        reading.depth += 1
        if reading.depth > MAX_NESTING:
            raise ModelError(f"values are nested deeper than {MAX_NESTING} levels", self.at(items[0]))
        return items[0]

    def close(self, items: list[Token]) -> None:  # noqa: ARG002
        _reading.get().depth -= 1

    # Helpers

    def at(self, token: Token) -> Position:
        """Return where a token stands."""
        return Position(_reading.get().file, token.line or 0, token.column or 0)

    def refuse(self, message: str, token: Token) -> None:
        """Note an error, and go on."""
        if len(self.errors) < MAX_ERRORS:
            self.errors.append(ModelError(message, self.at(token)))

    def _doubt(self, message: str, token: Token) -> None:
        """Note an error that counts only if nothing was left out."""
        if len(self.doubtful) < MAX_ERRORS:
            self.doubtful.append(ModelError(message, self.at(token)))

    def fields(
        self, fields: Iterable[Field], keyword: Token, *, needs_name: bool = False, name: str | None = None
    ) -> dict[str, Any]:
        """Return an element's fields by their keys; sections that stand twice are joined, other fields refused.

        Beside a `value` is the `value_position`.

        Args:
            fields: the fields.
            keyword: the word that opens the element.
            needs_name: whether one of them must be its name.
            name: the name that stands before the braces, where the language has it there.
        """
        found: dict[str, Any] = {} if name is None else {"name": name}
        for key, value, token in fields:
            if key not in found:
                found[key] = value
            elif isinstance(value, tuple) and key not in {"From", "To", "value"}:
                found[key] += value
            else:
                self.refuse(f"second '{token}' in this {keyword}: keep one", token)
        if needs_name and "name" not in found:
            self._doubt(f"this {keyword} has no name: add one", keyword)
            found["name"] = ""
        if "value" in found:
            found["value"], found["value_position"] = found["value"]
        return found

    def typed_parameter(self, kind: type[_Parameter], items: list[Any]) -> _Parameter:
        """Return the parameter that [keyword, optional name, field, ...] is."""
        name, rest = split_name(items)
        fields = self.fields(rest, items[0], needs_name=True, name=name)
        return kind(
            fields["name"],
            fields.get("type"),
            fields.get("value"),
            fields.get("namespace"),
            self.at(items[0]),
            fields.get("value_position", Position()),
        )

    def _place_of(self, value: Token | _Value | _Members) -> Position | None:
        """Return where a value begins; None where it is empty (`ParameterAny { }`)."""
        first = value.token if isinstance(value, (_Value, _Members)) else value
        return None if first is None else self.at(first)

    def plain(self, item: Token | _Value | _Members) -> Value:
        """Return a value as Python has it."""
        if isinstance(item, _Members):
            return self._struct(item.members)
        if isinstance(item, _Value):
            return item.value
        if item.type == "STRING":
            return text_of(item)
        if item in _BOOLEANS:
            return _BOOLEANS[item]
        return self._number_or_word(item)

    def _number_or_word(self, word: Token) -> Value:
        if _INTEGER.fullmatch(word):
            return int(word)
        if not _DOUBLE.fullmatch(word):
            return str(word)
        number = float(word)
        if math.isfinite(number):
            return number
        self.refuse(f"{short(word)} is too large for a double", word)
        return 0.0

    def _struct(self, members: Iterable[_Member]) -> dict[str, Value]:
        struct: dict[str, Value] = {}
        for member in members:
            if member.name in struct:
                self.refuse(f"second member {member.name!r} in this struct: keep one", member.token)
            struct[member.name] = member.value
        return struct


class _Value(NamedTuple):
    """A list or struct, told apart from tokens."""

    value: Value
    token: Token | None  # the first


class _Member(NamedTuple):
    """A member of a struct value."""

    name: str
    value: Value
    token: Token


class _Members(NamedTuple):
    """Braces with one member in them: a struct by itself, a member of one within other braces."""

    members: list[_Member]
    token: Token


class _MemberType(NamedTuple):
    """A member of a struct type."""

    member: tuple[str, ParameterType]


class _Default(NamedTuple):
    """The default of a type; None where its braces are empty."""

    value: Value | None = None
    position: Position = Position()


def text_of(token: Token) -> str:
    """Return what a name or string says: without quotes, escapes replaced."""
    if token.type != "STRING":
        return str(token)
    text = token[1:-1]
    return _ESCAPE.sub(_unescape, text) if "\\" in text else text


def split_name(items: list[Any]) -> tuple[str | None, list[Field]]:
    """Split [keyword, optional name, field, ...] into the name and the fields."""
    if len(items) > 1 and not isinstance(items[1], tuple):
        return (None if items[1] is None else text_of(items[1])), items[2:]
    return None, items[1:]


def _joined(parts: list[Token | None]) -> str:
    return "/".join(text_of(part) for part in parts if part is not None)


def _default(items: Iterable[Any]) -> _Default:
    return next((item for item in items if isinstance(item, _Default)), _Default())


def _with_default(declared: ParameterType, default: Value | None, position: Position) -> ParameterType:
    return replace(declared, default=default, default_position=position)


def _unescape(match: re.Match[str]) -> str:
    if match[1]:
        return chr(int(match[1], 16))
    return _ESCAPED.get(match[2], match[0])
