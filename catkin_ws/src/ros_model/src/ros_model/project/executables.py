"""Another executable for a component: it has the ports of the new node, wired by their names as ROS does it.

A port of the new node stands for one of the former node where both have one name. It also does where each has only one
of its kind and type, and nothing else in the system has its name: then it is remapped to the former one's topic.
"""

from __future__ import annotations

from collections import defaultdict
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
from ros_model.language.packages import is_unknown
from ros_model.project.wiring import is_shared

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ros_model.language.library import Library
    from ros_model.language.packages import PortDeclaration

_PORT_ORDER = list(PortKind)
_OUTPUTS = frozenset(out for out, _ in ENDS.values())


def alternatives(system: RosSystem, component: Component, library: Library) -> list[Reference]:
    """Return the executables of the models that publish and serve all that a component does.

    What is below the component's own name tells of this node alone, and does not count. An executable that another
    component of the system runs has its own part there: it must have the same names, and not only the same types.
    """
    outputs = {port for port in component.ports if port.kind in _OUTPUTS and _is_telling(component, port.name)}
    executable, found = component.executable, []
    others = {(c.executable.package, c.executable.artifact) for c in system.components if c.executable}
    names = {(port.kind, component.resolved(name)) for port in outputs for name in (port.name, _in_code(port))}
    if executable is None or not outputs:
        return []
    types = _types(component, library)
    for reference, node in library.executables():
        if (reference.package, reference.artifact) == (executable.package, executable.artifact):
            continue
        known = [port for port in node.ports if not is_unknown(port.name)]
        same = _counterparts(system, component, known, library)
        if (reference.package, reference.artifact) in others:
            same = {i: port for i, port in same.items() if (i.kind, component.resolved(i.name)) in names}
        if outputs <= {port for i, port in same.items() if types.get(_key(component, port), i.type) == i.type}:
            found.append(reference)
    return found


def with_executable(
    system: RosSystem, name: str, node: Reference, library: Library, where: Position | None
) -> RosSystem:
    """Return the system with another node in the place of a component.

    What both nodes call the same stays as it is: remapped ports, their connections, the values of parameters; what the
    former node declares and does not use, the new one does not use either. Ports and parameters that the new node does
    not declare go. Where its model is not sure, they stay: ports of a kind of which it does not know all names, and all
    parameters if it does not know all of their names.

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
    known = [port for port in interfaces if not is_unknown(port.name)]
    same = _counterparts(system, component, known, library)
    ports = {
        replace(same[port], reference=replace(node, name=port.name)) if port in same else _port(component, port, node)
        for port in known
        if port in same or not _is_unused(component, port, library)
    }
    unsure, sure = (
        {port.kind for port in interfaces if is_unknown(port.name)},
        {(port.kind, port.name) for port in ports},
    )
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
            if parameter.key in parameters or any(map(is_unknown, parameters))
        ),
    )
    components = tuple(changed if found is component else found for found in system.components)
    kept = tuple(_without_lost_ends(system, changed))
    return _wired(replace(system, components=components, connections=kept), component, changed, library)


def _counterparts(
    system: RosSystem, component: Component, interfaces: Sequence[PortDeclaration], library: Library
) -> Mapping[PortDeclaration, Port]:
    """Return the ports of a component that interfaces of another node stand for."""
    found: dict[PortDeclaration, Port] = {}
    for port in component.ports:
        names = {component.resolved(port.name), component.resolved(_in_code(port))}
        alike = (
            i for i in interfaces if i.kind is port.kind and i not in found and component.resolved(i.name) in names
        )
        if interface := next(alike, None):
            found[interface] = port
    types = _types(component, library)
    taken = set(found.values())
    left_ports: dict[tuple[PortKind, str], list[Port]] = defaultdict(list)
    for port in component.ports:
        kind = types.get(_key(component, port))
        if port not in taken and kind and not is_shared(component.resolved(port.name)):
            left_ports[port.kind, kind].append(port)
    left: dict[tuple[PortKind, str], list[PortDeclaration]] = defaultdict(list)
    for interface in interfaces:
        if interface not in found and not is_shared(component.resolved(interface.name)):
            left[interface.kind, interface.type].append(interface)
    for key, ports in left_ports.items():
        if len(ports) == len(left[key]) == 1 and not _named_alike(system, component, left[key][0].name, key[0]):
            found[left[key][0]] = ports[0]
    return found


def _types(component: Component, library: Library) -> dict[tuple[PortKind, str], str]:
    """Return the types of what a component's node has, as far as models tell them."""
    own = library.interfaces(component.executable) or () if component.executable else ()
    return {(i.kind, component.resolved(i.name)): i.type for i in own if i.type}


def _type_of(system: RosSystem, end: PortPath, kind: PortKind, library: Library) -> str | None:
    """Return the type of the end of a connection with a port of some kind, as far as models tell it."""
    component = next(found for found in system.components if found.name == end.component)
    other_kind = _other_end(kind)
    return next(
        (
            _types(component, library).get(_key(component, port))
            for port in component.ports
            if port.kind is other_kind and port.name == end.port
        ),
        None,
    )


def _other_end(kind: PortKind) -> PortKind:
    """Return the kind of port at the other end of a connection."""
    out, into = ENDS[CONNECTION_OF[kind]]
    return out if kind is into else into


def _key(component: Component, port: Port) -> tuple[PortKind, str]:
    return port.kind, component.resolved(_in_code(port))


def _in_code(port: Port) -> str:
    return port.reference.name if port.reference and port.reference.name else port.name


def _is_telling(component: Component, name: str) -> bool:
    return not is_shared(component.resolved(name)) and not component.resolved(name).startswith(
        f"/{component.graph_name}/"
    )


def _is_unused(component: Component, interface: PortDeclaration, library: Library) -> bool:
    """Tell whether the former node has an interface, too, but does not use it, as where a parameter switches it on."""
    own = library.interfaces(component.executable) or () if component.executable else ()
    name = component.resolved(interface.name)
    return any(known.kind is interface.kind and component.resolved(known.name) == name for known in own)


def _port(component: Component, declared: PortDeclaration, node: Reference) -> Port:
    """Return the port for an interface that the former node did not have."""
    namespace = f"/{component.graph_name}".rpartition("/")[0]
    name = component.resolved(declared.name).removeprefix(f"{namespace}/")
    return Port(name, declared.kind, replace(node, name=declared.name))


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


def _wired(system: RosSystem, former: Component, changed: Component, library: Library) -> RosSystem:
    """Return the system with the connections of those ports that the former node did not have.

    Where models tell another type of the other end, nothing is connected.
    """
    had = {(port.kind, port.name) for port in former.ports}
    connections = list(system.connections)
    for port in changed.ports:
        if (port.kind, port.name) in had:
            continue
        kind = CONNECTION_OF[port.kind]
        out, into = ENDS[kind]
        kind_here = _types(changed, library).get(_key(changed, port))
        others = tuple(
            end
            for end in _named_alike(system, changed, port.name, port.kind)
            if not kind_here or (_type_of(system, end, port.kind, library) or kind_here) == kind_here
        )
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


def _named_alike(system: RosSystem, component: Component, name: str, kind: PortKind) -> tuple[PortPath, ...]:
    """Return the ports of others at the other end of what a component calls so."""
    other_end = _other_end(kind)
    full = component.resolved(name)
    return tuple(
        PortPath(other.name, end.name)
        for other in system.components
        if other.name != component.name
        for end in other.ports
        if end.kind is other_end and other.resolved(end.name) == full
    )
