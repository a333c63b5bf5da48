"""What the readers of both languages share: the parser, its errors, and the building of types and values."""

# ruff: noqa: D102 (the methods of a builder are named for the rules of the grammars, and these tell what they are)

from __future__ import annotations

import difflib
import math
import re
import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from lark import Lark, Transformer
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from ros_model.errors import ModelError, first_of
from ros_model.files import MAX_SIZE
from ros_model.language.comments import header
from ros_model.language.metamodel import ParameterType, PortKind, Position, TypedParameter, Value
from ros_model.language.recovery import Recovery

if TYPE_CHECKING:
    from collections.abc import Iterable

    from lark import Token

MAX_NESTING = 64
"""Levels of lists and structs within each other that are read; published files have two."""
MAX_ERRORS = 20
"""Errors of one file that are told."""
_REPAIRABLE = 500_000  # characters of a text, and that are read again all in all, to find more errors than one

_GRAMMARS = Path(__file__).parent / "grammar"
_SKIPPED = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)|'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"|(?:(?!/\*)[^\s{}(),'"])+""", re.DOTALL
)
_INTEGER = re.compile(r"[-+]?\d{1,300}")  # longer ones are no double either
_DOUBLE = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|(.))", re.DOTALL)
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "'": "'", '"': '"', "\\": "\\"}
_BOOLEANS = {"true": True, "True": True, "false": False, "False": False}
_ENDS_OF_FILE = {"$END", "<END-OF-FILE>"}  # lark's parser and lexer each have a name for it
_DESCRIBED = {
    "WORD": "a name or value",
    "FIELD_WORD": "a type or name",
    "CONSTANT": "a value",
    "STRING": "a string",
    "BRACKETS": "'[]'",
    "PRIMITIVE": "a type",
}
_UNTOLD = {  # what could stand in a place, but nobody writes today
    "COMMENT",
    "_ANY_VALUE",
    "_ARTIFACTS",
    "_GLOBAL",
    "_MEMBER",
    "_MEMBER_TYPE",
    "_NODE",
    "_PACKAGES",
    "_PRIVATE",
    "_RELATIVE",
    "_SEQUENCE",
    "_STRUCT_MEMBERS",
    "_STRUCT_VALUE",
}
_SPELLINGS = re.compile(r'^(\w+)(?:\.2)?: \(?((?:"[^"]+"(?: \| )?)+)\)?(?: _END)?$', re.MULTILINE)  # in a grammar

Field = tuple[str, Any, "Token"]
"""What a field of an element becomes: its key, its value, the word that opens it."""
_Parameter = TypeVar("_Parameter", bound=TypedParameter)


class Language:
    """A language: its grammar's parser, and the builder that makes a model while the parser reduces.

    Args:
        grammar: name of the grammar's file, which the words, types and values that both languages share complete.
        start: the rule of a whole file.
        builder: has one method for each rule.
    """

    def __init__(self, grammar: str, start: str, builder: Builder) -> None:
        text = "\n".join((_GRAMMARS / name).read_text(encoding="utf-8") for name in (grammar, "common.lark"))
        self._builder = builder
        self._words = {name: re.findall('"([^"]+)"', words) for name, words in _SPELLINGS.findall(text)}
        self._parser = Lark(text, start=start, parser="lalr", lexer="contextual", transformer=builder)
        self._parsing = threading.Lock()  # there is one builder, and it knows the file that it is in

    def read(self, text: str, file: str) -> Any:
        """Return the model that a text is; `file` is its name in positions and errors.

        Raises:
            ModelError: the first thing that is wrong, with the others in the file as far as it could be read.
        """
        if len(text) > MAX_SIZE:
            raise ModelError(f"{len(text)} characters are too many for a model ({MAX_SIZE})", Position(file, 1, 1))
        with self._parsing:
            errors: list[ModelError] = []
            model = self._read(text, file, errors)
        if errors:
            raise first_of(errors)
        return model

    def _read(self, text: str, file: str, errors: list[ModelError]) -> Any:
        """Read; where a statement is wrong, add its error, read again without it, and so on."""
        recovery = Recovery(text)
        remaining = text
        read = 0
        while True:
            self._builder.begin(file, header(text))
            try:
                model = self._parser.parse(remaining)
            except UnexpectedInput as error:
                offset = _offset(error, text)
                if not recovery.is_consequence(offset):
                    errors.append(self._syntax_error(error, offset, text, file))
                read += offset
                if len(errors) >= MAX_ERRORS or max(read, len(text)) > _REPAIRABLE:
                    return None
                repaired = recovery.without(
                    offset, {word for name in _expected(error) for word in self._words.get(name, ())}
                )
                if repaired is None:
                    return None
                remaining = repaired
            except ModelError as error:  # of what can't be repaired
                errors += [*self._builder.errors, error]
                return None
            else:
                errors += [*self._builder.errors, *(() if errors else self._builder.doubtful)]
                return model

    def _syntax_error(self, error: UnexpectedInput, offset: int, text: str, file: str) -> ModelError:
        """Say what was expected and near what, in one line."""
        position = Position(file, *line_and_column(text, offset))
        names = _expected(error)
        hint = ""
        if offset >= len(text.rstrip()):
            near = "the end of the file"
            position = Position(file, *line_and_column(text, len(text.rstrip())))
        elif isinstance(error, UnexpectedToken):
            near = f"'{short(str(error.token))}'"
            hint = _of_an_open_quote(text, offset) or self._similar(str(error.token), names)
        else:
            near = repr(short(text[offset:].split("\n", 1)[0]))
            if text[offset] in "'\"":
                near = f"a string that is never closed, {near}"
            elif text.startswith("/*", offset):
                return ModelError("this comment is never closed: add '*/'", position)
        expected = sorted({self._described(name) for name in names - _UNTOLD - _ENDS_OF_FILE}, key=_words_first)
        if names & _ENDS_OF_FILE:
            expected.append("the end of the file")
        return ModelError(f"expected {' or '.join(expected) or 'something else'} near {near}{hint}", position)

    def _described(self, terminal: str) -> str:
        """Return a terminal as a user writes it, in the first of its spellings."""
        return _DESCRIBED.get(terminal) or f"'{self._words[terminal][0] if terminal in self._words else '='}'"

    def _similar(self, word: str, names: Iterable[str]) -> str:
        """Return the hint that another word was meant, where the one found is almost an expected one."""
        words = [word for name in sorted(names) for word in self._words.get(name, ())]
        found = difflib.get_close_matches(word, words, n=1, cutoff=0.75) if len(word) < 40 else []
        return f": did you mean '{found[0]}'?" if found else ""


