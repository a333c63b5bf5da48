"""The RosModel metamodel: what a `.rossystem` file says, as plain frozen data."""

from __future__ import annotations

import enum
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace

from ros_model.language.graph_names import resolve

MAX_SIZE = 16_000_000
"""Bytes or characters of the largest model that is read; the largest published one has 432 thousand."""

Value = bool | int | float | str | list["Value"] | dict[str, "Value"]

EXTENSIONS_OF_SCRIPTS = frozenset(["bash", "js", "lua", "pl", "py", "rb", "sh"])
"""Extensions of executables that stand in a reference as they are: `package.talker.py.node`."""
_UP_TO_DOT = re.compile(r"((?:\\[\\.]|[^.])*+)\.")
_ESCAPED = re.compile(r"\\([\\.])")


@dataclass(frozen=True)
class Position:
    """Where an element stands: file, and line and column counted from 1."""

    file: str = "<model>"
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        """Return file:line:column, the form that editors jump to."""
        return f"{self.file}:{self.line}:{self.column}"


class PortKind(enum.Enum):
    """The kinds of interface that a node has."""

    PUBLISHER = "publisher"
    SUBSCRIBER = "subscriber"
    SERVICE_SERVER = "service server"
    SERVICE_CLIENT = "service client"
    ACTION_SERVER = "action server"
    ACTION_CLIENT = "action client"


