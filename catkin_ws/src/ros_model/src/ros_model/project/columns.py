"""What the columns of a table of variants set: parameters, connections, executables, components, expected levels."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Never

from ros_model.errors import Gathered, ModelError
from ros_model.language.library import hint
from ros_model.language.metamodel import ENDS, PortPath, Position, Reference, unclear

if TYPE_CHECKING:
    from ros_model.language.metamodel import PortKind, RosSystem
    from ros_model.project.tables import Table

Where = Callable[..., Position | None]

TARGET_OF = {source: (kind, target) for kind, (source, target) in ENDS.items()}
"""For each port that a connection may come from: the kind of the connection, and of the port at its other end."""

_EXPECTED = "qa_"


def _nowhere(*_keys: str | int) -> None:
    return None


@dataclass(frozen=True)
class Setting:
    """A parameter of a component that a column sets, times a factor where there is one."""

    component: str
    name: str
    factor: float | None = None


@dataclass(frozen=True)
class Wire:
    """A connection that a value of a column makes.

    Attributes:
        source: the publisher or server.
        component: the one that is connected.
        port: its port; None: the one that is named as the connection.
        position: where the connection is written; None: nowhere but in a row of the table.
    """

    source: PortPath
    component: str
    port: str | None = None
    position: Position | None = field(default=None, compare=False)

    def leads_to(self, source: PortPath, target: PortPath) -> bool:
        """Return whether this is the wire between two ports."""
        return self.source == source and self.component == target.component and self.port in {None, target.port}


@dataclass(frozen=True)
class Columns:
    """What each column of a table sets.

    Attributes:
        component: the component that varies, where a column doesn't say another.
        parameters: column -> parameters.
        wires: column -> its value -> connections.
        nodes: column -> its value -> the node that the component is then; None: the variant lacks the component.
        presence: column -> components that are there where it is true.
        expected: column -> quality attribute whose expected level it holds.
        ignored: columns that set nothing.
        where: from the keys of the section to a position in its file.
    """

    component: str | None = None
    parameters: Mapping[str, tuple[Setting, ...]] = field(default_factory=dict)
    wires: Mapping[str, Mapping[str, tuple[Wire, ...]]] = field(default_factory=dict)
    nodes: Mapping[str, Mapping[str, Reference | None]] = field(default_factory=dict)
    presence: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    expected: Mapping[str, str] = field(default_factory=dict)
    ignored: frozenset[str] = frozenset()
    where: Where = _nowhere

    @property
    def names(self) -> frozenset[str]:
        """All columns that are mapped."""
        return self.ignored.union(self.parameters, self.wires, self.nodes, self.presence, self.expected)

    @property
    def optional(self) -> frozenset[str]:
        """Components that some variants lack."""
        named = frozenset(name for names in self.presence.values() for name in names)
        is_absent = any(node is None for choices in self.nodes.values() for node in choices.values())
        return named | {self.component} if is_absent and self.component else named

    @property
    def varied(self) -> frozenset[str]:
        """Components that a variant brings."""
        named = {setting.component for settings in self.parameters.values() for setting in settings}
        named |= {wire.component for wire in self.all_wires()}
        return self.optional | named | ({self.component} if self.component else set())

    def all_wires(self) -> Iterator[Wire]:
        """Yield the connections that any value of any column makes."""
        for choices in self.wires.values():
            for wires in choices.values():
                yield from wires


def parse_columns(section: Mapping[str, Any], where: Where = _nowhere) -> Columns:
    """Return what a family of metacontrol.yaml (which its schema has accepted) says of columns.

    Raises:
        ModelError: it leaves open which component varies.
    """
    component = section.get("component")

    def default(*keys: str | int) -> str:
        if not component:
            raise ModelError("says no component: give the family one, or name it here", where(*keys))
        return str(component)

    def setting(column: str, number: int, entry: str | dict[str, Any]) -> Setting:
        entry = {"name": entry} if isinstance(entry, str) else entry
        owner = entry.get("component") or default("parameters", column, number)
        return Setting(owner, entry["name"], entry.get("factor"))

    def wire(column: str, value: str, number: int, entry: str | dict[str, str]) -> Wire:
        keys = ("connections", column, value, number)
        if isinstance(entry, str):
            return Wire(PortPath.parse(entry), default(*keys), position=where(*keys))
        target = PortPath.parse(entry["to"])
        return Wire(PortPath.parse(entry["from"]), target.component, target.port, where(*keys))

    def node(column: str, value: str, text: str | list[Never]) -> Reference | None:
        default("nodes", column, value)
        if isinstance(text, list):
            return None
        try:
            return Reference.parse(text)
        except ValueError as error:
            raise ModelError(f"{error}: write PACKAGE.EXECUTABLE.NODE", where("nodes", column, value)) from None

    return Columns(
        component,
        {
            column: tuple(setting(column, number, entry) for number, entry in enumerate(entries))
            for column, entries in section.get("parameters", {}).items()
        },
        {
            column: {
                value: tuple(wire(column, value, number, entry) for number, entry in enumerate(entries))
                for value, entries in choices.items()
            }
            for column, choices in section.get("connections", {}).items()
        },
        {
            column: {value: node(column, value, text) for value, text in choices.items()}
            for column, choices in section.get("nodes", {}).items()
        },
        {column: tuple(names) for column, names in section.get("components", {}).items()},
        section.get("expected", {}),
        frozenset(section.get("ignore", ())),
        where,
    )


def with_implied(columns: Columns, table: Table, base: RosSystem) -> Columns:
    """Return the columns, with those that need no mapping: `COMPONENT.PARAMETER` and `qa_NAME`.

    Raises:
        ModelError: columns are neither mapped nor of this form, or mapped columns are missing; says which.
    """
    parameters, expected = dict(columns.parameters), dict(columns.expected)
    first_line = Position(str(table.path), 1, 1)
    wrong = Gathered()
    for column in table.columns:
        component, dot, parameter = column.partition(".")
        if column in columns.names:
            continue
        if dot and parameter and base.component(component):
            parameters[column] = (Setting(component, parameter),)
        elif column.startswith(_EXPECTED):
            expected[column] = column.removeprefix(_EXPECTED)
        else:
            told = f"nothing says what column {column!r} sets: map it, or name it COMPONENT.PARAMETER"
            if base.component(column):
                told += f"; for a node that some variants lack, `components: {{{column}: [{column}]}}`, true or false"
            wrong.add([ModelError(told, first_line)])
    for column in sorted(columns.names - columns.ignored - set(table.columns)):
        told = f"the mapped column {column!r} is missing: add it, or remove its mapping"
        wrong.add([ModelError(told, first_line)])
    wrong.tell()
    return replace(columns, parameters=parameters, expected=expected)


def with_ports(columns: Columns, base: RosSystem) -> Columns:
    """Return the columns with the names that the base gives the ports of connections.

    metacontrol.yaml may write a name as the code has it (`/scan`, `~scan`), as it resolves, or as the base has it.
    """

    def named(wire: Wire) -> Wire:
        source, component = base.component(wire.source.component), base.component(wire.component)
        out = source.find_port(wire.source.port, TARGET_OF.keys()) if source else None
        into = component.find_port(wire.port, {TARGET_OF[out.kind][1]}) if component and out and wire.port else None
        path = replace(wire.source, port=out.name) if out else wire.source
        return replace(wire, source=path, port=into.name if into else wire.port)

    wires = {
        column: {value: tuple(map(named, entries)) for value, entries in choices.items()}
        for column, choices in columns.wires.items()
    }
    return replace(columns, wires=wires)


def check_columns(columns: Columns, base: RosSystem) -> None:
    """Check that the base has all that the columns name.

    Raises:
        ModelError: components are not there or name no node, or connections do not begin at a publisher or server;
            says which.
    """
    wrong = Gathered()
    wrong.add(_wrong_names(columns, base))
    wrong.tell()


def _wrong_names(columns: Columns, base: RosSystem) -> Iterator[ModelError]:
    def unnamed(name: str, *keys: str | int) -> Iterator[ModelError]:
        component = base.component(name)
        if component is None or component.executable is None:
            told = f"{name!r} is no component with a FromRosNode in {base.position.file}"
            yield ModelError(told, columns.where(*keys))

    if columns.component:
        yield from unnamed(columns.component, "component")
    seen: dict[tuple[str, str], str] = {}
    for column, settings in columns.parameters.items():
        for number, setting in enumerate(settings):
            yield from unnamed(setting.component, "parameters", column, number)
            other = seen.setdefault((setting.component, setting.name), column)
            if other != column:
                yield ModelError(
                    f"columns {other!r} and {column!r} both set {setting.name} of {setting.component}: take one out",
                    columns.where("parameters", column, number),
                )
    for column, names in columns.presence.items():
        for number, name in enumerate(names):
            yield from unnamed(name, "components", column, number)
            if told := unclear(name, base):
                yield ModelError(told, columns.where("components", column, number))
    for column, choices in columns.wires.items():
        for value, wires in choices.items():
            for number, wire in enumerate(wires):
                keys = ("connections", column, value, number)
                yield from unnamed(wire.component, *keys)
                if outlet(base, wire.source) is None:
                    told = f"{wire.source} is no publisher or server in {base.position.file}"
                    yield ModelError(told + _other_outlet(base, wire.source), columns.where(*keys))


def _other_outlet(base: RosSystem, source: PortPath) -> str:
    """Return the hint which port may be meant."""
    ends = (f"{c.name}.{port.name}" for c in base.components for port in c.ports if port.kind in TARGET_OF)
    return hint(str(source), ends)


def outlet(system: RosSystem, source: PortPath) -> PortKind | None:
    """Return the kind of the port that a connection may come from, or None."""
    component = system.component(source.component)
    port = component.find_port(source.port, TARGET_OF.keys()) if component else None
    return port.kind if port else None
