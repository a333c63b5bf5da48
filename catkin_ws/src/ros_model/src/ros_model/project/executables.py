"""Another executable for a component: it has the ports of the new node, wired by their names as ROS does it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.language.library import Unknown
from ros_model.language.metamodel import (
    CONNECTION_OF,
    ENDS,
    Component,
    Connection,
    Port,
    PortKind,
    PortPath,
    Position,
    Reference,
    RosSystem,
)

if TYPE_CHECKING:
    from ros_model.language.library import Library
    from ros_model.language.packages import PortDeclaration

_PORT_ORDER = list(PortKind)


def with_executable(
    system: RosSystem, name: str, node: Reference, library: Library, where: Position | None
) -> RosSystem:
    """Return the system with another node in the place of a component.

    What both nodes call the same stays as it is: remapped ports, their connections, the values of parameters. Ports and
    parameters that the new node does not declare go. Where its model is not sure, they stay: ports of a kind of which
    it does not know all names, and parameters if it declares none at all.

    Args:
        system: has the component.
        name: the component's.
        node: the executable, and the node in it.
        library: declares the node.
        where: the reference stands.

    Raises:
        ModelError: no model declares the node.
    """
    component = next(found for found in system.components if found.name == name)
    if component.executable == node:
        return system
    declared = library.node(node)
    if isinstance(declared, Unknown):
        raise ModelError(f"{declared.message}: `rosmodel extract` makes models from source", where)
    interfaces = library.interfaces(node) or ()
    ports = {_port(component, port, node) for port in interfaces if "{" not in port.name}
    unsure, sure = {port.kind for port in interfaces if "{" in port.name}, {(port.kind, port.name) for port in ports}
    for port in component.ports:
        if port.kind in unsure and (port.kind, port.name) not in sure:
            name = port.reference.name if port.reference else port.name
            ports.add(replace(port, reference=replace(node, name=name)))
    parameters = {parameter.name for parameter in declared.parameters}
    changed = replace(
        component,
        node=node,
        ports=tuple(sorted(ports, key=lambda port: (_PORT_ORDER.index(port.kind), port.name))),
        parameters=tuple(
            replace(parameter, reference=replace(node, name=parameter.key))
            for parameter in component.parameters
            if not parameters or parameter.key in parameters
        ),
    )
    components = tuple(changed if found is component else found for found in system.components)
    kept = tuple(_without_lost_ends(system, changed))
    return _wired(replace(system, components=components, connections=kept), component, changed)


def _port(component: Component, declared: PortDeclaration, node: Reference) -> Port:
    """Return the port for an interface of the new node; with the name that the former node's port had."""
    full = component.resolved(declared.name)
    for port in component.ports:
        in_code = port.reference.name if port.reference and port.reference.name else port.name
        if port.kind is declared.kind and full in {component.resolved(in_code), component.resolved(port.name)}:
            return replace(port, reference=replace(node, name=declared.name))
    namespace = f"/{component.graph_name}".rpartition("/")[0]
    return Port(full.removeprefix(f"{namespace}/"), declared.kind, replace(node, name=declared.name))


def _without_lost_ends(system: RosSystem, changed: Component) -> list[Connection]:
    """Return the connections without the ends that the component lacks now."""
    there = {(port.kind, port.name) for port in changed.ports}

    def stays(end: PortPath, kind: PortKind) -> bool:
        return end.component != changed.name or (kind, end.port) in there

    found = []
    for connection in system.connections:
        out, into = ENDS[connection.kind]
        sources = tuple(end for end in connection.sources if stays(end, out))
        targets = tuple(end for end in connection.targets if stays(end, into))
        if sources and targets:
            found.append(replace(connection, sources=sources, targets=targets))
    return found


def _wired(system: RosSystem, former: Component, changed: Component) -> RosSystem:
    """Return the system with the connections of those ports that the former node did not have."""
    had = {(port.kind, port.name) for port in former.ports}
    connections = list(system.connections)
    for port in changed.ports:
        if (port.kind, port.name) in had:
            continue
        kind = CONNECTION_OF[port.kind]
        out, into = ENDS[kind]
        others = _named_alike(system, changed, port, out if port.kind is into else into)
        if not others:
            continue
        here = PortPath(changed.name, port.name)
        sources, targets = (others, (here,)) if port.kind is into else ((here,), others)
        for number, known in enumerate(connections):
            if known.kind is kind and port.kind is into and known.sources == sources:
                connections[number] = replace(known, targets=(*known.targets, here))
                break
            if known.kind is kind and port.kind is out and known.targets == targets:
                connections[number] = replace(known, sources=(*known.sources, here))
                break
        else:
            connections.append(Connection(port.name, kind, sources, targets))
    return replace(system, connections=tuple(connections))


def _named_alike(system: RosSystem, changed: Component, port: Port, kind: PortKind) -> tuple[PortPath, ...]:
    full = changed.resolved(port.name)
    return tuple(
        PortPath(other.name, end.name)
        for other in system.components
        for end in other.ports
        if end.kind is kind and other.resolved(end.name) == full
    )
