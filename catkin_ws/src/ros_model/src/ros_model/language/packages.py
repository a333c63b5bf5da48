"""The RosModel metamodel of `.ros` files: packages, their nodes and interfaces, and message specifications."""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ros_model.language.metamodel import Position, TypedParameter

if TYPE_CHECKING:
    from ros_model.language.metamodel import PortKind


_UNKNOWN = re.compile(r"\{.*\}.*@.+:\d+")


def is_unknown(name: str) -> bool:
    """Tell whether a name is one that the source does not tell: an expression in braces, and the place after an @."""
    return bool(_UNKNOWN.search(name))


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
    """A parameter that a node reads, with its declared type and default value."""


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
