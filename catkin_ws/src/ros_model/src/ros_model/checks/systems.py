"""What is wrong with a system that reads well: in itself, and by what is known of its packages."""

from __future__ import annotations

import re
from collections import defaultdict
from typing import TYPE_CHECKING

from ros_model.checks.launch import check_launch
from ros_model.findings import WARNING, Finding, sorted_by_place
from ros_model.language.library import Library, Unknown, hint
from ros_model.language.metamodel import ENDS, RosParameter
from ros_model.language.typed_values import misfit

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from ros_model.language.metamodel import (
        Component,
        Connection,
        ConnectionKind,
        ParameterType,
        Port,
        PortKind,
        PortPath,
        Position,
        Reference,
        RosSystem,
        TypedParameter,
        Value,
    )
    from ros_model.language.packages import Node

_PACKAGE = re.compile(r"[A-Za-z0-9_][\w.-]*", re.ASCII)  # and no path


def check_system(
    system: RosSystem, whole: RosSystem | None = None, library: Library | None = None
) -> tuple[Finding, ...]:
    """Return what is wrong with a system, in the order of the file.

    Args:
        system: the system to check.
        whole: what its connections may lead to, where the system is a part (a variant); the system itself if None.
        library: what is known of packages; without it, references are not followed.
    """
    whole = whole or system
    findings = [*_twice(system), *_incomplete(system), *_values(system), *check_launch(system, whole, library)]
    if library:
        findings += _followed(system, library)
    elif library is not None:
        findings += _not_followed(system)
    for connection in system.connections:
        problems = [*_connection(connection, whole)]
        findings += problems or (_types(connection, whole, library) if library else ())
    return sorted_by_place(findings)


def check_family(variants: Sequence[RosSystem]) -> Iterator[Finding]:
    """Yield where a variant lacks the value of a quality attribute that another variant of the family has."""
    known = {name for variant in variants for name in _qualities(variant)}
    for variant in variants:
        missing = known - _qualities(variant)
        for name in sorted(missing):
            siblings = [sibling.name for sibling in variants if name in _qualities(sibling)]
            text = f"variant '{variant.name}' has no value for '{name}', as {_listed(siblings)}: add one"
            yield Finding(text, variant.position, "missing-quality")


def families(systems: Iterable[RosSystem]) -> list[list[RosSystem]]:
    """Return the systems that are variants of one another: they have the same components and parameters of these."""
    found: dict[object, list[RosSystem]] = defaultdict(list)
    for system in systems:
        if system.components:
            found[
                tuple(
                    (component.graph_name, str(component.executable), frozenset(p.key for p in component.parameters))
                    for component in sorted(system.components, key=lambda component: component.graph_name)
                )
            ].append(system)
    return [variants for variants in found.values() if len(variants) > 1]


def misfits(parameter: TypedParameter) -> Iterator[Finding]:
    """Yield that a parameter's value, or a default of its type, is none of the type."""
    if parameter.type is None:
        return
    if parameter.value is not None and (text := misfit("value", parameter.value, parameter.name, parameter.type)):
        yield Finding(text, value_place(parameter), "value")
    for declared in _types_within(parameter.type):
        if declared.default is not None and (text := misfit("default", declared.default, parameter.name, declared)):
            yield Finding(text, _first(declared.default_position, parameter.position), "value")


def _types_within(declared: ParameterType) -> Iterator[ParameterType]:
    """Yield a type, and the types of its elements and members."""
    yield declared
    for inner in (*declared.elements, *(member for _, member in declared.members)):
        yield from _types_within(inner)


def value_place(parameter: TypedParameter | RosParameter) -> Position:
    """Return where a parameter's value stands; where the parameter does, if its value comes from elsewhere."""
    return _first(parameter.value_position, parameter.position)


def _twice(system: RosSystem) -> Iterator[Finding]:
    names: set[str] = set()
    for component in system.components:
        if component.graph_name in names:
            yield Finding(f"component '{component.graph_name}' stands twice", component.position, "duplicate")
        names.add(component.graph_name)
        yield from _twice_inside(component)
    connections: set[tuple[ConnectionKind, str]] = set()
    for connection in system.connections:
        if (connection.kind, connection.name) in connections:
            text = f"{connection.kind.value} connection '{connection.name}' stands twice: give all its ends to one"
            yield Finding(text, connection.position, "duplicate", WARNING)
        connections.add((connection.kind, connection.name))
    globals_seen: dict[tuple[str | None, str], Value | None] = {}
    for parameter in system.parameters:
        identity = (parameter.namespace, parameter.name)
        if identity in globals_seen:
            yield _twice_parameter(parameter.name, globals_seen[identity] == parameter.value, parameter.position)
        globals_seen[identity] = parameter.value


