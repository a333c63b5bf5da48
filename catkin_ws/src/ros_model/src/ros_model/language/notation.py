"""How both languages write names, texts, types and values, and lay out their lists: one form for each."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, TypeVar

from ros_model.errors import ModelError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from ros_model.language.metamodel import ParameterType, Port, PortKind, Position, TypedParameter, Value
    from ros_model.language.packages import PortDeclaration

_P = TypeVar("_P", "Port", "PortDeclaration")

INDENT = "    "
_BARE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_KEYWORDS = re.compile(  # of one grammar or the other, that may be names, too
    "[Nn]ame|type|value|default|ns|namespace|node|package|artifact|spec|dependency|sequence|parts|message|service|action"
    "|request|response|goal|result|feedback|publisher|subscriber|service(server|client)|action(server|client)|parameter"
    "|From|To|Node|Artifact|Package|Specs|Dependencies|Publishers?|Subscribers?|Parameters?|Header|true|false"
    "|Parameter(Any|Struct|StructMember|StructTypeMember)|parameterstructypetmember|(Global|Relative|Private)Namespace"
    "|Integer|Double|String|Boolean|Base64|Date|Any|List|Array|Struct?"
)
_ESCAPES = {"\\": "\\\\", "'": "\\'", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
_UNPRINTABLE = re.compile(r"[\\'\x00-\x1f\x7f\ud800-\udfff]")


def comments(header: str) -> list[str]:
    """Return the lines of the comments at the top of a file."""
    return [f"// {line}".rstrip() for line in header.split("\n")] if header else []


def indented(lines: Iterable[str]) -> list[str]:
    """Return lines one level deeper."""
    return [f"{INDENT}{line}" for line in lines]


def sequence(elements: Iterable[list[str]]) -> list[str]:
    """Return the lines of elements, commas between them."""
    found = [list(element) for element in elements]
    for element in found[:-1]:
        element[-1] += ","
    return [line for element in found for line in element]


def section(word: str, braces: str, elements: Iterable[list[str]]) -> list[str]:
    """Return the lines of a list of elements with its word and braces; nothing for none."""
    lines = sequence(elements)
    return [f"{word} {braces[0]}", *indented(lines), braces[1]] if lines else []


def port_sections(
    words: Mapping[PortKind, tuple[str, str, str]], ports: Sequence[_P], text: Callable[[str, str, _P], str]
) -> list[str]:
    """Return the lists of ports, by kind.

    Args:
        words: of a list, of a port in it, and of what the port leads to, for each kind in the language's order.
        ports: the ports.
        text: makes the line of a port, given the latter two.
    """
    lines: list[str] = []
    for kind, (word, element, inner) in words.items():
        lines += section(word, "{}", ([text(element, inner, port)] for port in ports if port.kind is kind))
    return lines


def typed_fields(parameter: TypedParameter) -> list[str]:
    """Return the type and the value of a parameter, as far as it has them."""
    fields = [f"type {type_text(parameter.type, parameter.position)}"] if parameter.type else []
    if parameter.value is not None:
        fields.append(f"value {value_text(parameter.value, parameter.position)}")
    return fields


def block(fields: Iterable[str]) -> str:
    """Return fields in braces, on one line."""
    return " ".join(["{", *fields, "}"])


def type_text(declared: ParameterType, position: Position) -> str:
    """Return a type of a parameter; `position` is told if a default has no notation."""
    default = "" if declared.default is None else f" default {value_text(declared.default, position)}"
    if declared.kind == "Array":
        elements = " ".join(f"type {type_text(element, position)}" for element in declared.elements)
        return f"Array {{ {elements}{default} }}"
    if declared.kind == "List":
        return f"List {{ {', '.join(type_text(element, position) for element in declared.elements)} }}{default}"
    if declared.kind == "Struct":
        members = ", ".join(f"{name_text(name)} {type_text(member, position)}" for name, member in declared.members)
        return f"Struct {{ {members} }}{default}"
    return declared.kind + default


def value_text(value: Value, position: Position) -> str:
    """Return a value.

    Raises:
        ModelError: it has no notation (infinite, not a number).
    """
    if isinstance(value, dict):
        members = (f"{{ {name_text(name)} {{ value {value_text(item, position)} }} }}" for name, item in value.items())
        return f"{{ {', '.join(members)} }}" if value else "ParameterStruct { }"  # braces alone are an empty list
    if isinstance(value, list):
        return f"{{ {', '.join(value_text(item, position) for item in value)} }}" if value else "{ }"
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        raise ModelError(f"the value {value} has no notation: give a finite number", position)
    return repr(value)


def name_text(text: str) -> str:
    """Return a name, bare where it can be: readers other than ours take a keyword for one everywhere."""
    return text if _BARE.fullmatch(text) and not _KEYWORDS.fullmatch(text) else quoted(text)


def quoted(text: str) -> str:
    """Return a text in quotes."""
    return f"'{_UNPRINTABLE.sub(_escape, text)}'"


def _escape(match: re.Match[str]) -> str:
    return _ESCAPES.get(match[0]) or f"\\u{ord(match[0]):04x}"
