"""The RosModel metamodel of `.ros` files: packages, their nodes and interfaces, and message specifications."""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from ros_model.language.metamodel import Position, Reference, TypedParameter

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from ros_model.language.metamodel import ParameterType, PortKind


_UNKNOWN = re.compile(r"[^{]*+\{[^}]*+\}[^@]*+@..*?:\d")  # from the start of a line, in linear time


def is_unknown(name: str) -> bool:
    """Tell whether a name is one that the source does not tell: an expression in braces, and the place after an @."""
    return any(map(_UNKNOWN.match, name.split("\n")))


@dataclass(frozen=True)
class PortDeclaration:
    """An interface that a node offers or uses. The type is written `package/Type`, "" where nobody knows it."""

    name: str
    kind: PortKind
    type: str = ""
    namespace: str | None = None
    position: Position = field(default=Position(), compare=False)


@dataclass(frozen=True)
class ParameterDeclaration(TypedParameter):
    """A parameter that a node reads, with its declared type and default value.

    Attributes:
        is_by_value: a whole number is all that tells the type: it may be a Double that had no point.
    """

    is_by_value: bool = field(default=False, compare=False)


@dataclass(frozen=True)
class Node:
    """A node as its source code declares it."""

    name: str
    ports: tuple[PortDeclaration, ...] = ()
    parameters: tuple[ParameterDeclaration, ...] = ()
    position: Position = field(default=Position(), compare=False)


@dataclass(frozen=True)
class Artifact:
    """An executable of a package and the nodes that it runs."""

    name: str
    nodes: tuple[Node, ...] = ()
    position: Position = field(default=Position(), compare=False)


class SpecKind(enum.Enum):
    """The kinds of message specification."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"


PARTS = {
    SpecKind.TOPIC: ("message",),
    SpecKind.SERVICE: ("request", "response"),
    SpecKind.ACTION: ("goal", "result", "feedback"),
}
"""The parts that a specification has, in their order."""

EXTENSIONS = {SpecKind.TOPIC: "msg", SpecKind.SERVICE: "srv", SpecKind.ACTION: "action"}
"""The extensions of the files of specifications, and the names of their folders in a package."""


@dataclass(frozen=True)
class MessageField:
    """A field of a message, `float32[] data`, or a constant, `int8 OK=1`. Types of packages are `package/Type`."""

    type: str
    name: str
    constant: str | None = None
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True)
class Spec:
    """A message, service or action specification.

    The parts are ("message",) of a topic, ("request", "response") of a service, ("goal", "result", "feedback") of
    an action, each with its fields; a specification that gives none of its parts is opaque: only its name is known.
    """

    name: str
    kind: SpecKind
    parts: tuple[tuple[str, tuple[MessageField, ...]], ...] = ()
    position: Position = field(default=Position(), compare=False)


@dataclass(frozen=True)
class Package:
    """A ROS package: its executables, its message specifications, the packages that it depends on."""

    name: str
    artifacts: tuple[Artifact, ...] = ()
    specs: tuple[Spec, ...] = ()
    dependencies: tuple[str, ...] = ()
    catkin: bool = True  # written as CatkinPackage; plain Package otherwise
    external_dependencies: tuple[str, ...] = ()  # what is no ROS package
    repository: str | None = None  # where its source code is
    position: Position = field(default=Position(), compare=False)


OBSERVED = "Written by rosmodel snapshot."
"""What a model of a running system says at its top."""


@dataclass(frozen=True)
class PackageSet:
    """What a `.ros` file says."""

    packages: tuple[Package, ...] = ()
    header: str = ""  # comments at the top of the file

    @property
    def is_observed(self) -> bool:
        """Whether it tells of a running system, and so not of the source of its nodes."""
        return OBSERVED in self.header

    def node(self, package: str, artifact: str, node: str) -> Node | None:
        """Return the node that `package.artifact.node` refers to, or None."""
        return next(
            (
                declared
                for p in self.packages
                if p.name == package
                for a in p.artifacts
                if a.name == artifact
                for declared in a.nodes
                if declared.name == node
            ),
            None,
        )


_BY_VALUE = "Whole numbers alone tell types of "
_BY_VALUE_LINE = re.compile(rf"\s*{_BY_VALUE}(\S+): (.+)\.")


def has_integer(declared: ParameterType) -> bool:
    """Return whether a type, or one within it, is Integer."""
    inner = (*declared.elements, *(member for _, member in declared.members))
    return declared.kind == "Integer" or any(map(has_integer, inner))


def remarks_on_types(packages: Iterable[Package]) -> Iterator[str]:
    """Yield the lines of a header that keep which types follow from whole numbers alone, one for each node."""
    for package in packages:
        for artifact in package.artifacts:
            for node in artifact.nodes:
                names = [p.name for p in node.parameters if p.is_by_value and not is_unknown(p.name)]
                if names:
                    reference = Reference(package.name, artifact.name, node.name)
                    yield f"{_BY_VALUE}{reference}: {', '.join(names)}."


def with_types_by_value(found: PackageSet) -> PackageSet:
    """Return packages with marks at the parameters of which the header says that whole numbers alone tell their types.

    In the model of a running system, these are all that have an Integer.
    """
    told = {
        match[1]: frozenset(match[2].split(", "))
        for line in found.header.splitlines()
        if (match := _BY_VALUE_LINE.match(line))
    }
    if not told and not found.is_observed:
        return found

    def marked(node: Node, names: Collection[str]) -> Node:
        def is_by_value(parameter: ParameterDeclaration) -> bool:
            is_told = found.is_observed or parameter.name in names
            return is_told and parameter.type is not None and has_integer(parameter.type)

        return replace(node, parameters=tuple(replace(p, is_by_value=is_by_value(p)) for p in node.parameters))

    packages = []
    for package in found.packages:
        artifacts = []
        for artifact in package.artifacts:
            nodes = (
                marked(node, told.get(str(Reference(package.name, artifact.name, node.name)), ()))
                for node in artifact.nodes
            )
            artifacts.append(replace(artifact, nodes=tuple(nodes)))
        packages.append(replace(package, artifacts=tuple(artifacts)))
    return replace(found, packages=tuple(packages))