def _twice_inside(component: Component) -> Iterator[Finding]:
    ports: set[tuple[PortKind, str]] = set()
    for port in component.ports:
        if (port.kind, port.name) in ports:
            text = f"{port.kind.value} '{port.name}' of '{component.name}' stands twice"
            yield Finding(text, port.position, "duplicate")
        ports.add((port.kind, port.name))
    values: dict[tuple[str | None, str], Value | None] = {}
    for parameter in component.parameters:
        identity = (parameter.namespace, str(parameter.reference or parameter.name))
        if identity in values:
            yield _twice_parameter(identity[1], values[identity] == parameter.value, parameter.position)
        values[identity] = parameter.value


def _twice_parameter(name: str, same: bool, position: Position) -> Finding:
    if same:
        return Finding(f"parameter '{name}' stands twice", position, "duplicate")
    return Finding(f"parameter '{name}' has two values", position, "two-values")


def _incomplete(system: RosSystem) -> Iterator[Finding]:
    for component in system.components:
        if component.node:
            yield from _incomplete_reference(component.node, bool(component.node.node), "", component.position)
        for element in _elements(component):
            if element.reference:
                complete = bool(element.reference.name)
                yield from _incomplete_reference(element.reference, complete, ".name", element.position)


def _incomplete_reference(reference: Reference, complete: bool, more: str, position: Position) -> Iterator[Finding]:
    place = _place(reference, position)
    if not complete:
        text = f"reference '{reference}' is not package.artifact.node{more}"
        yield Finding(text, place, "incomplete-reference")
    elif not _PACKAGE.fullmatch(reference.package):
        text = f"reference '{reference}': '{reference.package}' is no name of a package"
        yield Finding(text, place, "incomplete-reference")


def _values(system: RosSystem) -> Iterator[Finding]:
    for parameter in system.parameters:
        yield from misfits(parameter)
    for stack in system.stacks:
        for quality in stack.quality_attributes:
            yield from misfits(quality)


# References


def _not_followed(system: RosSystem) -> Iterator[Finding]:
    for component in system.components:
        if component.executable:
            text = "no .ros model is known, so references are not followed: give the folder of some with --path"
            yield Finding(text, _place(component.executable, component.position), "unknown-reference", WARNING)
            return


def _followed(system: RosSystem, library: Library) -> Iterator[Finding]:
    """Yield the references that lead nowhere, or to something of another kind; of one fault in a node only one."""
    for component in system.components:
        told: set[str] = set()
        if component.node and component.node.node:
            yield from _unknown_node(component.node, component.position, library, told)
        for element in _elements(component):
            reference = element.reference
            if reference is None or not reference.name:
                continue
            node = library.node(reference)
            if isinstance(node, Unknown):
                yield from _unknown_node(reference, element.position, library, told)
            elif isinstance(element, RosParameter):
                yield from _wrong_parameter(element, reference, node)
            elif problem := _wrong_port(element.kind, reference, node):
                text, rule = problem
                yield Finding(text, _place(reference, element.position), rule)


def _unknown_node(reference: Reference, position: Position, library: Library, told: set[str]) -> Iterator[Finding]:
    found = library.node(reference)
    if isinstance(found, Unknown) and found.message not in told:
        told.add(found.message)
        yield Finding(found.message, _place(reference, position), "unknown-reference", found.severity)


def _wrong_port(kind: PortKind, reference: Reference, node: Node) -> tuple[str, str] | None:
    """Return what is wrong with a reference to a port of a node, and the rule that says so."""
    declared = [declaration for declaration in node.ports if declaration.name == reference.name]
    where = f"'{reference.package}.{reference.artifact}.{reference.node}'"
    if not declared:
        known = [declaration.name for declaration in node.ports if declaration.kind is kind]
        return f"{where} declares no {kind.value} '{reference.name}'{hint(reference.name, known)}", "unknown-reference"
    if all(declaration.kind is not kind for declaration in declared):
        return f"{where} declares '{reference.name}' as a {declared[0].kind.value}, not a {kind.value}", "wrong-kind"
    return None