class ConnectionKind(enum.Enum):
    """What a connection carries."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"


ENDS = {
    ConnectionKind.TOPIC: (PortKind.PUBLISHER, PortKind.SUBSCRIBER),
    ConnectionKind.SERVICE: (PortKind.SERVICE_SERVER, PortKind.SERVICE_CLIENT),
    ConnectionKind.ACTION: (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT),
}
"""The kinds of the ports that a connection comes from and leads to."""

CONNECTION_OF = {port: kind for kind, ends in ENDS.items() for port in ends}
"""The kind of the connections of a port."""


def topic_suffixes(port: PortKind) -> tuple[str, ...]:
    """Return what follows the name of a port in its names in the graph: an action has five topics."""
    if CONNECTION_OF[port] is ConnectionKind.ACTION:
        return "/goal", "/cancel", "/status", "/result", "/feedback"
    return ("",)


@dataclass(frozen=True)
class Reference:
    """A dotted reference `package.artifact.node.name`; the name may itself hold dots and slashes.

    The artifact is the name of an executable's file. It may have the extension of a script, as in
    `package.talker.py.node`. Any other dot in one of the first three parts has a backslash before it, and so has a node
    that is called as an extension is.
    """

    package: str
    artifact: str
    node: str
    name: str = ""
    position: Position = field(default=Position(), compare=False, repr=False)

    @classmethod
    def parse(cls, text: str) -> Reference:
        """Split from the left into package, artifact, node and the rest.

        Raises:
            ValueError: the text has fewer than three parts.
        """
        parts = cls.split(text)
        if len(parts) < 3 or not all(parts[:3]):
            raise ValueError(f"reference '{text}' is not package.artifact.node[.name]")
        package, artifact, node, name = (*parts, "")[:4]
        return cls(package, artifact, node, name)

    @staticmethod
    def split(text: str) -> tuple[str, ...]:
        """Return the parts of a dotted text, at most four: package, artifact, node, and the rest as it is."""
        parts = _cut(text, 3)
        if len(parts) > 2 and parts[2] in EXTENSIONS_OF_SCRIPTS:
            parts = _cut(text, 4)
            parts[1:3] = [f"{parts[1]}.{parts[2]}"]
        elif len(parts) > 2 and parts[2][:1] == "\\" and parts[2][1:] in EXTENSIONS_OF_SCRIPTS:
            parts[2] = parts[2][1:]
        return (*(_ESCAPED.sub(r"\1", part) for part in parts[:3]), *parts[3:])

    def __str__(self) -> str:
        """Return the dotted form."""
        stem, dot, extension = self.artifact.rpartition(".")
        is_script = bool(stem) and extension in EXTENSIONS_OF_SCRIPTS
        artifact = _escaped(stem) + dot + extension if is_script else _escaped(self.artifact)
        node = f"\\{self.node}" if self.node in EXTENSIONS_OF_SCRIPTS and not is_script else _escaped(self.node)
        parts = (_escaped(self.package), artifact, node, self.name)
        return ".".join(part for part in parts if part)


def _cut(text: str, most: int) -> list[str]:
    """Cut a text at its dots, at most so many times, but not at those that a backslash escapes."""
    parts: list[str] = []
    start = 0
    while len(parts) < most and (match := _UP_TO_DOT.match(text, start)):
        parts.append(match[1])
        start = match.end()
    return [*parts, text[start:]]


def _escaped(part: str) -> str:
    return part.replace("\\", "\\\\").replace(".", "\\.")


@dataclass(frozen=True)
class Port:
    """A port of a component and the interface of a node that it instantiates."""

    name: str
    kind: PortKind
    reference: Reference | None = None
    namespace: str | None = None
    position: Position = field(default=Position(), compare=False)


@dataclass(frozen=True)
class RosParameter:
    """A parameter of a component. Its identity is the reference; the name is a label."""

    name: str
    reference: Reference | None = None
    value: Value | None = None
    namespace: str | None = None
    position: Position = field(default=Position(), compare=False)
    value_position: Position = field(default=Position(), compare=False, repr=False)

    @property
    def key(self) -> str:
        """Name relative to the node, as the parameter server has it: from the reference, else the label."""
        return self.reference.name if self.reference and self.reference.name else self.name


@dataclass(frozen=True)
class Component:
    """A running node: an instance of a node of a package."""

    name: str
    node: Reference | None = None
    namespace: str | None = None
    ports: tuple[Port, ...] = ()
    parameters: tuple[RosParameter, ...] = ()
    position: Position = field(default=Position(), compare=False)

    @property
    def executable(self) -> Reference | None:
        """The node that the component runs: FromRosNode, else that of the first reference of a port or parameter."""
        if self.node:
            return self.node
        references = [*(port.reference for port in self.ports), *(parameter.reference for parameter in self.parameters)]
        first = next((reference for reference in references if reference), None)
        return replace(first, name="") if first else None

    @property
    def graph_name(self) -> str:
        """Name of the node in the graph, with its namespace and without a leading slash."""
        return f"{(self.namespace or '').strip('/')}/{self.name}".strip("/")

    def port(self, name: str) -> Port | None:
        """Return the port of that name, or None."""
        return next((port for port in self.ports if port.name == name), None)

    def resolved(self, name: str) -> str:
        """Return the full name of what the node calls `name`: relative, private (`~`) or global."""
        return resolve(name, f"/{self.graph_name}")

    def find_port(self, name: str, kinds: Collection[PortKind]) -> Port | None:
        """Return the port of one of the kinds that has the name, or else one whose name resolves to the same."""
        ports = [port for port in self.ports if port.kind in kinds]
        exact = (port for port in ports if port.name == name)
        alike = (port for port in ports if self.resolved(port.name) == self.resolved(name))
        return next(exact, None) or next(alike, None)


@dataclass(frozen=True)
class PortPath:
    """An end of a connection: `component.port`."""

    component: str
    port: str
    position: Position = field(default=Position(), compare=False, repr=False)

    @classmethod
    def parse(cls, text: str) -> PortPath:
        """Split at the first dot; without one, the whole text is the port of an unnamed component."""
        component, dot, port = text.partition(".")
        return cls(component, port) if dot else cls("", text)

    def __str__(self) -> str:
        """Return `component.port`."""
        return f"{self.component}.{self.port}" if self.component else self.port


@dataclass(frozen=True)
class Connection:
    """A connection between ports. Sources are publishers or servers, targets subscribers or clients."""

    name: str
    kind: ConnectionKind
    sources: tuple[PortPath, ...]
    targets: tuple[PortPath, ...]
    position: Position = field(default=Position(), compare=False)


@dataclass(frozen=True)
class ParameterType:
    """A declared type: Integer, Double, String, Boolean, Base64, Date, Any, List, Array or Struct.

    A List has the types of its elements, an Array one, which has no default of its own, and a Struct its members'
    names and types.
    """

    kind: str
    elements: tuple[ParameterType, ...] = ()
    members: tuple[tuple[str, ParameterType], ...] = ()
    default: Value | None = None
    position: Position = field(default=Position(), compare=False, repr=False)
    default_position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True)
class TypedParameter:
    """A parameter with its declared type; `value_position` is where its value stands, where a file has one."""

    name: str
    type: ParameterType | None = None
    value: Value | None = None
    namespace: str | None = None
    position: Position = field(default=Position(), compare=False)
    value_position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True)
class SystemParameter(TypedParameter):
    """A global parameter of a system; `qa_<name>` holds the expected level of a quality attribute."""


@dataclass(frozen=True)
class ComponentStack:
    """A named group of a system's components, with the quality attributes that it has as a whole."""

    name: str
    components: tuple[str, ...] = ()
    quality_attributes: tuple[SystemParameter, ...] = ()
    position: Position = field(default=Position(), compare=False)


