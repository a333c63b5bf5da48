"""Checks of references: a reference may be incomplete, or refer to nothing or to something of another kind."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from ros_model.checks.values import first_known, value_place
from ros_model.errors import short
from ros_model.findings import ERROR, WARNING, Finding
from ros_model.language.library import Library, Unknown, hint
from ros_model.language.metamodel import RosParameter
from ros_model.language.notation import type_text
from ros_model.language.packages import is_unknown
from ros_model.language.typed_values import misfit, type_for
from ros_model.project.wiring import is_shared

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ros_model.language.metamodel import (
        Component,
        Port,
        PortKind,
        Position,
        Reference,
        RosSystem,
    )
    from ros_model.language.packages import Node, PortDeclaration

_PACKAGE = re.compile(r"[A-Za-z0-9_][\w.-]*", re.ASCII)  # and no path
_SHOWN = 5  # ports of a node that are named
_MAY_BE = "declares no {} '{}' for sure: it may be one of those whose names the source does not tell"


def incomplete(system: RosSystem) -> Iterator[Finding]:
    """Yield the references that lack a part, or name no package."""
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


def not_followed(system: RosSystem) -> Iterator[Finding]:
    """Yield one finding that no `.ros` model is known, if the system has references."""
    for component in system.components:
        if component.executable:
            text = "no .ros model is known, so references are not followed: give the folder of some with --path"
            yield Finding(text, _place(component.executable, component.position), "unknown-reference", WARNING)
            return


def followed(system: RosSystem, library: Library) -> Iterator[Finding]:
    """Yield references to nothing or to something of another kind; only one for each fault in a node."""
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
            elif problem := _wrong_port(element.kind, reference, node, component):
                text, rule, severity = problem
                yield Finding(text, _place(reference, element.position), rule, severity)


def not_in_source(system: RosSystem, library: Library, sources: Library) -> Iterator[Finding]:
    """Yield remapped names that a model of a running system declares, but no model from the node's source does.

    Then the remapping may have no effect, or what is known of the source is incomplete.

    Args:
        system: the system.
        library: all that is declared.
        sources: what models declare that are not of running systems.
    """
    for component in system.components:
        for port in component.ports:
            reference = port.reference
            if reference is None or reference.name in {"", port.name} or is_shared(reference.name):
                continue
            node, declared = library.node(reference), sources.interfaces(reference)
            if declared is None or isinstance(node, Unknown) or _wrong_port(port.kind, reference, node, component):
                continue
            of_kind = [known.name for known in declared if known.kind is port.kind]
            if component.resolved(reference.name) not in map(component.resolved, of_kind):
                where, there = f"'{reference.package}.{reference.artifact}'", ", ".join(of_kind[:_SHOWN]) or "none"
                text = (
                    f"the source of {where} declares no {port.kind.value} '{reference.name}': it declares {there}. If "
                    "the code has another name, give that one, else the remapping has no effect"
                )
                yield Finding(text, _place(reference, port.position), "remapping", WARNING)


def _unknown_node(reference: Reference, position: Position, library: Library, told: set[str]) -> Iterator[Finding]:
    found = library.node(reference)
    if isinstance(found, Unknown) and found.message not in told:
        told.add(found.message)
        yield Finding(found.message, _place(reference, position), "unknown-reference", found.severity)


def declarations(reference: Reference, node: Node, component: Component) -> list[PortDeclaration]:
    """Return what a node declares of a port: under its name, else under names that resolve to the same.

    Models from source have names as the code has them, those of running systems as the node's namespace sees them.
    """
    exact = [declared for declared in node.ports if declared.name == reference.name]
    name = component.resolved(reference.name)
    return exact or [declared for declared in node.ports if component.resolved(declared.name) == name]


def _wrong_port(kind: PortKind, reference: Reference, node: Node, component: Component) -> tuple[str, str, str] | None:
    """Return what is wrong with a reference to a port of a node, the rule that says so, and its severity."""
    declared = declarations(reference, node, component)
    where = f"'{reference.package}.{reference.artifact}.{reference.node}'"
    if not declared:
        known = [declaration.name for declaration in node.ports if declaration.kind is kind]
        if any(map(is_unknown, known)):
            return f"{where} {_MAY_BE.format(kind.value, reference.name)}", "unknown-reference", WARNING
        meant = hint(reference.name, known) or f": it declares {', '.join(known[:_SHOWN]) or 'none'}"
        return f"{where} declares no {kind.value} '{reference.name}'{meant}", "unknown-reference", ERROR
    if all(declaration.kind is not kind for declaration in declared):
        return (
            f"{where} declares '{reference.name}' as a {declared[0].kind.value}, not a {kind.value}",
            "wrong-kind",
            ERROR,
        )
    return None


def _wrong_parameter(parameter: RosParameter, reference: Reference, node: Node) -> Iterator[Finding]:
    declared = next((known for known in node.parameters if known.name == reference.name), None)
    if declared is None and any(is_unknown(known.name) for known in node.parameters):
        where = f"'{reference.package}.{reference.artifact}.{reference.node}'"
        text = f"{where} {_MAY_BE.format('parameter', reference.name)}"
        yield Finding(text, _place(reference, parameter.position), "unknown-reference", WARNING)
    elif declared is None:
        text = f"'{reference.package}.{reference.artifact}.{reference.node}' declares no parameter '{reference.name}'"
        text += hint(reference.name, (known.name for known in node.parameters))
        yield Finding(text, _place(reference, parameter.position), "unknown-reference")
    elif parameter.value is not None and declared.type:
        counting = type_for(parameter.value, declared) or declared.type
        if problem := misfit("value", parameter.value, reference.name, counting):
            yield Finding(f"{problem}, as it is declared", value_place(parameter), "value")
        elif counting != declared.type:
            place = first_known(declared.position, value_place(parameter))
            text = (
                f"'{reference}' counts as {short(type_text(replace(counting, default=None), place))}: only whole "
                "numbers were seen of it, and it is given one with a point: write this type here"
            )
            yield Finding(text, place, "value", WARNING)


def _elements(component: Component) -> tuple[Port | RosParameter, ...]:
    return (*component.ports, *component.parameters)


def _place(reference: Reference, position: Position) -> Position:
    return first_known(reference.position, position)