def _wrong_parameter(parameter: RosParameter, reference: Reference, node: Node) -> Iterator[Finding]:
    declared = next((known for known in node.parameters if known.name == reference.name), None)
    if declared is None:
        text = f"'{reference.package}.{reference.artifact}.{reference.node}' declares no parameter '{reference.name}'"
        text += hint(reference.name, (known.name for known in node.parameters))
        yield Finding(text, _place(reference, parameter.position), "unknown-reference")
    elif parameter.value is not None and declared.type:
        problem = misfit("value", parameter.value, reference.name, declared.type)
        yield from [Finding(f"{problem}, as it is declared", value_place(parameter), "value")] if problem else ()


# Connections


def _connection(connection: Connection, whole: RosSystem) -> Iterator[Finding]:
    source_kind, target_kind = ENDS[connection.kind]
    for kind, role, ends in (
        (source_kind, "source", connection.sources),
        (target_kind, "target", connection.targets),
    ):
        if not ends:
            yield Finding(f"connection '{connection.name}' has no {role}", connection.position, "connection")
        for end in ends:
            if problem := _end(end, kind, whole):
                text, rule = problem
                place = end.position if end.position.line else connection.position
                yield Finding(f"connection '{connection.name}': {text}", place, rule)


def _end(end: PortPath, kind: PortKind, whole: RosSystem) -> tuple[str, str] | None:
    component = whole.component(end.component)
    if component is None:
        known = hint(end.component, (component.name for component in whole.components))
        return f"'{end}' names no component of this system{known}", "connection"
    kinds = {port.kind for port in component.ports if port.name == end.port}
    if not kinds:
        known = hint(end.port, (port.name for port in component.ports if port.kind is kind))
        return f"'{end.component}' has no port '{end.port}'{known}", "connection"
    if kind not in kinds:
        found = " and ".join(sorted(k.value for k in kinds))
        return f"'{end}' is a {found}, must be a {kind.value}", "wrong-kind"
    return None


def _types(connection: Connection, whole: RosSystem, library: Library) -> Iterator[Finding]:
    """Yield the ends that their nodes do not declare, and those whose type is not that of the first end with one."""
    first: tuple[PortPath, str] | None = None
    for ends, kind in zip((connection.sources, connection.targets), ENDS[connection.kind], strict=True):
        for end in ends:
            port = _port(end, kind, whole)
            node = library.node(port.reference) if port and port.reference else None
            if port is None or port.reference is None or node is None or isinstance(node, Unknown):
                continue
            text = f"connection '{connection.name}': '{end}'"
            place = end.position if end.position.line else connection.position
            if problem := _wrong_port(kind, port.reference, node):
                yield Finding(f"{text}: {problem[0]}", place, problem[1])
            found = _type(kind, port.reference.name, node)
            if found and first is None:
                first = end, found
            elif found and first and found.removesuffix("Action") != first[1].removesuffix("Action"):
                yield Finding(f"{text} is {found}, but '{first[0]}' is {first[1]}", place, "type-mismatch")


def _port(end: PortPath, kind: PortKind, whole: RosSystem) -> Port | None:
    component = whole.component(end.component)
    ports = component.ports if component else ()
    return next((port for port in ports if port.name == end.port and port.kind is kind), None)


def _type(kind: PortKind, name: str, node: Node) -> str:
    """Return the type of a node's port, "" if it is not known; where it has the kind only otherwise, that one's."""
    declared = [port for port in node.ports if port.name == name]
    return next((port.type for port in sorted(declared, key=lambda port: port.kind is not kind)), "")


# Helpers


def _elements(component: Component) -> tuple[Port | RosParameter, ...]:
    return (*component.ports, *component.parameters)


def _place(reference: Reference, position: Position) -> Position:
    return _first(reference.position, position)


def _first(known: Position, other: Position) -> Position:
    return known if known.line else other


def _qualities(system: RosSystem) -> set[str]:
    return {p.name for p in system.parameters if p.name.startswith("qa_") and p.value is not None}


def _listed(names: Sequence[str], most: int = 3) -> str:
    shown = ", ".join(f"'{name}'" for name in names[:most])
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{shown}{more} {'has' if len(names) == 1 else 'have'}"
