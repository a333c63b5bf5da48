"""A family of systems from one base and a table: `columns` says what each column sets."""

from __future__ import annotations

import re
from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING

from ros_model.errors import Gathered, ModelError
from ros_model.language.library import Library
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
    RosParameter,
    RosSystem,
    SystemParameter,
    Value,
)
from ros_model.language.remappings import with_header
from ros_model.project.columns import TARGET_OF, check_columns, outlet, with_implied, with_ports
from ros_model.project.executables import with_executable
from ros_model.project.tables import Row

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from ros_model.project.columns import Columns, Setting, Wire
    from ros_model.project.tables import Table

_ABOUT = re.compile(r"source|seeds|missions|.*_spread")
"""Columns of a table of levels that tell where they are from."""
_CONNECTION_ORDER = list(ConnectionKind)
_PORT_ORDER = list(PortKind)


def make_systems(
    base: RosSystem, columns: Columns, table: Table, levels: Table | None = None, library: Library | None = None
) -> tuple[tuple[RosSystem, RosSystem], ...]:
    """Return, for each row of the table, the whole system and the part of it that the variant brings.

    That part holds the components that vary, their connections, and the expected levels of the quality attributes as
    parameters `qa_<name>`; `compose(fixed_part(...), part)` is the whole again.

    Args:
        base: the system with all that may be there.
        columns: what the columns set.
        table: one row a variant.
        levels: a column for each quality attribute, and perhaps what tells where they are from:
            `source`, `seeds`, `missions`, `*_spread`.
        library: declares the nodes that columns choose.

    Raises:
        ModelError: the base, the columns and the tables do not fit together; says where, of every row.
    """
    check_columns(columns, base)
    columns = with_ports(with_implied(columns, table, base), base)
    check_columns(columns, base)
    doubles = {column for column in table.columns if any(isinstance(row.cells[column], float) for row in table.rows)}
    found = []
    wrong = Gathered()
    for given in table.rows:
        cells = {name: _double(cell) if name in doubles else cell for name, cell in given.cells.items()}
        row = replace(given, cells=cells)
        expected: list[SystemParameter] = []
        with wrong.step():
            expected += _expected(row, columns.expected, levels)
        with wrong.step():
            whole = _whole(base, columns, row, expected, library or Library())
            found.append((whole, replace(_part(whole, columns.varied), parameters=tuple(expected))))
    wrong.tell()
    return tuple(found)


def _whole(base: RosSystem, columns: Columns, row: Row, expected: list[SystemParameter], library: Library) -> RosSystem:
    """Return the whole system that a row makes of the base."""
    wrong = Gathered()
    wrong.add(_wrong_cells(columns, row))
    wrong.tell()
    present = _with_nodes(without(base, _absent(row, columns)), columns, row, library)
    rewired = _rewired(present, columns, row)
    components = tuple(_with_parameters(component, columns, row) for component in rewired.components)
    own = {parameter.name for parameter in expected}
    inherited = tuple(parameter for parameter in base.parameters if parameter.name not in own)
    system = RosSystem(row.name, components, rewired.connections, (*inherited, *expected), position=row.position)
    return with_header(system, "", base)


def _wrong_cells(columns: Columns, row: Row) -> Iterator[ModelError]:
    """Yield cells of a row that say nothing that their columns know."""
    for column in columns.presence:
        if not isinstance(row.cells[column], bool):
            yield ModelError(f"column {column!r} is {row.cells[column]!r}, must be true or false", row.position)
    for column, choices in (*columns.wires.items(), *columns.nodes.items()):
        if (value := _key(row.cells[column])) not in choices:
            yield ModelError(f"column {column!r} is {value!r}, must be {' or '.join(choices)}", row.position)
    for column, settings in columns.parameters.items():
        cell, factors = row.cells[column], [setting.factor for setting in settings if setting.factor is not None]
        if factors and cell is not None and (isinstance(cell, bool) or not isinstance(cell, (int, float))):
            told = f"column {column!r} is {cell!r}, must be a number: it is scaled by {factors[0]}"
            yield ModelError(told, row.position)


def without(system: RosSystem, names: Collection[str]) -> RosSystem:
    """Return the system without some of its components, and without the connections that lose an end."""
    if not names:
        return system
    connections = []
    for connection in system.connections:
        sources = tuple(end for end in connection.sources if end.component not in names)
        targets = tuple(end for end in connection.targets if end.component not in names)
        if sources and targets:
            connections.append(replace(connection, sources=sources, targets=targets))
    components = tuple(component for component in system.components if component.name not in names)
    return replace(system, components=components, connections=tuple(connections))


