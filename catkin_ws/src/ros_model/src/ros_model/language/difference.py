"""What differs between two models of one language: what is missing, additional, or has another value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_model.errors import printable
from ros_model.language.metamodel import Position
from ros_model.language.notation import type_text, value_text
from ros_model.language.packages import PackageSet

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from ros_model.language.metamodel import Component, Connection, ParameterType, RosSystem, Value
    from ros_model.language.packages import MessageField, Node, Package

MISSING, ADDITIONAL, CHANGED = "-", "+", "~"

Facts = dict[tuple[str, ...], "Fact"]
"""What a model says: path of an element, such as ("component 'arm'", "parameter 'rate'"), and what it is."""


@dataclass(frozen=True)
class Fact:
    """What an element is, as text, and as it is compared."""

    text: str = ""
    value: object = None


@dataclass(frozen=True)
class Difference:
    """One element that only one of two models has, or that is not the same in both."""

    sign: str
    path: tuple[str, ...]
    before: str = ""
    after: str = ""

    def __str__(self) -> str:
        """Return the sign, the path, and what was and is there."""
        change = f": {self.before or 'nothing'} -> {self.after or 'nothing'}" if self.sign == CHANGED else ""
        return printable(f"{self.sign} {', '.join(self.path)}{change}")


def differences(first: RosSystem | PackageSet, second: RosSystem | PackageSet) -> tuple[Difference, ...]:
    """Return the changes that turn the first model into the second; for a whole element, its parts are not listed.

    Names are compared without a slash in front, numbers by their value; a connection is its ends, whatever its name.
    """
    before, after = _facts(first), _facts(second)
    found = []
    for path in sorted(before.keys() | after.keys()):
        if path not in after:
            if path[:-1] in after or len(path) == 1:
                found.append(Difference(MISSING, path))
        elif path not in before:
            if path[:-1] in before or len(path) == 1:
                found.append(Difference(ADDITIONAL, path))
        elif before[path].value != after[path].value:
            found.append(Difference(CHANGED, path, before[path].text, after[path].text))
    return tuple(found)


def _facts(model: RosSystem | PackageSet) -> Facts:
    return dict(_of_packages(model)) if isinstance(model, PackageSet) else dict(_of_system(model))


def _of_system(system: RosSystem) -> Iterator[tuple[tuple[str, ...], Fact]]:
    for component in system.components:
        yield from _of_component(component)
    names = {component.name: component.graph_name for component in system.components}
    for connection in system.connections:
        yield from _of_connection(connection, names)
    for parameter in system.parameters:
        name = f"{(parameter.namespace or '').strip('/')}/{parameter.name}".strip("/")
        yield (f"parameter '{name}'",), _parameter(parameter.type, parameter.value)


def _of_component(component: Component) -> Iterator[tuple[tuple[str, ...], Fact]]:
    path = f"component '{component.graph_name}'"
    executable = component.executable
    node = f"{executable.package}.{executable.artifact}.{executable.node}" if executable else ""
    yield (path,), Fact(node, node)
    for port in component.ports:
        name = port.name.strip("/")
        inside = (port.reference.name if port.reference else port.name).strip("/")
        yield (path, f"{port.kind.value} '{name}'"), Fact(f"'{inside}'", inside)
    for parameter in component.parameters:
        yield (path, f"parameter '{parameter.key.strip('/')}'"), _parameter(None, parameter.value)


def _of_connection(connection: Connection, names: Mapping[str, str]) -> Iterator[tuple[tuple[str, ...], Fact]]:
    for source in connection.sources:
        for target in connection.targets:
            ends = [f"{names.get(e.component, e.component)}.{e.port.strip('/')}" for e in (source, target)]
            yield (f"{connection.kind.value} connection '{ends[0]}' to '{ends[1]}'",), Fact()


def _of_packages(packages: PackageSet) -> Iterator[tuple[tuple[str, ...], Fact]]:
    for package in packages.packages:
        path = (f"package '{package.name}'",)
        yield path, Fact()
        yield from _of_package(package, path)


def _of_package(package: Package, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Fact]]:
    for artifact in package.artifacts:
        inside = (*path, f"artifact '{artifact.name}'")
        yield inside, Fact()
        for node in artifact.nodes:
            yield from _of_node(node, (*inside, f"node '{node.name}'"))
    for spec in package.specs:
        inside = (*path, f"{spec.kind.value} specification '{spec.name}'")
        text = " ".join(f"{part} {{ {' '.join(map(_field, fields))} }}" for part, fields in spec.parts)
        yield inside, Fact(text, text)
    for name in (*package.dependencies, *package.external_dependencies):
        yield (*path, f"dependency '{name}'"), Fact()


def _of_node(node: Node, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Fact]]:
    yield path, Fact()
    for port in node.ports:
        yield (*path, f"{port.kind.value} '{port.name}'"), Fact(port.type, port.type)
    for parameter in node.parameters:
        yield (*path, f"parameter '{parameter.name}'"), _parameter(parameter.type, parameter.value)


def _parameter(declared: ParameterType | None, value: Value | None) -> Fact:
    texts = [type_text(declared, Position())] if declared else []
    if value is not None:
        texts.append(value_text(value, Position()))
    return Fact(" ".join(texts), (_comparable(declared.default) if declared else None, declared, _comparable(value)))


def _comparable(value: Value | None) -> object:
    """Return a value that is equal only to one of its kind: 1 and 1.0 are one number, true is none."""
    if isinstance(value, bool) or value is None:
        return str(value), value
    if isinstance(value, list):
        return tuple(map(_comparable, value))
    if isinstance(value, dict):
        return tuple(sorted((name, _comparable(item)) for name, item in value.items()))
    return value


def _field(field: MessageField) -> str:
    return f"{field.type} {field.name}" + ("" if field.constant is None else f"={field.constant}")
