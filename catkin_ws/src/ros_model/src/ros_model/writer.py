"""Writes `.rossystem` files in one canonical form; what is written reads back as an equal model."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.metamodel import Component, Connection, ConnectionKind, ParameterType, PortKind, PortPath, Value

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.metamodel import Port, Position, Reference, RosParameter, RosSystem, SystemParameter

_INDENT = "    "
_BARE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_ESCAPES = {"\\": "\\\\", "'": "\\'", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
_UNPRINTABLE = re.compile(r"[\\'\x00-\x1f\x7f\ud800-\udfff]")

_PORT_WORDS = {
    PortKind.PUBLISHER: ("RosPublishers", "RosPublisher", "RefPublisher"),
    PortKind.SUBSCRIBER: ("RosSubscribers", "RosSubscriber", "RefSubscriber"),
    PortKind.SERVICE_SERVER: ("RosSrvServers", "RosServiceServer", "RefServer"),
    PortKind.SERVICE_CLIENT: ("RosSrvClients", "RosServiceClient", "RefClient"),
    PortKind.ACTION_SERVER: ("RosActionServers", "RosActionServer", "RefServer"),
    PortKind.ACTION_CLIENT: ("RosActionClients", "RosActionClient", "RefClient"),
}
_CONNECTION_WORDS = {
    ConnectionKind.TOPIC: ("TopicConnections", "TopicConnection"),
    ConnectionKind.SERVICE: ("ServiceConnections", "ServiceConnection"),
    ConnectionKind.ACTION: ("ActionConnections", "ActionConnection"),
}


def write_system(system: RosSystem) -> str:
    """Return the text of a `.rossystem` file.

    Ports and connections are written by kind, in the order of PortKind and ConnectionKind.

    Raises:
        ModelError: a value has no notation in the language (infinite, not a number, an empty struct).
    """
    lines = [f"// {line}".rstrip() for line in system.header.split("\n")] if system.header else []
    lines.append("RosSystem {")
    lines.append(f"{_INDENT}Name {_quoted(system.name)}")
    lines += _section("RosComponents", "()", (_component(component) for component in system.components))
    for kind, (section, word) in _CONNECTION_WORDS.items():
        found = (_connection(word, connection) for connection in system.connections if connection.kind is kind)
        lines += _section(section, "{}", found)
    lines += _section("Parameters", "{}", ([_system_parameter(parameter)] for parameter in system.parameters))
    lines.append("}")
    return "\n".join(lines) + "\n"


def _section(word: str, braces: str, elements: Iterable[list[str]]) -> list[str]:
    """Return the lines of a list of elements, commas between them; nothing for none."""
    found = list(elements)
    if not found:
        return []
    lines = [f"{_INDENT}{word} {braces[0]}"]
    for number, element in enumerate(found):
        lines += [f"{_INDENT * 2}{line}" for line in element]
        if number < len(found) - 1:
            lines[-1] += ","
    lines.append(f"{_INDENT}{braces[1]}")
    return lines


def _component(component: Component) -> list[str]:
    lines = ["ComponentInterface {", f"{_INDENT}name {_name(component.name)}"]
    if component.namespace is not None:
        lines.append(f"{_INDENT}NameSpace {_name(component.namespace)}")
    if component.node:
        lines.append(f"{_INDENT}FromRosNode {_quoted(str(component.node))}")
    for kind, (section, word, reference) in _PORT_WORDS.items():
        found = ([_port(word, reference, port)] for port in component.ports if port.kind is kind)
        lines += _section(section, "{}", found)
    lines += _section("RosParameters", "{}", ([_ros_parameter(parameter)] for parameter in component.parameters))
    lines.append("}")
    return lines


def _port(word: str, reference_word: str, port: Port) -> str:
    fields = _fields(port.namespace, reference_word, port.reference)
    return f"{word} {_quoted(port.name)} {_block(fields)}"


def _ros_parameter(parameter: RosParameter) -> str:
    fields = _fields(parameter.namespace, "RefParameter", parameter.reference)
    if parameter.value is not None:
        fields.append(f"value {_value(parameter.value, parameter.position)}")
    return f"RosParameter {_quoted(parameter.name)} {_block(fields)}"


def _fields(namespace: str | None, word: str, reference: Reference | None) -> list[str]:
    fields = [] if namespace is None else [f"ns {_name(namespace)}"]
    if reference:
        fields.append(f"{word} {_quoted(str(reference))}")
    return fields


def _block(fields: list[str]) -> str:
    return f"{{ {' '.join(fields)} }}" if fields else "{ }"


def _connection(word: str, connection: Connection) -> list[str]:
    """Return a connection as the grammar has it: ends in parentheses, but a lone client and an action's lone server."""
    sources = _ends(connection.sources, bare=connection.kind is ConnectionKind.ACTION)
    targets = _ends(connection.targets, bare=connection.kind is not ConnectionKind.TOPIC)
    return [f"{word} {_quoted(connection.name)} {{ From {sources} To {targets} }}"]


def _ends(ends: tuple[PortPath, ...], *, bare: bool) -> str:
    texts = [_quoted(str(end)) for end in ends]
    return texts[0] if bare and len(texts) == 1 else f"( {', '.join(texts)} )"


def _system_parameter(parameter: SystemParameter) -> str:
    fields = [f"name {_name(parameter.name)}"]
    if parameter.namespace is not None:
        fields.append(f"NameSpace {_name(parameter.namespace)}")
    if parameter.type:
        fields.append(f"type {_type(parameter.type, parameter.position)}")
    if parameter.value is not None:
        fields.append(f"value {_value(parameter.value, parameter.position)}")
    return f"Parameter {_block(fields)}"


def _type(declared: ParameterType, position: Position) -> str:
    default = "" if declared.default is None else f" default {_value(declared.default, position)}"
    if declared.kind == "Array":
        elements = " ".join(f"type {_type(element, position)}" for element in declared.elements)
        return f"Array {{ {elements}{default} }}"
    if declared.kind == "List":
        return f"List {{ {', '.join(_type(element, position) for element in declared.elements)} }}{default}"
    if declared.kind == "Struct":
        members = ", ".join(f"{_name(name)} {_type(member, position)}" for name, member in declared.members)
        return f"Struct {{ {members} }}{default}"
    return declared.kind + default


def _value(value: Value, position: Position) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ModelError(f"the value {value} has no notation: give a finite number", position)
        return repr(value)
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, list):
        return f"{{ {', '.join(_value(item, position) for item in value)} }}" if value else "{ }"
    if not value:
        raise ModelError("an empty struct has no notation: give it a member, or leave the value out", position)
    members = ", ".join(f"{{ {_name(name)} {{ value {_value(item, position)} }} }}" for name, item in value.items())
    return f"{{ {members} }}"


def _name(text: str) -> str:
    return text if _BARE.fullmatch(text) else _quoted(text)


def _quoted(text: str) -> str:
    return f"'{_UNPRINTABLE.sub(_escape, text)}'"


def _escape(match: re.Match[str]) -> str:
    return _ESCAPES.get(match[0]) or f"\\u{ord(match[0]):04x}"
