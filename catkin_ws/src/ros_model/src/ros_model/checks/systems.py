"""Checks of a system: in itself, and against its packages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_model.checks.connections import names_that_differ, wrong_ends, wrong_types
from ros_model.checks.executables import missing_executables
from ros_model.checks.launch import check_launch
from ros_model.checks.references import followed, incomplete, not_followed, not_in_source
from ros_model.checks.values import misfits
from ros_model.findings import WARNING, Finding, sorted_by_place
from ros_model.language.library import Installed, Library
from ros_model.language.metamodel import unclear_ends

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from ros_model.language.metamodel import (
        Component,
        ConnectionKind,
        PortKind,
        Position,
        RosSystem,
        Value,
    )


def check_system(
    system: RosSystem,
    whole: RosSystem | None = None,
    library: Library | None = None,
    installed: Installed | None = None,
    sources: Library | None = None,
    started: Collection[str] | None = None,
) -> tuple[Finding, ...]:
    """Return what is wrong with a system, in the order of the file.

    Args:
        system: the system to check.
        whole: what its connections may lead to, where the system is a part (a variant); the system itself if None.
        library: what is known of packages; without it, references are not followed.
        installed: knows the executables of this machine; without it, they are not looked for.
        sources: what models of the nodes' source declare; without it, remapped names are not looked up there.
        started: components that launch files made from models start; None if that is not known.
    """
    whole = whole or system
    findings = [*_twice(system), *incomplete(system), *_values(system), *check_launch(system, whole, library)]
    if library:
        findings += followed(system, library)
        findings += not_in_source(system, library, sources) if sources else ()
    elif library is not None:
        findings += not_followed(system)
    if installed:
        findings += missing_executables(system, installed)
    for end, text in unclear_ends(system, whole):
        findings.append(Finding(text, end.position, "duplicate"))
    for connection in system.connections:
        problems = [*wrong_ends(connection, whole)]
        findings += problems or (wrong_types(connection, whole, library) if library else ())
        findings += () if problems else names_that_differ(connection, whole, started)
    return sorted_by_place(findings)


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


def _values(system: RosSystem) -> Iterator[Finding]:
    for parameter in system.parameters:
        yield from misfits(parameter)
    for stack in system.stacks:
        for quality in stack.quality_attributes:
            yield from misfits(quality)
