"""Reads `.rossystem` files: from text to the frozen data of the metamodel, with the position of every element."""

from __future__ import annotations

import functools
import math
import re
import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from lark import Lark, Transformer
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from ros_model.errors import ModelError
from ros_model.files import read_text
from ros_model.metamodel import (
    Component,
    Connection,
    ConnectionKind,
    ParameterType,
    Port,
    PortKind,
    PortPath,
    Position,
    Reference,
    RosParameter,
    RosSystem,
    SystemParameter,
    Value,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from lark import Token

MAX_SIZE = 16_000_000
"""Characters of the largest file that is read; the largest published one has 432 thousand."""
MAX_NESTING = 64
"""Levels of lists and structs within each other that are read; published files have two."""

_PARSING = threading.Lock()  # the one parser builds through the one builder, which knows the file it is in
_COMMENT = re.compile(r"\s*(?://(?P<line>[^\n]*)|/\*(?P<block>.*?)\*/)", re.DOTALL)
_SKIPPED = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)|'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"|(?:(?!/\*)[^\s{}(),'"])+""", re.DOTALL
)
_INTEGER = re.compile(r"[-+]?\d{1,4000}")
_DOUBLE = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|(.))", re.DOTALL)
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "'": "'", '"': '"', "\\": "\\"}
_BOOLEANS = {"true": True, "True": True, "false": False, "False": False}
_ENDS_OF_FILE = {"$END", "<END-OF-FILE>"}  # lark's parser and lexer each have a name for it
_DESCRIBED = {
    "WORD": "a name or value",
    "STRING": "a string",
    "PRIMITIVE": "a type",
    "NAME": "'name'",
    "NAMESPACE": "'NameSpace'",
    "STRUCT": "'Struct'",
    "SERVICE_SERVER": "'RosServiceServer'",
    "SERVICE_CLIENT": "'RosServiceClient'",
    "ACTION_SERVER": "'RosActionServer'",
    "ACTION_CLIENT": "'RosActionClient'",
    "_LBRACE": "'{'",
    "_RBRACE": "'}'",
    "_LPAREN": "'('",
    "_RPAREN": "')'",
    "_COMMA": "','",
}


def read_system(path: str | Path) -> RosSystem:
    """Read a `.rossystem` file.

    Raises:
        ModelError: the file can't be read or is not well-formed; says file:line:column, what was expected, near what.
    """
    return parse_system(read_text(Path(path)), str(path))


def parse_system(text: str, file: str = "<text>") -> RosSystem:
    """Read the text of a `.rossystem` file; `file` is its name in positions and errors.

    Raises:
        ModelError: as read_system.
    """
    if len(text) > MAX_SIZE:
        raise ModelError(f"{len(text)} characters are too many for a model (at most {MAX_SIZE})", Position(file, 1, 1))
    parser, builder = _parser()
    with _PARSING:
        builder.begin(file, _header(text))
        try:
            return cast(RosSystem, parser.parse(text))
        except UnexpectedInput as error:
            raise _syntax_error(error, text, file) from None


def comments_inside(text: str, file: str = "<text>") -> tuple[Position, ...]:
    """Return where comments stand that are not at the top of the file, and so are no part of its model."""
    start = _header_end(text)
    return tuple(
        Position(file, *_line_and_column(text, match.start()))
        for match in _SKIPPED.finditer(text, start)
        if match["comment"]
    )


@functools.cache
def _parser() -> tuple[Lark, _Builder]:
    builder = _Builder()
    grammar = (Path(__file__).parent / "grammar" / "rossystem.lark").read_text(encoding="utf-8")
    return Lark(grammar, start="system", parser="lalr", lexer="contextual", transformer=builder), builder


_Field = tuple[str, Any, "Token"]  # key, value, the keyword that opens it


