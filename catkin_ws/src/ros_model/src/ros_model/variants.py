"""A family of systems from one base and a table: what each column sets is written in metacontrol.yaml."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING, Any

from ros_model.errors import ModelError
from ros_model.files import read_text, safe_file_name
from ros_model.metamodel import (
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

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

Row = dict[str, str]


def make_variants(
    base: RosSystem, section: Mapping[str, Any], table: Path, qa: Path | None, settings: Path
) -> tuple[RosSystem, ...]:
    """Return one partial system for each row of the table.

    A variant holds the component of the base that varies, its connections, the parameters that the columns set, and
    the expected levels of the quality attributes as parameters `qa_<name>`.

    Args:
        base: the system that varies.
        section: `variants` of metacontrol.yaml: component; parameters: column -> [{name, factor}], connections:
            column -> value -> [component.port of a source].
        table: CSV with a column `name` and those that the section maps.
        qa: CSV with a column `name`, one for each quality attribute, and `source`; may be None.
        settings: path of metacontrol.yaml, for messages.

    Raises:
        ModelError: a file or mapping is wrong; says which, and where.
    """
    component = base.component(section["component"])
    if component is None or component.executable is None:
        raise ModelError(
            f"{settings}: variants.component: {section['component']!r} is no component with a FromRosNode in "
            f"{base.position.file}"
        )
    rows = _read_table(table)
    levels = {row["name"]: row for _, row in _read_table(qa)} if qa else {}
    mapped = {*section.get("parameters", {}), *section.get("connections", {})}
    variants = []
    for line, row in rows:
        if unmapped := sorted(set(row) - mapped - {"name"}):
            raise ModelError(f"{settings}: variants: nothing says what column {unmapped[0]!r} of {table} sets")
        if absent := sorted(mapped - set(row)):
            raise ModelError(f"{table}:1:1: column {absent[0]!r} is missing: {settings} maps it")
        if qa and row["name"] not in levels:
            raise ModelError(f"{qa}: no row for {row['name']}: add its expected levels")
        expected = _expected(levels[row["name"]], qa) if qa else ()
        where = Position(str(table), line, 1)
        varied, connections = _vary(base, component, section, row, where)
        name = safe_file_name(row["name"], f"{where}: variant")
        variants.append(RosSystem(name, (varied,), connections, expected, position=where))
    return tuple(variants)


def _vary(
    base: RosSystem, component: Component, section: Mapping[str, Any], row: Row, where: Position
) -> tuple[Component, tuple[Connection, ...]]:
    """Return the component and its connections as one row of the table wants them."""
    wiring = section.get("connections", {})
    chosen: list[PortPath] = []
    for column, choices in wiring.items():
        if row[column] not in choices:
            raise ModelError(f"column {column!r} is {row[column]!r}, must be {' or '.join(choices)}", where)
        chosen += [PortPath.parse(text) for text in choices[row[column]]]
    options = {PortPath.parse(text) for choices in wiring.values() for texts in choices.values() for text in texts}
    connections, dropped = _own_connections(base, component.name, options)
    ports = [port for port in component.ports if port.name not in dropped]
    for source in chosen:
        port, connection = _connect(base, component, source, where)
        ports.append(port)
        connections.append(connection)
    set_here = _parameters(component, section, row, where)
    keys = {parameter.key for parameter in set_here}
    varied = replace(
        component,
        ports=tuple(sorted(ports, key=lambda port: list(PortKind).index(port.kind))),
        parameters=(*(p for p in component.parameters if p.key not in keys), *set_here),
    )
    return varied, tuple(sorted(connections, key=lambda connection: list(ConnectionKind).index(connection.kind)))


def _own_connections(base: RosSystem, name: str, options: set[PortPath]) -> tuple[list[Connection], set[str]]:
    """Return the base's connections of a component without the optional ones, and the ports these leave bare."""
    connections: list[Connection] = []
    dropped: set[str] = set()
    for connection in base.connections:
        sources = tuple(end for end in connection.sources if end not in options)
        inward = tuple(end for end in connection.targets if end.component == name)
        outward = tuple(end for end in connection.sources if end.component == name)
        if inward and not sources:
            dropped.update(end.port for end in inward)
        elif inward:
            connections.append(replace(connection, sources=sources, targets=inward))
        elif outward:
            connections.append(replace(connection, sources=outward))
    return connections, dropped