def _part(whole: RosSystem, names: Collection[str]) -> RosSystem:
    """Return some components with what connects them to each other and to the rest."""
    connections = []
    for connection in whole.connections:
        sources = tuple(end for end in connection.sources if end.component in names)
        targets = tuple(end for end in connection.targets if end.component in names)
        if targets:
            connections.append(replace(connection, targets=connection.targets if sources else targets))
        elif sources:
            connections.append(replace(connection, sources=sources))
    components = tuple(component for component in whole.components if component.name in names)
    return replace(whole, components=components, connections=tuple(connections))


def _absent(row: Row, columns: Columns) -> frozenset[str]:
    absent = frozenset(name for column, names in columns.presence.items() if not row.cells[column] for name in names)
    lacks = any(choices[_key(row.cells[column])] is None for column, choices in columns.nodes.items())
    return absent | {columns.component} if lacks and columns.component else absent


def _with_nodes(system: RosSystem, columns: Columns, row: Row, library: Library) -> RosSystem:
    """Return the system with the nodes that the row chooses; a component that the variant lacks stays away."""
    for column, choices in columns.nodes.items():
        value = _key(row.cells[column])
        node = choices[value]
        if node and columns.component and system.component(columns.component):
            where = columns.where("nodes", column, value)
            system = with_executable(system, columns.component, node, library, where)
    return system


def _rewired(system: RosSystem, columns: Columns, row: Row) -> RosSystem:
    """Return the system with the connections that the row chooses in place of all that it may choose from."""
    chosen = [wire for column, choices in columns.wires.items() for wire in choices[_key(row.cells[column])]]
    names = _connection_names(system)
    bare, system = _unwired(system, tuple(columns.all_wires()))
    for wire in chosen:
        system = _wired(system, wire, names, row.position)
    ends = {end for connection in system.connections for end in (*connection.sources, *connection.targets)}
    bare -= ends
    components = tuple(
        replace(
            component, ports=tuple(port for port in component.ports if PortPath(component.name, port.name) not in bare)
        )
        for component in system.components
    )
    connections = sorted(system.connections, key=lambda connection: _CONNECTION_ORDER.index(connection.kind))
    return replace(system, components=components, connections=tuple(connections))


def _connection_names(system: RosSystem) -> dict[PortPath, str]:
    return {end: connection.name for connection in reversed(system.connections) for end in connection.sources}


def _unwired(system: RosSystem, wires: Collection[Wire]) -> tuple[set[PortPath], RosSystem]:
    """Return the system without some wires, and the ends that lost all of theirs in a connection."""
    bare: set[PortPath] = set()
    connections: list[Connection] = []
    for connection in system.connections:
        left: dict[tuple[PortPath, ...], list[PortPath]] = {}
        for target in connection.targets:
            kept = tuple(s for s in connection.sources if not any(wire.leads_to(s, target) for wire in wires))
            left.setdefault(kept, []).append(target)
        bare.update(left.pop((), ()))
        connections += [replace(connection, sources=sources, targets=tuple(left[sources])) for sources in left]
    return bare, replace(system, connections=tuple(connections))


def _wired(system: RosSystem, wire: Wire, names: dict[PortPath, str], where: Position) -> RosSystem:
    """Return the system with one more connection, and the port that takes it up."""
    outlet_kind, component = outlet(system, wire.source), system.component(wire.component)
    source = system.component(wire.source.component)
    if outlet_kind is None or component is None or source is None:
        missing = wire.source.component if outlet_kind is None else wire.component
        raise ModelError(f"connects {missing!r}, which this variant lacks", where)
    kind, port_kind = TARGET_OF[outlet_kind]
    name, where = names.get(wire.source) or _topic(source, wire.source.port), wire.position or where
    wanted = [wire.port] if wire.port else _taking(component, name, None if wire.source in names else wire.source.port)
    port = next(filter(None, (component.find_port(text, {port_kind}) for text in wanted)), None)
    target = PortPath(wire.component, port.name if port else wanted[-1], where)
    if port is None:
        system = _with_port(system, component, target.port, port_kind, where)
    connections = list(system.connections)
    for number, connection in enumerate(connections):
        if (connection.name, connection.kind, connection.sources) == (name, kind, (wire.source,)):
            connections[number] = replace(connection, targets=(*connection.targets, target))
            break
    else:
        connections.append(Connection(name, kind, (wire.source,), (target,), where))
    return replace(system, connections=tuple(connections))


def _topic(source: Component, port: str) -> str:
    """Return the name of a new connection: that of its source in the graph, with a slash where the port has one."""
    return port if port.startswith("/") else source.resolved(port).lstrip("/")