@dataclass(frozen=True)
class RosSystem:
    """A system: components, their wiring, global parameters. Components of stacks come after the others."""

    name: str
    components: tuple[Component, ...] = ()
    connections: tuple[Connection, ...] = ()
    parameters: tuple[SystemParameter, ...] = ()
    header: str = ""  # comments at the top of the file
    position: Position = field(default=Position(), compare=False)
    stacks: tuple[ComponentStack, ...] = ()

    def component(self, name: str) -> Component | None:
        """Return the component of that name, or None."""
        return next((component for component in self.components if component.name == name), None)

    @property
    def expected_qas(self) -> dict[str, float]:
        """Expected level of each quality attribute: the parameters `qa_<name>` without their prefix."""
        return {
            p.name.removeprefix("qa_"): float(p.value)
            for p in self.parameters
            if p.name.startswith("qa_") and isinstance(p.value, (int, float)) and not isinstance(p.value, bool)
        }


def unclear(name: str, system: RosSystem) -> str:
    """Return what is wrong with a name that several components of a system have, each in its namespace; "": nothing.

    What names a component, such as an end of a connection, has nothing but that name.
    """
    found = sorted({component.graph_name for component in system.components if component.name == name})
    if len(found) < 2:
        return ""
    return f"'{name}' is {' and '.join(found)}: name each component by its whole name, such as '{found[0]}'"


def unclear_ends(system: RosSystem, whole: RosSystem) -> Iterator[tuple[PortPath, str]]:
    """Yield the ends of a system's connections whose component is not clear, and why; once for each name.

    Args:
        system: the connections.
        whole: the components that they may lead to.
    """
    nodes: dict[str, set[str]] = {}
    for component in whole.components:
        nodes.setdefault(component.name, set()).add(component.graph_name)
    ends = (end for connection in system.connections for end in (*connection.sources, *connection.targets))
    for name, end in {end.component: end for end in ends if len(nodes.get(end.component, ())) > 1}.items():
        yield end, unclear(name, whole)


def compose(base: RosSystem, variant: RosSystem) -> RosSystem:
    """Return the whole system: the base with the variant's components in place of those of the same name in the graph.

    A replaced component's connections go with it: in the base's connections its ends are dropped, and those
    that lose all sources or all targets vanish, before the variant's connections and parameters are added.
    The result bears the variant's name.
    """
    replaced = {component.graph_name for component in variant.components}
    components = tuple(component for component in base.components if component.graph_name not in replaced)
    gone = {c.name for c in (*base.components, *variant.components) if c.graph_name in replaced}
    gone -= {component.name for component in components}
    kept: list[Connection] = []
    for connection in base.connections:
        sources = tuple(end for end in connection.sources if end.component not in gone)
        targets = tuple(end for end in connection.targets if end.component not in gone)
        if sources and targets:
            kept.append(Connection(connection.name, connection.kind, sources, targets, connection.position))
    own = {parameter.name for parameter in variant.parameters}
    return RosSystem(
        name=variant.name,
        components=(*components, *variant.components),
        connections=(*kept, *variant.connections),
        parameters=(*(p for p in base.parameters if p.name not in own), *variant.parameters),
        header=variant.header,
        position=variant.position,
    )
