"""Reads `.rossystem` files: from text to the frozen data of the metamodel, with the position of every element."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

from ros_model.errors import short
from ros_model.language.builder import Builder, Field, split_name, text_of
from ros_model.language.metamodel import (
    Component,
    ComponentStack,
    Connection,
    ConnectionKind,
    Port,
    PortKind,
    PortPath,
    Position,
    Reference,
    RosParameter,
    RosSystem,
    SystemParameter,
)
from ros_model.language.parser import Parser

if TYPE_CHECKING:
    from collections.abc import Iterable, Set

    from lark import Token


def parse_system(text: str, file: str = "<text>") -> RosSystem:
    """Return what the text of a `.rossystem` file says; `file` is its name in positions and errors.

    Raises:
        ModelError: it is not well-formed; says file:line:column, what was expected, near what.
    """
    return cast(RosSystem, _parser().parse(text, file))


@functools.cache
def _parser() -> Parser:
    return Parser("rossystem.lark", "system", _Builder())


class _Builder(Builder):
    """Builds a system: one method for each rule of the grammar."""

    def system(self, items: list[Any]) -> RosSystem:
        keyword, *rest = items
        fields = self.fields(rest, keyword, needs_name=True)
        stacks = fields.get("stacks", ())
        components = (*fields.get("components", ()), *(component for _, inside in stacks for component in inside))
        connections = tuple(connection for kind in ConnectionKind for connection in fields.get(kind.value, ()))
        return RosSystem(
            name=fields["name"],
            components=components,
            connections=_resolved(connections, components),
            parameters=fields.get("parameters", ()),
            header=self.header,
            position=self.at(keyword),
            stacks=tuple(stack for stack, _ in stacks),
        )

    def stacks(self, items: list[Any]) -> Field:
        return "stacks", tuple(items[1:]), items[0]

    def stack(self, items: list[Any]) -> tuple[ComponentStack, tuple[Component, ...]]:
        keyword, *rest = items
        name, rest = split_name(items)
        fields = self.fields(rest, keyword, needs_name=True, name=name)
        components = fields.get("components", ())
        names = tuple(component.name for component in components)
        return ComponentStack(fields["name"], names, fields.get("qualities", ()), self.at(keyword)), components

    def qualities(self, items: list[Any]) -> Field:
        return "qualities", tuple(items[1:]), items[0]

    def quality(self, items: list[Any]) -> SystemParameter:
        return self.typed_parameter(SystemParameter, items)

    # Fields

    def node(self, items: list[Token]) -> Field:
        return "node", self._reference(items[1]), items[0]

    def reference(self, items: list[Token]) -> Field:
        return "reference", self._reference(items[0]), items[0]

    # Components

    def components(self, items: list[Any]) -> Field:
        return "components", tuple(items[1:]), items[0]

    def component(self, items: list[Any]) -> Component:
        keyword, *rest = items
        fields = self.fields(rest, keyword, needs_name=True)
        return Component(
            name=fields["name"],
            node=fields.get("node"),
            namespace=fields.get("namespace"),
            ports=tuple(port for kind in PortKind for port in fields.get(kind.value, ())),
            parameters=fields.get("parameters", ()),
            position=self.at(keyword),
        )

    def named_component(self, items: list[Any]) -> Component:
        keyword, name, namespace = items
        return Component(text_of(name), namespace=namespace[1] if namespace else None, position=self.at(keyword))

    def port(self, items: list[Any]) -> tuple[str, dict[str, Any], Position]:
        keyword = items[0]
        name, rest = split_name(items)
        fields = self.fields(rest, keyword)
        if name is None:
            name = fields["reference"].name if "reference" in fields else ""
        return name, fields, self.at(keyword)

    def ros_parameters(self, items: list[Any]) -> Field:
        return "parameters", tuple(items[1:]), items[0]

    def ros_parameter(self, items: list[Any]) -> RosParameter:
        name, fields, position = self.port(items)
        return RosParameter(
            name,
            fields.get("reference"),
            fields.get("value"),
            fields.get("namespace"),
            position,
            fields.get("value_position", Position()),
        )

    # Connections

    def topics(self, items: list[Any]) -> Field:
        return self._connections(ConnectionKind.TOPIC, items)

    def services(self, items: list[Any]) -> Field:
        return self._connections(ConnectionKind.SERVICE, items)

    def actions(self, items: list[Any]) -> Field:
        return self._connections(ConnectionKind.ACTION, items)

    def connection(self, items: list[Any]) -> tuple[str, dict[str, Any], Position]:
        """Read a connection; one without a name has that of its first end."""
        keyword = items[0]
        name, rest = split_name(items)
        fields = self.fields(rest, keyword)
        ends = (*fields.get("From", ()), *fields.get("To", ()))
        if name is None:
            name = ends[0].port if ends else ""
        return name, fields, self.at(keyword)

    def sources(self, items: list[Token]) -> Field:
        return "From", tuple(map(self._end, items[1:])), items[0]

    def targets(self, items: list[Token]) -> Field:
        return "To", tuple(map(self._end, items[1:])), items[0]

    # Parameters of the system

    def parameters(self, items: list[Any]) -> Field:
        return "parameters", tuple(items[1:]), items[0]

    def parameter(self, items: list[Any]) -> SystemParameter:
        return self.quality(items)

    # Helpers

    def port_of(self, kind: PortKind, item: tuple[str, dict[str, Any], Position]) -> Port:
        name, fields, position = item
        return Port(name, kind, fields.get("reference"), fields.get("namespace"), position)

    def _connections(self, kind: ConnectionKind, items: list[Any]) -> Field:
        connections = tuple(
            Connection(name, kind, fields.get("From", ()), fields.get("To", ()), position)
            for name, fields, position in items[1:]
        )
        return kind.value, connections, items[0]

    def _end(self, token: Token) -> PortPath:
        return replace(PortPath.parse(text_of(token)), position=self.at(token))

    def _reference(self, token: Token) -> Reference:
        """Split a reference; one with parts missing at its end is for the checker, as its spelling is not wrong."""
        parts = Reference.split(text_of(token))
        if "" in parts[:3]:
            self.refuse(f"reference '{short(text_of(token))}' is not package.artifact.node[.name]", token)
        package, artifact, node, name = (*parts, "", "", "")[:4]
        return Reference(package, artifact, node, name, self.at(token))


def _resolved(connections: tuple[Connection, ...], components: Iterable[Component]) -> tuple[Connection, ...]:
    """Return connections with `component/port` split, which stands for `component.port` in some files."""
    if all(end.component for connection in connections for end in (*connection.sources, *connection.targets)):
        return connections
    known = {component.name for component in components if component.name}
    return tuple(
        replace(
            connection,
            sources=tuple(_split(end, known) for end in connection.sources),
            targets=tuple(_split(end, known) for end in connection.targets),
        )
        for connection in connections
    )


def _split(end: PortPath, known: Set[str]) -> PortPath:
    if end.component:
        return end
    slashes = (index for index, mark in enumerate(end.port) if mark == "/")
    for index in slashes:
        if end.port[:index] in known and end.port[index + 1 :]:
            return PortPath(end.port[:index], end.port[index + 1 :], end.position)
    return end
