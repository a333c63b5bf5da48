"""The facts found in source code, in either language: a node, its interfaces and parameters, and the unknowns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ros_model.language.metamodel import ParameterType, PortKind, Position
from ros_model.language.packages import Node, ParameterDeclaration, PortDeclaration, has_integer

from ros_model_extraction.values import UnwritableValueError, typed

_HOLES = re.compile(r"^([^{]*)\{.*\}")
"""Up to the first expression in braces, and from there to the last one."""


class SourceError(Exception):
    """A file of source code can't be read; `remark` says where and why."""

    def __init__(self, remark: Remark) -> None:
        super().__init__(str(remark))
        self.remark = remark


@dataclass(frozen=True)
class Remark:
    """Something that could not be resolved, or should be known about a model, and its place in the source."""

    position: Position
    text: str

    def __str__(self) -> str:
        """Return `file:line:column: text`."""
        return f"{self.position}: {self.text}"


@dataclass(frozen=True)
class FoundPort:
    """An interface that a piece of code makes.

    Attributes:
        kind: its kind.
        name: its name as the code gives it: relative, private (`~`) or global. What is not known of it stands as the
            expression in braces, `{action}/goal`, and the place follows: `@src/node.py:12`.
        type: `package/Type`, "" where it is not known.
        position: where the code stands.
    """

    kind: PortKind
    name: str
    type: str
    position: Position

    @property
    def is_resolved(self) -> bool:
        """Whether the whole name is known."""
        return "{" not in self.name


@dataclass(frozen=True)
class FoundParameter:
    """A parameter that a piece of code reads; the name as FoundPort's.

    Attributes:
        default: None where there is none.
        kind: Boolean, Integer, Double or String, as the code declares it; "" where only the default tells.
    """

    name: str
    default: Any
    position: Position
    kind: str = ""


Configurations = Mapping[str, tuple[FoundParameter, ...]]
"""Parameters of dynamic_reconfigure by the name of the class that it generates, such as `PlannerConfig`."""


@dataclass(frozen=True)
class LoadedNodelet:
    """A nodelet that a program loads into itself.

    Attributes:
        name: its name, which is its private namespace; "~" is the program's own.
        loaded_as: what it is loaded by, `package/Class`.
        remappings: names that it finds under others.
        position: of the call.
    """

    name: str
    loaded_as: str
    remappings: Mapping[str, str]
    position: Position


@dataclass(frozen=True)
class NodeSource:
    """The node that the code of one executable makes. `name` is "" if no call starts a node."""

    name: str
    ports: tuple[FoundPort, ...] = ()
    parameters: tuple[FoundParameter, ...] = ()
    remarks: tuple[Remark, ...] = ()
    position: Position = field(default=Position())
    nodelets: tuple[LoadedNodelet, ...] = ()

    @property
    def is_node(self) -> bool:
        """Whether it is a ROS node: it is started as one, or has interfaces."""
        return bool(self.name or self.ports)

    def declared(self) -> Node:
        """Return the node of the metamodel: each interface and parameter once."""
        ports: dict[tuple[PortKind, str], PortDeclaration] = {}
        for port in self.ports:
            # What one line makes, with several names that are not known, is one interface.
            name = port.name if port.is_resolved else f"{_without_holes(port.name)}:{port.position.column}"
            known = ports.get((port.kind, name))
            if known is None or (port.type and not known.type):
                shown = known.name if known else port.name
                ports[port.kind, name] = PortDeclaration(shown, port.kind, port.type, position=port.position)
        parameters: dict[str, ParameterDeclaration] = {}
        for parameter in self.parameters:
            name = private_name(parameter.name)
            key = f"{_without_holes(name)}:{parameter.position.column}" if "{" in name else name  # as for ports
            before = parameters.get(key)
            declared = _declared(replace(parameter, name=before.name if before else name))
            if before is None or (before.value is None and (declared.value is not None or before.type is None)):
                parameters[key] = declared
        order = list(PortKind)
        by_kind = sorted(ports.values(), key=lambda port: order.index(port.kind))
        return Node(self.name, tuple(by_kind), tuple(parameters.values()), self.position)


def with_nodelet(program: NodeSource, loaded: LoadedNodelet, nodelet: NodeSource) -> NodeSource:
    """Return a program with the interfaces and parameters of a nodelet that it loads."""

    def renamed(name: str) -> str:
        if name in loaded.remappings:
            return loaded.remappings[name]
        if not name.startswith("~") or loaded.name == "~":
            return name
        inside = f"{loaded.name}/{name[1:].lstrip('/')}"
        return unresolved(inside, loaded.position) if "{" in loaded.name and "@" not in inside else inside

    ports = [replace(port, name=renamed(port.name)) for port in nodelet.ports]
    parameters = [replace(parameter, name=renamed(parameter.name)) for parameter in nodelet.parameters]
    return replace(
        program,
        ports=(*program.ports, *(port for port in ports if port not in program.ports)),
        parameters=(*program.parameters, *parameters),
        remarks=unique([*program.remarks, *nodelet.remarks]),
    )


def private_name(name: str) -> str:
    """Return a parameter's name as models write it: relative to the node if it is private, else with a slash."""
    if name.startswith("~"):
        return name[1:].lstrip("/")
    return name if name.startswith(("/", "{")) else f"/{name}"


def _without_holes(name: str) -> str:
    """Return a name with `{}` for all from its first expression to its last one."""
    return _HOLES.sub(r"\1{}", name)


def unresolved(name: str, position: Position) -> str:
    """Return a name with expressions in braces, and its place: unlike any other in its node."""
    return f"{name}@{position.file}:{position.line}"


def unique(remarks: Iterable[Remark]) -> tuple[Remark, ...]:
    """Return the remarks once each, by file and line."""
    return tuple(
        sorted(dict.fromkeys(remarks), key=lambda r: (r.position.file, r.position.line, r.position.column, r.text))
    )


def _declared(parameter: FoundParameter) -> ParameterDeclaration:
    name, position, default = parameter.name, parameter.position, parameter.default
    declared = ParameterType(parameter.kind) if parameter.kind else None
    if default is None:
        return ParameterDeclaration(name, declared, position=position)
    try:
        kind, value = typed(default)
    except UnwritableValueError:
        return ParameterDeclaration(name, declared, position=position)
    if parameter.kind == "Double" and type(value) is int:
        kind, value = ParameterType("Double"), float(value)
    is_by_value = not parameter.kind and has_integer(kind)
    return ParameterDeclaration(name, kind, value, position=position, is_by_value=is_by_value)