class _Builder(Transformer):
    """Builds the model bottom-up while the parser reduces: one method for each rule of the grammar."""

    def __init__(self) -> None:
        super().__init__()
        self._file = ""
        self._header = ""
        self._depth = 0

    def begin(self, file: str, header: str) -> None:
        """Get ready for the next file."""
        self._file, self._header, self._depth = file, header, 0

    def system(self, items: list[Any]) -> RosSystem:
        keyword, *rest = items
        fields = self._fields(rest, keyword, needs_name=True)
        return RosSystem(
            name=fields["name"],
            components=fields.get("components", ()),
            connections=tuple(connection for kind in ConnectionKind for connection in fields.get(kind.value, ())),
            parameters=fields.get("parameters", ()),
            header=self._header,
            position=self._at(keyword),
        )

    # Fields

    def title(self, items: list[Token]) -> _Field:
        return "name", _text(items[1]), items[0]

    def namespace(self, items: list[Token]) -> _Field:
        return "namespace", _text(items[1]), items[0]

    def node(self, items: list[Token]) -> _Field:
        return "node", self._reference(items[1]), items[0]

    def reference(self, items: list[Token]) -> _Field:
        return "reference", self._reference(items[0]), items[0]

    def value_field(self, items: list[Any]) -> _Field:
        return "value", self._plain(items[1]), items[0]

    def type_field(self, items: list[Any]) -> _Field:
        return "type", items[1], items[0]

    # Components

    def components(self, items: list[Any]) -> _Field:
        return "components", tuple(items[1:]), items[0]

    def component(self, items: list[Any]) -> Component:
        keyword, *rest = items
        fields = self._fields(rest, keyword, needs_name=True)
        return Component(
            name=fields["name"],
            node=fields.get("node"),
            namespace=fields.get("namespace"),
            ports=tuple(port for kind in PortKind for port in fields.get(kind.value, ())),
            parameters=fields.get("parameters", ()),
            position=self._at(keyword),
        )

    def publishers(self, items: list[Any]) -> _Field:
        return self._ports(PortKind.PUBLISHER, items)

    def subscribers(self, items: list[Any]) -> _Field:
        return self._ports(PortKind.SUBSCRIBER, items)

    def service_servers(self, items: list[Any]) -> _Field:
        return self._ports(PortKind.SERVICE_SERVER, items)

    def service_clients(self, items: list[Any]) -> _Field:
        return self._ports(PortKind.SERVICE_CLIENT, items)

    def action_servers(self, items: list[Any]) -> _Field:
        return self._ports(PortKind.ACTION_SERVER, items)

    def action_clients(self, items: list[Any]) -> _Field:
        return self._ports(PortKind.ACTION_CLIENT, items)

    def port(self, items: list[Any]) -> tuple[str, dict[str, Any], Position]:
        keyword = items[0]
        name, rest = _split_name(items)
        fields = self._fields(rest, keyword)
        if name is None:
            name = fields["reference"].name if "reference" in fields else ""
        return name, fields, self._at(keyword)

    def ros_parameters(self, items: list[Any]) -> _Field:
        return "parameters", tuple(items[1:]), items[0]

    def ros_parameter(self, items: list[Any]) -> RosParameter:
        name, fields, position = self.port(items)
        return RosParameter(name, fields.get("reference"), fields.get("value"), fields.get("namespace"), position)

    # Connections

    def topics(self, items: list[Any]) -> _Field:
        return self._connections(ConnectionKind.TOPIC, items)

    def services(self, items: list[Any]) -> _Field:
        return self._connections(ConnectionKind.SERVICE, items)

    def actions(self, items: list[Any]) -> _Field:
        return self._connections(ConnectionKind.ACTION, items)

    def connection(self, items: list[Any]) -> tuple[str, dict[str, Any], Position]:
        keyword, name, *rest = items
        return _text(name), self._fields(rest, keyword), self._at(keyword)

    def sources(self, items: list[Token]) -> _Field:
        return "From", tuple(PortPath.parse(_text(token)) for token in items[1:]), items[0]

    def targets(self, items: list[Token]) -> _Field:
        return "To", tuple(PortPath.parse(_text(token)) for token in items[1:]), items[0]

    # Parameters of the system, types and values

    def parameters(self, items: list[Any]) -> _Field:
        return "parameters", tuple(items[1:]), items[0]

    def parameter(self, items: list[Any]) -> SystemParameter:
        keyword, *rest = items
        fields = self._fields(rest, keyword, needs_name=True)
        return SystemParameter(
            fields["name"], fields.get("type"), fields.get("value"), fields.get("namespace"), self._at(keyword)
        )

    def primitive(self, items: list[Any]) -> ParameterType:
        return ParameterType(str(items[0]), default=_default(items))

    def list_type(self, items: list[Any]) -> ParameterType:
        elements = tuple(item for item in items if isinstance(item, ParameterType))
        return ParameterType("List", elements, default=_default(items))

    def array_type(self, items: list[Any]) -> ParameterType:
        """Build an Array; a default within its braces is its own, though its element's type may have taken it."""
        elements = [item for item in items if isinstance(item, ParameterType)]
        default = _default(items)
        if default is None and elements:
            default = elements[0].default
            elements[0] = replace(elements[0], default=None)
        return ParameterType("Array", tuple(elements), default=default)

    def struct_type(self, items: list[Any]) -> ParameterType:
        members = tuple(item.member for item in items if isinstance(item, _MemberType))
        return ParameterType("Struct", members=members, default=_default(items))

    def member_type(self, items: list[Any]) -> _MemberType:
        return _MemberType((_text(items[0]), items[1]))

    def default(self, items: list[Any]) -> _Default:
        return _Default(self._plain(items[-1]))

    def list_value(self, items: list[Any]) -> _Value:
        opening, *entries = (item for item in items if item is not None)
        members = [entry for entry in entries if isinstance(entry, _Member)]
        if not members:
            return _Value([self._plain(entry) for entry in entries])
        if len(members) < len(entries):
            raise ModelError("members of a struct and values of a list are mixed here", self._at(opening))
        struct: dict[str, Value] = {}
        for entry in members:
            if entry.name in struct:
                raise ModelError(f"second member {entry.name!r} in this struct: keep one", self._at(opening))
            struct[entry.name] = entry.value
        return _Value(struct)

    def member(self, items: list[Any]) -> _Member:
        name, _, value = items[1:4]
        return _Member(_text(name), self._plain(value))

    def open(self, items: list[Token]) -> Token:
        self._depth += 1
        if self._depth > MAX_NESTING:
            raise ModelError(f"values are nested deeper than {MAX_NESTING} levels", self._at(items[0]))
        return items[0]

    def close(self, items: list[Token]) -> None:  # noqa: ARG002
        self._depth -= 1

    # Helpers

    def _at(self, token: Token) -> Position:
        return Position(self._file, token.line or 0, token.column or 0)

    def _fields(self, fields: Iterable[_Field], keyword: Token, *, needs_name: bool = False) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, value, token in fields:
            if key in found:
                raise ModelError(f"second '{token}' in this {keyword}: keep one", self._at(token))
            found[key] = value
        if needs_name and "name" not in found:
            raise ModelError(f"this {keyword} has no name: add one", self._at(keyword))
        return found

    def _ports(self, kind: PortKind, items: list[Any]) -> _Field:
        ports = tuple(
            Port(name, kind, fields.get("reference"), fields.get("namespace"), position)
            for name, fields, position in items[1:]
        )
        return kind.value, ports, items[0]

    def _connections(self, kind: ConnectionKind, items: list[Any]) -> _Field:
        connections = tuple(
            Connection(name, kind, fields.get("From", ()), fields.get("To", ()), position)
            for name, fields, position in items[1:]
        )
        return kind.value, connections, items[0]

    def _reference(self, token: Token) -> Reference:
        """Split a reference; one with parts missing at its end is for the checker, as its spelling is not wrong."""
        parts = _text(token).split(".", 3)
        if "" in parts[:3]:
            raise ModelError(f"reference '{_short(_text(token))}' is not package.artifact.node[.name]", self._at(token))
        return Reference(*parts, *[""] * (3 - len(parts)))

    def _plain(self, item: Token | _Value) -> Value:
        if isinstance(item, _Value):
            return item.value
        if item.type == "STRING":
            return _text(item)
        if item in _BOOLEANS:
            return _BOOLEANS[item]
        if _INTEGER.fullmatch(item):
            return int(item)
        if _DOUBLE.fullmatch(item):
            number = float(item)
            if math.isinf(number):
                raise ModelError(f"{_short(item)} is too large for a double", self._at(item))
            return number
        return str(item)


