"""The known packages: those of the given `.ros` models, and the installed ones."""

from __future__ import annotations

import difflib
import re
from collections import defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

from ros_model.findings import ERROR, WARNING
from ros_model.language.metamodel import Reference
from ros_model.language.packages import Node, Package, Spec, SpecKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from ros_model.language.packages import MessageField, ParameterDeclaration, PortDeclaration

BUILTIN_TYPES = frozenset(
    ["bool", "byte", "char", "string", "time", "duration", "float32", "float64", "Header"]
    + [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)]
)
"""Types of fields that belong to no package; `Header` stands for std_msgs/Header."""

_WORDS = {SpecKind.TOPIC: "message", SpecKind.SERVICE: "service", SpecKind.ACTION: "action"}
_TYPE = re.compile(r"([A-Za-z]\w*)/([A-Za-z]\w*)", re.ASCII)
_OF_AN_ACTION = re.compile(r"(\w+?)(?:Action(?:Goal|Result|Feedback)?|Goal|Result|Feedback)", re.ASCII)


@dataclass(frozen=True)
class Unknown:
    """A thing that is unknown, with the message and its severity."""

    message: str
    severity: str = ERROR


class Installed(Protocol):
    """Tells what is installed; `ros_model.io.installed` looks on ROS_PACKAGE_PATH."""

    def has_package(self, name: str) -> bool:
        """Return whether a package of that name is installed."""

    def has_type(self, package: str, kind: SpecKind, name: str) -> bool:
        """Return whether an installed package has the type; messages that are made of an action count, too."""

    def parts(self, package: str, spec: Spec) -> Mapping[str, tuple[MessageField, ...]]:
        """Return the fields of an installed message or service by its parts; nothing where there is none."""

    def missing_executable(self, package: str, name: str) -> Unknown | None:
        """Return why roslaunch does not find an executable; None where it does.

        A package that is not on this machine is a warning, because its models may have been written for another one.
        """

    def missing_file(self, package: str, name: str, own: Path | None = None) -> Unknown | None:
        """Return why a package lacks a file; None where it has it.

        Args:
            package: its name.
            name: the file, relative to the package's folder.
            own: the folder, if it is known; the installed package is looked at, too.
        """

    def wrong_parameter_file(self, package: str, name: str, own: Path | None = None) -> Unknown | None:
        """Return why a file of a package can't be loaded as the parameters of a node; None where it can."""


class NothingInstalled:
    """Stands for a host without a single package."""

    def has_package(self, name: str) -> bool:  # noqa: ARG002 - interface
        """Return False."""
        return False

    def has_type(self, package: str, kind: SpecKind, name: str) -> bool:  # noqa: ARG002 - interface
        """Return False."""
        return False

    def parts(self, package: str, spec: Spec) -> Mapping[str, tuple[MessageField, ...]]:  # noqa: ARG002 - interface
        """Return nothing."""
        return {}

    def missing_executable(self, package: str, name: str) -> None:
        """Return None: nothing is known of executables."""

    def missing_file(self, package: str, name: str, own: Path | None = None) -> None:
        """Return None: nothing is known of files."""

    def wrong_parameter_file(self, package: str, name: str, own: Path | None = None) -> None:
        """Return None: nothing is known of files."""