class Builder(Transformer):
    """Builds a model bottom-up while the parser reduces: here, what both languages have."""

    def __init__(self) -> None:
        super().__init__()
        self.errors: list[ModelError] = []
        self.doubtful: list[ModelError] = []  # that may come from what was left out
        self._file = ""
        self.header = ""
        self._depth = 0

    def begin(self, file: str, header: str) -> None:
        """Get ready for the next file."""
        self._file, self.header, self._depth = file, header, 0
        self.errors, self.doubtful = [], []

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
        self._depth += 1
        if self._depth > MAX_NESTING:
            raise ModelError(f"values are nested deeper than {MAX_NESTING} levels", self.at(items[0]))
        return items[0]

    def close(self, items: list[Token]) -> None:  # noqa: ARG002
        self._depth -= 1

    # Helpers

    def at(self, token: Token) -> Position:
        """Return where a token stands."""
        return Position(self._file, token.line or 0, token.column or 0)

    def refuse(self, message: str, token: Token) -> None:
        """Note an error, and go on."""
        if len(self.errors) < MAX_ERRORS:
            self.errors.append(ModelError(message, self.at(token)))

    def _doubt(self, message: str, token: Token) -> None:
        """Note an error that is none where something was left out."""
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


def _joined(parts: list[Token | None]) -> str:
    return "/".join(text_of(part) for part in parts if part is not None)


def split_name(items: list[Any]) -> tuple[str | None, list[Field]]:
    """Split [keyword, optional name, field, ...] into the name and the fields."""
    if len(items) > 1 and not isinstance(items[1], tuple):
        return (None if items[1] is None else text_of(items[1])), items[2:]
    return None, items[1:]


def line_and_column(text: str, offset: int) -> tuple[int, int]:
    """Return line and column, from 1, of an offset."""
    return text.count("\n", 0, offset) + 1, offset - (text.rfind("\n", 0, offset) + 1) + 1


def _default(items: Iterable[Any]) -> _Default:
    return next((item for item in items if isinstance(item, _Default)), _Default())


def _with_default(declared: ParameterType, default: Value | None, position: Position) -> ParameterType:
    return replace(declared, default=default, default_position=position)


def _unescape(match: re.Match[str]) -> str:
    if match[1]:
        return chr(int(match[1], 16))
    return _ESCAPED.get(match[2], match[0])


def _offset(error: UnexpectedInput, text: str) -> int:
    """Return where an error is; the end of the text where something is missing there."""
    if isinstance(error, UnexpectedToken) and error.token.type != "$END":
        return int(error.token.start_pos or 0)
    return (error.pos_in_stream or 0) if isinstance(error, UnexpectedCharacters) else len(text)


def _of_an_open_quote(text: str, offset: int) -> str:
    """Return the hint that a quote is missing, where the string before an error goes on over the end of a line."""
    last = None
    for match in _SKIPPED.finditer(text, 0, offset if offset <= _REPAIRABLE else 0):
        last = match
    if last is None or last[0][0] not in "'\"" or "\n" not in last[0]:
        return ""
    return f": the string before it begins in line {line_and_column(text, last.start())[0]}, is its quote missing?"


def _expected(error: UnexpectedInput) -> set[str]:
    """Return the names of the terminals that could stand where an error is."""
    if isinstance(error, UnexpectedToken):
        return set(error.accepts or error.expected)
    return set(error.allowed or ()) if isinstance(error, UnexpectedCharacters) else set()


def short(text: str) -> str:
    """Return a text as a message can quote it."""
    return text if len(text) <= 40 else f"{text[:37]}..."


def _words_first(described: str) -> tuple[bool, str]:
    return not described[1].isalpha(), described
