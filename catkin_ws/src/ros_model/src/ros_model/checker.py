"""What is wrong with a model that reads well: names that stand twice, connections that lead nowhere."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_model.metamodel import ConnectionKind, PortKind

if TYPE_CHECKING:
    from ros_model.metamodel import (
        Component,
        Connection,
        ParameterType,
        Port,
        PortPath,
        Position,
        RosParameter,
        RosSystem,
        Value,
    )

_ENDS = {
    ConnectionKind.TOPIC: (PortKind.PUBLISHER, PortKind.SUBSCRIBER),
    ConnectionKind.SERVICE: (PortKind.SERVICE_SERVER, PortKind.SERVICE_CLIENT),
    ConnectionKind.ACTION: (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT),
}
_FITTING: dict[str, tuple[type, ...]] = {
    "Integer": (int,),
    "Double": (int, float),
    "String": (str,),
    "Boolean": (bool,),
    "Base64": (str,),
    "Date": (str,),
    "List": (list,),
    "Array": (list,),
    "Struct": (dict,),
}


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, and where."""

    message: str
    position: Position

    def __str__(self) -> str:
        """Return `file:line:column: error: message`."""
        message = self.message.replace("\n", "\\n")  # names may span lines
        return f"{self.position}: error: {message}"


def check_system(system: RosSystem, whole: RosSystem | None = None) -> tuple[Finding, ...]:
    """Return what is wrong with a system, in the order of the file.

    Args:
        system: the system to check.
        whole: what its connections may lead to, where the system is a part (a variant); the system itself if None.
    """
    findings = [*_twice(system), *_references(system), *_values(system)]
    for connection in system.connections:
        findings += _connection(connection, whole or system)
    return tuple(sorted(findings, key=lambda finding: (finding.position.line, finding.position.column)))


def _twice(system: RosSystem) -> Iterator[Finding]:
    names: set[str] = set()
    for component in system.components:
        if component.graph_name in names:
            yield Finding(f"component '{component.graph_name}' stands twice", component.position)
        names.add(component.graph_name)
        yield from _twice_inside(component)
    globals_seen: set[tuple[str | None, str]] = set()
    for parameter in system.parameters:
        if (parameter.namespace, parameter.name) in globals_seen:
            yield Finding(f"parameter '{parameter.name}' stands twice", parameter.position)
        globals_seen.add((parameter.namespace, parameter.name))


def _twice_inside(component: Component) -> Iterator[Finding]:
    ports: set[tuple[PortKind, str]] = set()
    for port in component.ports:
        if (port.kind, port.name) in ports:
            yield Finding(f"{port.kind.value} '{port.name}' of '{component.name}' stands twice", port.position)
        ports.add((port.kind, port.name))
    values: dict[tuple[str | None, str], Value | None] = {}
    for parameter in component.parameters:
        identity = (parameter.namespace, str(parameter.reference or parameter.name))
        if identity in values:
            what = "has two values" if values[identity] != parameter.value else "stands twice"
            yield Finding(f"parameter '{identity[1]}' {what}", parameter.position)
        values[identity] = parameter.value


def _references(system: RosSystem) -> Iterator[Finding]:
    for component in system.components:
        if component.node and not component.node.node:
            yield Finding(f"reference '{component.node}' is not package.artifact.node", component.position)
        elements: tuple[Port | RosParameter, ...] = (*component.ports, *component.parameters)
        for element in elements:
            if element.reference and not element.reference.name:
                yield Finding(f"reference '{element.reference}' is not package.artifact.node.name", element.position)


def _values(system: RosSystem) -> Iterator[Finding]:
    for parameter in system.parameters:
        for value in (parameter.value, parameter.type.default if parameter.type else None):
            if parameter.type and value is not None and not _fits(value, parameter.type):
                yield Finding(
                    f"the value {value!r} of '{parameter.name}' is no {parameter.type.kind}", parameter.position
                )


def _fits(value: Value, declared: ParameterType) -> bool:
    expected = _FITTING.get(declared.kind)
    if expected is None:
        return True
    if not isinstance(value, expected) or (isinstance(value, bool) and bool not in expected):
        return False
    if isinstance(value, list) and declared.elements:
        if declared.kind == "Array":
            return all(_fits(item, declared.elements[0]) for item in value)
        return len(value) == len(declared.elements) and all(map(_fits, value, declared.elements))
    if isinstance(value, dict) and declared.members:
        members = dict(declared.members)
        return all(name in members and _fits(item, members[name]) for name, item in value.items())
    return True


def _connection(connection: Connection, whole: RosSystem) -> Iterator[Finding]:
    source_kind, target_kind = _ENDS[connection.kind]
    for kind, role, ends in (
        (source_kind, "source", connection.sources),
        (target_kind, "target", connection.targets),
    ):
        if not ends:
            yield Finding(f"connection '{connection.name}' has no {role}", connection.position)
        for end in ends:
            if problem := _end(end, kind, whole):
                yield Finding(f"connection '{connection.name}': {problem}", connection.position)


def _end(end: PortPath, kind: PortKind, whole: RosSystem) -> str | None:
    component = whole.component(end.component)
    if component is None:
        return f"'{end}' names no component of this system"
    kinds = {port.kind for port in component.ports if port.name == end.port}
    if not kinds:
        return f"'{end.component}' has no port '{end.port}'"
    if kind not in kinds:
        return f"'{end}' is a {' and '.join(sorted(k.value for k in kinds))}, must be a {kind.value}"
    return None