class Library:
    """Packages by their names; several models may declare parts of one package, and of one node.

    Args:
        packages: what the models at hand declare.
        installed: what is known of installed packages.
    """

    def __init__(self, packages: Iterable[Package] = (), installed: Installed = NothingInstalled()) -> None:  # noqa: B008 - without state
        self.installed = installed
        self._nodes: dict[str, dict[str, dict[str, Node]]] = {}
        self._models: dict[tuple[str, str, str], set[int]] = defaultdict(set)  # by their numbers, which declare a node
        self._specs: dict[str, dict[tuple[SpecKind, str], Spec]] = defaultdict(dict)
        for number, package in enumerate(packages):
            artifacts = self._nodes.setdefault(package.name, {})
            for artifact in package.artifacts:
                nodes = artifacts.setdefault(artifact.name, {})
                for node in artifact.nodes:
                    nodes[node.name] = _joined(nodes[node.name], node) if node.name in nodes else node
                    self._models[package.name, artifact.name, node.name].add(number)
            for spec in package.specs:
                self._specs[package.name].setdefault((spec.kind, spec.name), spec)

    def __bool__(self) -> bool:
        """Return whether any model is at hand."""
        return bool(self._nodes)

    def node(self, reference: Reference) -> Node | Unknown:
        """Return the node that a reference names.

        An executable may run under any name: models of a running system have that name, models from source the one in
        the code. So what other models declare of the same artifact under another name is declared of the node, too.
        """
        artifacts = self._nodes.get(reference.package)
        if artifacts is None:
            if self.installed.has_package(reference.package):
                return Unknown(
                    f"no .ros model declares the installed package '{reference.package}': extract one, or give its "
                    "folder with --path",
                    WARNING,
                )
            return Unknown(
                f"no .ros model declares package '{reference.package}'{hint(reference.package, self._nodes)}"
            )
        nodes = artifacts.get(reference.artifact)
        if nodes is None:
            where = f"package '{reference.package}' declares no artifact '{reference.artifact}'"
            return Unknown(where + hint(reference.artifact, artifacts))
        if reference.node not in nodes:
            where = f"artifact '{reference.package}.{reference.artifact}' declares no node '{reference.node}'"
            return Unknown(where + hint(reference.node, nodes))
        found, models = nodes[reference.node], self._models
        for name, node in nodes.items():
            keys = [(reference.package, reference.artifact, known) for known in (reference.node, name)]
            if models[keys[0]].isdisjoint(models[keys[1]]):
                found = _joined(found, node)
        return found

    def interfaces(self, reference: Reference) -> tuple[PortDeclaration, ...] | None:
        """Return what is declared of an executable, under any name of its node; None if no model declares it."""
        nodes = self._nodes.get(reference.package, {}).get(reference.artifact)
        return None if nodes is None else tuple(port for node in nodes.values() for port in node.ports)

    def parameters(self, reference: Reference) -> dict[str, ParameterDeclaration]:
        """Return the parameters that are declared of an executable, under any name of its node, by their names."""
        joined: Node | None = None
        for node in self._nodes.get(reference.package, {}).get(reference.artifact, {}).values():
            joined = _joined(joined, node) if joined else node
        return {parameter.name: parameter for parameter in joined.parameters} if joined else {}

    def executables(self) -> Iterator[tuple[Reference, Node]]:
        """Yield each executable that models declare, with what is declared of it, under the first name of its node."""
        for package, artifacts in self._nodes.items():
            for artifact, nodes in artifacts.items():
                for name in nodes:
                    reference = Reference(package, artifact, name)
                    found = self.node(reference)
                    if isinstance(found, Node):
                        yield reference, found
                    break

    def missing_type(self, kind: SpecKind, name: str) -> Unknown | None:
        """Return what is wrong with the name of a message, service or action type; None if it is known."""
        match = _TYPE.fullmatch(name)
        if match is None:
            return Unknown(f"'{name}' names no {_WORDS[kind]} type: write package.Type")
        package, plain = match.groups()
        declared = self._specs.get(package, {})
        is_declared = (kind, plain) in declared or (SpecKind.ACTION, action_of(kind, plain)) in declared
        if is_declared or self.installed.has_type(package, kind, plain):
            return None
        if not declared and not self.installed.has_package(package):
            text = f"no .ros model or installed package declares the messages of '{package}', so not '{name}' either"
            return Unknown(text, WARNING)
        others = [other for other, word in _WORDS.items() if other is not kind and (other, plain) in declared]
        if others:
            return Unknown(f"'{name}' is a {_WORDS[others[0]]} type, must be a {_WORDS[kind]}")
        return Unknown(
            f"package '{package}' declares no {_WORDS[kind]} '{plain}'"
            + hint(plain, [spec for known_kind, spec in declared if known_kind is kind])
        )

    def knows_package(self, name: str) -> bool:
        """Return whether a model declares the package, or it is installed."""
        return name in self._nodes or self.installed.has_package(name)


def hint(word: str, known: Iterable[str]) -> str:
    """Return `: did you mean ...?` where a known word is almost the one found."""
    found = difflib.get_close_matches(word[:80], [*known], n=1)
    return f": did you mean '{found[0]}'?" if found else ""


def action_of(kind: SpecKind, name: str) -> str | None:
    """Return the action that makes a type: `Dock` for the action type `DockAction` and for the message `DockGoal`."""
    if kind is SpecKind.ACTION:
        return name.removesuffix("Action")
    match = _OF_AN_ACTION.fullmatch(name) if kind is SpecKind.TOPIC else None
    return match[1] if match else None


def full_type(declared: str, package: str) -> str:
    """Return the type of a field with its package: `geometry_msgs/Pose[]` for `Pose[]` in geometry_msgs."""
    name, bracket, size = declared.partition("[")
    if name == "Header":
        name = "std_msgs/Header"
    elif "/" not in name and name not in BUILTIN_TYPES:
        name = f"{package}/{name}"
    return name + bracket + size


def _joined(first: Node, second: Node) -> Node:
    """Return a node with what two models declare of it; where both do, the first one's.

    A type that follows from a whole number alone gives way to one that is declared.
    """
    ports = {(port.kind, port.name) for port in first.ports}
    parameters = {parameter.name: parameter for parameter in first.parameters}
    for known in second.parameters:
        before = parameters.setdefault(known.name, known)
        if before.is_by_value and known.type and not known.is_by_value:
            parameters[known.name] = known
    return replace(
        first,
        ports=(*first.ports, *(port for port in second.ports if (port.kind, port.name) not in ports)),
        parameters=tuple(parameters.values()),
    )