class _Value(NamedTuple):
    """A list or struct, told apart from tokens."""

    value: Value


class _Member(NamedTuple):
    """A member of a struct value."""

    name: str
    value: Value


class _MemberType(NamedTuple):
    """A member of a struct type."""

    member: tuple[str, ParameterType]


class _Default(NamedTuple):
    """The default of a type."""

    value: Value


def _default(items: Iterable[Any]) -> Value | None:
    return next((item.value for item in items if isinstance(item, _Default)), None)


def _split_name(items: list[Any]) -> tuple[str | None, list[_Field]]:
    """Split [keyword, optional name, field, ...] into the name and the fields."""
    if len(items) > 1 and not isinstance(items[1], tuple):
        return (None if items[1] is None else _text(items[1])), items[2:]
    return None, items[1:]


def _text(token: Token) -> str:
    """Return what a name or string says: without quotes, escapes replaced."""
    if token.type != "STRING":
        return str(token)
    text = token[1:-1]
    return _ESCAPE.sub(_unescape, text) if "\\" in text else text


def _unescape(match: re.Match[str]) -> str:
    if match[1]:
        return chr(int(match[1], 16))
    return _ESCAPED.get(match[2], match[0])


def _header_end(text: str) -> int:
    end = 0
    while match := _COMMENT.match(text, end):
        end = match.end()
    return end


