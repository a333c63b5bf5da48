"""Checks of packages: names that are declared twice, types that nobody declares, values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ros_model.checks.values import misfits
from ros_model.findings import WARNING, Finding, sorted_by_place
from ros_model.language.library import BUILTIN_TYPES, full_type
from ros_model.language.metamodel import CONNECTION_OF
from ros_model.language.packages import SpecKind, is_unknown

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from ros_model.language.library import Library
    from ros_model.language.metamodel import Position
    from ros_model.language.packages import MessageField, Node, Package, PackageSet, Spec


_UNKNOWN = "unknown-name"
_EACH = 3  # so many are told one by one


def check_packages(packages: PackageSet, library: Library) -> tuple[Finding, ...]:
    """Return what is wrong with packages, in the order of the file.

    Args:
        packages: the packages to check.
        library: what is known of packages, these included.
    """
    findings = [*_twice("package", ((package.name, package.position) for package in packages.packages))]
    for package in packages.packages:
        findings += _package(package, library)
    return sorted_by_place(_told_at_once(findings))


def _told_at_once(findings: Collection[Finding]) -> list[Finding]:
    """Return findings in which many names that the source does not tell are one: other people's code has hundreds."""
    unknown = [finding for finding in findings if finding.rule == _UNKNOWN]
    if len(unknown) <= _EACH:
        return list(findings)
    first = sorted_by_place(unknown)[0]
    example = first.message.partition(":")[0]
    text = (
        f"{len(unknown)} names in this file are not told by the source, of which this is the first: {example}: where a "
        "design uses the node, write the names that it has when it runs (rosmodel snapshot shows them), or delete them"
    )
    return [*(finding for finding in findings if finding.rule != _UNKNOWN), replace(first, message=text)]


def _package(package: Package, library: Library) -> Iterator[Finding]:
    yield from _twice("artifact", ((artifact.name, artifact.position) for artifact in package.artifacts))
    yield from _twice("specification", ((f"{spec.kind.value} {spec.name}", spec.position) for spec in package.specs))
    for artifact in package.artifacts:
        yield from _twice("node", ((node.name, node.position) for node in artifact.nodes))
        for node in artifact.nodes:
            yield from _node(node, library)
    for spec in package.specs:
        yield from _spec(spec, package.name, library)
    for dependency in package.dependencies:
        if not library.knows_package(dependency):
            text = f"package '{package.name}' needs '{dependency}', which no .ros model declares and is not installed"
            yield Finding(text, package.position, "unknown-reference", WARNING)


def _node(node: Node, library: Library) -> Iterator[Finding]:
    yield from _twice("", ((f"{port.kind.value} '{port.name}'", port.position) for port in node.ports))
    yield from _twice("parameter", ((parameter.name, parameter.position) for parameter in node.parameters))
    for port in node.ports:
        yield from _unknown(port.kind.value, port.name, port.position)
    for parameter in node.parameters:
        yield from _unknown("parameter", parameter.name, parameter.position)
    for port in node.ports:
        kind = SpecKind(CONNECTION_OF[port.kind].value)
        problem = library.missing_type(kind, port.type) if port.type else None
        if problem:
            yield Finding(
                f"{port.kind.value} '{port.name}': {problem.message}", port.position, "unknown-type", problem.severity
            )
    for parameter in node.parameters:
        yield from misfits(parameter)


def _unknown(what: str, name: str, position: Position) -> Iterator[Finding]:
    if is_unknown(name):
        text = (
            f"{what} '{name}': the source does not tell this name: write the name that the node has when it runs "
            "(rosmodel snapshot shows it), or delete it"
        )
        yield Finding(text, position, _UNKNOWN, WARNING)


def _spec(spec: Spec, package: str, library: Library) -> Iterator[Finding]:
    for part, fields in spec.parts:
        yield from _twice(f"field of the {part}", ((field.name, field.position) for field in fields))
        for field in fields:
            name = full_type(field.type, package).partition("[")[0]
            problem = None if name in BUILTIN_TYPES else library.missing_type(SpecKind.TOPIC, name)
            if problem:
                text = f"field '{field.name}' of '{spec.name}': {problem.message}"
                yield Finding(text, field.position, "unknown-type", problem.severity)
    installed = library.installed.parts(package, spec) if spec.parts else {}
    for part, fields in spec.parts:
        if part in installed and _told(fields, package) != _told(installed[part], package):
            text = f"the {part} of '{spec.name}' is not that of the installed package '{package}'"
            yield Finding(text, spec.position, "definition-differs", WARNING)


def _told(fields: Iterable[MessageField], package: str) -> list[tuple[str, str]]:
    """Return the parts that two equal definitions share: the constants, then the fields in their order."""
    told = [(full_type(field.type, package), field.name, field.constant) for field in fields]
    constants = sorted((kind, name) for kind, name, constant in told if constant is not None)
    return [*constants, *((kind, name) for kind, name, constant in told if constant is None)]


def _twice(what: str, names: Iterable[tuple[str, Position]]) -> Iterator[Finding]:
    seen: set[str] = set()
    for name, position in names:
        if name in seen:
            yield Finding(f"{what} '{name}' stands twice" if what else f"{name} stands twice", position, "duplicate")
        seen.add(name)