def _taking(component: Component, connection: str, port: str | None) -> list[str]:
    """Return names of the port by which a component may take up a connection; the last one is that of a new port.

    Args:
        component: the component.
        connection: the name of the connection, which begins in no namespace.
        port: the name of the port at its source, if the connection is new; nobody else has called it otherwise.
    """
    inside = connection.lstrip("/")
    namespace = component.graph_name.rpartition("/")[0] + "/"
    if port and port[0] not in "/~":
        seen = port
    elif namespace != "/" and inside.startswith(namespace):
        seen = inside.removeprefix(namespace)
    else:
        seen = connection
    return [connection, f"/{inside}", seen]


def _with_port(system: RosSystem, component: Component, name: str, kind: PortKind, where: Position) -> RosSystem:
    node = component.executable
    reference = Reference(node.package, node.artifact, node.node, name) if node else None
    ports = sorted(
        (*component.ports, Port(name, kind, reference, position=where)), key=lambda port: _PORT_ORDER.index(port.kind)
    )
    return _with_component(system, replace(component, ports=tuple(ports)))


def _with_component(system: RosSystem, changed: Component) -> RosSystem:
    components = (changed if component.name == changed.name else component for component in system.components)
    return replace(system, components=tuple(components))


def _with_parameters(component: Component, columns: Columns, row: Row) -> Component:
    """Return the component with what the row sets; an empty cell leaves the base's value."""
    node = component.executable
    found = [
        RosParameter(
            setting.name,
            Reference(node.package, node.artifact, node.node, setting.name),
            _fitting(component, setting, _scaled(cell, setting.factor)),
            position=row.position,
        )
        for column, settings in columns.parameters.items()
        for setting in settings
        if node and setting.component == component.name and (cell := row.cells[column]) is not None
    ]
    keys = {parameter.key for parameter in found}
    kept = (parameter for parameter in component.parameters if parameter.key not in keys)
    return replace(component, parameters=(*kept, *found))


def _scaled(cell: Value, factor: float | None) -> Value:
    """Return a cell, times the factor, if there is one, as a double; exactly, as people reckon (0.3 * 12 is 3.6)."""
    if factor is None:
        return cell
    return float(Decimal(str(cell)) * Decimal(str(factor)))


def _fitting(component: Component, setting: Setting, value: Value) -> Value:
    """Return an integer as a double where the base's value is one."""
    given = next((parameter.value for parameter in component.parameters if parameter.key == setting.name), None)
    return _double(value) if isinstance(given, float) else value  # type: ignore[return-value]


def _double(value: Value | None) -> Value | None:
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _expected(row: Row, columns: Mapping[str, str], levels: Table | None) -> list[SystemParameter]:
    """Return the expected levels of a row, from its own columns and from the table of levels."""
    cells = [(quality, row.cells[column], f"column {column!r}", row.position) for column, quality in columns.items()]
    wrong = Gathered()
    with wrong.step():
        cells += _levels(row, levels)
    found = []
    for quality, cell, what, where in cells:
        if isinstance(cell, bool) or not isinstance(cell, (int, float)):
            wrong.add([ModelError(f"{what} is {cell!r}, must be a number", where)])
        else:
            found.append(SystemParameter(f"qa_{quality}", ParameterType("Double"), float(cell), position=where))
    wrong.tell()
    return found


def with_levels(variant: RosSystem, levels: Table) -> RosSystem:
    """Return a variant that was written by hand, with the expected levels of a table.

    Raises:
        ModelError: the table has no row for it, a cell is no number, or the variant itself has a level, too.
    """
    found = _expected(Row(variant.name, {}, variant.position), {}, levels)
    names = {parameter.name for parameter in found}
    double = next((parameter for parameter in variant.parameters if parameter.name in names), None)
    if double is not None:
        raise ModelError(
            f"{variant.name} has {double.name} here and in {levels.path.name}: keep one", double.position, rule="table"
        )
    return replace(variant, parameters=(*variant.parameters, *found))


def _levels(row: Row, levels: Table | None) -> list[tuple[str, Value | None, str, Position]]:
    """Return quality attribute, cell, name for messages and position of each level of a row."""
    if levels is None:
        return []
    found = levels.row(row.name)
    if found is None:
        raise ModelError(
            f"no row for {row.name}: add its expected levels, or a row of empty cells if its function has none",
            Position(str(levels.path), 1, 1),
        )
    cells = {column: cell for column, cell in found.cells.items() if not _ABOUT.fullmatch(column)}
    if all(cell is None for cell in cells.values()):
        return []
    return [(column, cell, f"{row.name}: {column}", found.position) for column, cell in cells.items()]


def _key(cell: Value | None) -> str:
    """Return a cell as the mapping of its column writes it."""
    if isinstance(cell, bool):
        return str(cell).lower()
    return "" if cell is None else str(cell)