def _connect(base: RosSystem, component: Component, source: PortPath, where: Position) -> tuple[Port, Connection]:
    """Return the component's port and the connection that take up a source of the base."""
    origin = base.component(source.component)
    port = origin.port(source.port) if origin else None
    node = component.executable
    if port is None or node is None or port.kind is not PortKind.PUBLISHER:
        raise ModelError(f"{source} is no RosPublisher of {base.position.file}: check variants.connections", where)
    existing = next((connection for connection in base.connections if source in connection.sources), None)
    topic = existing.name if existing else port.name
    reference = Reference(node.package, node.artifact, node.node, topic)
    target = Port(topic, PortKind.SUBSCRIBER, reference, position=where)
    path = PortPath(component.name, topic)
    return target, Connection(topic, ConnectionKind.TOPIC, (source,), (path,), where)


def _parameters(
    component: Component, section: Mapping[str, Any], row: Row, where: Position
) -> tuple[RosParameter, ...]:
    node = component.executable
    if node is None:
        return ()
    return tuple(
        RosParameter(
            entry["name"],
            Reference(node.package, node.artifact, node.node, entry["name"]),
            _scaled(row[column], entry.get("factor"), column, where),
            position=where,
        )
        for column, entries in section.get("parameters", {}).items()
        for entry in entries
    )


def _scaled(text: str, factor: float | None, column: str, where: Position) -> Value:
    """Return a cell as an integer, a double or a string; times the factor, if there is one, as a double."""
    try:
        number = Decimal(text)
    except InvalidOperation:
        number = Decimal("nan")
    if factor is not None:
        if not number.is_finite():
            raise ModelError(f"column {column!r} is {text!r}, must be a number: it is scaled by {factor}", where)
        return float(number * Decimal(str(factor)))
    if not number.is_finite():
        return text
    return int(text) if text.lstrip("+-").isdecimal() else float(number)


def _expected(row: Row, qa: Path | None) -> tuple[SystemParameter, ...]:
    parameters = []
    for name, text in row.items():
        if name in {"name", "source"}:
            continue
        try:
            level = float(text)
        except ValueError:
            level = math.nan
        if not math.isfinite(level):
            raise ModelError(f"{qa}: {row['name']}: {name} is {text!r}, must be a number")
        parameters.append(SystemParameter(f"qa_{name}", ParameterType("Double"), level))
    return tuple(parameters)


def _read_table(path: Path) -> list[tuple[int, Row]]:
    """Return the rows of a CSV file with their lines; every row has a name of its own and all columns."""
    reader = csv.DictReader(io.StringIO(read_text(path)), strict=True)
    rows: list[tuple[int, Row]] = []
    seen: set[str] = set()
    try:
        if "name" not in (reader.fieldnames or ()):
            raise ModelError(f"{path}:1:1: no column 'name': the first line must name the columns")
        for row in reader:
            if None in row or None in row.values():
                raise ModelError(f"{path}:{reader.line_num}:1: must have {len(reader.fieldnames or ())} cells")
            if not row["name"] or row["name"] in seen:
                raise ModelError(f"{path}:{reader.line_num}:1: name {row['name']!r} is empty or stands twice")
            seen.add(row["name"])
            rows.append((reader.line_num, {key: value.strip() for key, value in row.items()}))
    except csv.Error as error:
        raise ModelError(f"{path}:{reader.line_num}:1: {error}") from error
    if not rows:
        raise ModelError(f"{path}:1:1: no rows: add one for each variant")
    return rows