def _header(text: str) -> str:
    """Return the comments at the top of a file, without their marks."""
    lines: list[str] = []
    end = 0
    while match := _COMMENT.match(text, end):
        end = match.end()
        if match["line"] is not None:
            lines.append(match["line"].removeprefix(" ").rstrip())
        else:
            block = [line.strip().removeprefix("*").removeprefix(" ").rstrip() for line in match["block"].splitlines()]
            lines += "\n".join(block).strip("\n").split("\n")
    return "\n".join(lines)


def _line_and_column(text: str, offset: int) -> tuple[int, int]:
    return text.count("\n", 0, offset) + 1, offset - (text.rfind("\n", 0, offset) + 1) + 1


def _short(text: str) -> str:
    return text if len(text) <= 40 else f"{text[:37]}..."


def _syntax_error(error: UnexpectedInput, text: str, file: str) -> ModelError:
    """Say what was expected and near what, in one line."""
    names: set[str] = set()
    offset = error.pos_in_stream or 0
    if isinstance(error, UnexpectedToken):
        names = set(error.accepts or error.expected)
        near = f"'{_short(str(error.token))}'"
        if error.token.type == "$END":
            offset, near = len(text.rstrip()), "the end of the file"
    elif isinstance(error, UnexpectedCharacters):
        names = set(error.allowed or ())
        near = repr(_short(text[offset:].split("\n", 1)[0]))
        if text[offset : offset + 1] in {"'", '"'}:
            near = f"a string that is never closed, {near}"
        elif text.startswith("/*", offset):
            return ModelError("this comment is never closed: add '*/'", Position(file, *_line_and_column(text, offset)))
    else:
        near = "the end of the file"
    expected = sorted((_described(name) for name in names - {"COMMENT"} - _ENDS_OF_FILE), key=_words_first)
    if names & _ENDS_OF_FILE:
        expected.append("the end of the file")
    wanted = " or ".join(expected) or "something else"
    return ModelError(f"expected {wanted} near {near}", Position(file, *_line_and_column(text, offset)))


def _words_first(described: str) -> tuple[bool, str]:
    return not described[1].isalpha(), described


@functools.cache
def _described(terminal: str) -> str:
    """Return a terminal as a user writes it."""
    if terminal in _DESCRIBED:
        return _DESCRIBED[terminal]
    pattern = _parser()[0].get_terminal(terminal).pattern.to_regexp()
    word = re.match(r"[(?:]*(\w+|\\?\W)", pattern)
    return f"'{word[1].removeprefix(chr(92))}'" if word else terminal
