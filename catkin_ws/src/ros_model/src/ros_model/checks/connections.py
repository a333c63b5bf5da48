"""Checks of connections: their ends, and the types of the ends."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

from ros_model.checks.references import declarations
from ros_model.findings import WARNING, Finding
from ros_model.generators.launch import told_topic
from ros_model.language.library import Library, Unknown, hint
from ros_model.language.metamodel import ENDS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from ros_model.language.metamodel import (
        Connection,
        PortKind,
        PortPath,
        RosSystem,
    )


def wrong_ends(connection: Connection, whole: RosSystem) -> Iterator[Finding]:
    """Yield the ends of a connection that are missing, or no ports of the right kind."""
    source_kind, target_kind = ENDS[connection.kind]
    for kind, role, ends in (
        (source_kind, "source", connection.sources),
        (target_kind, "target", connection.targets),
    ):
        if not ends:
            yield Finding(f"connection '{connection.name}' has no {role}", connection.position, "connection")
        for end in ends:
            if problem := _end(end, kind, whole):
                text, rule = problem
                place = end.position if end.position.line else connection.position
                yield Finding(f"connection '{connection.name}': {text}", place, rule)


def _end(end: PortPath, kind: PortKind, whole: RosSystem) -> tuple[str, str] | None:
    component = whole.component(end.component)
    if component is None:
        known = hint(end.component, (component.name for component in whole.components))
        return f"'{end}' names no component of this system{known}", "connection"
    kinds = {port.kind for port in component.ports if port.name == end.port}
    if not kinds:
        known = hint(end.port, (port.name for port in component.ports if port.kind is kind))
        return f"'{end.component}' has no port '{end.port}'{known}", "connection"
    if kind not in kinds:
        found = " and ".join(sorted(k.value for k in kinds))
        return f"'{end}' is a {found}, must be a {kind.value}", "wrong-kind"
    return None


def names_that_differ(connection: Connection, whole: RosSystem, started: Collection[str] | None) -> Iterator[Finding]:
    """Yield that ends of a connection do not meet in the graph, because their names resolve to different ones.

    A launch file made from the model gives a component the name of the connection. Other components run already, and
    have the names of their ports.

    Args:
        connection: the connection; an end that is no port of the system does not count.
        whole: the system that it is in.
        started: components that launch files made from models start; None: those of the whole system, or it runs
            already. Then only an absolute and a relative name are told, which are the same but for the namespace.
    """
    by_name: dict[str, list[PortPath]] = defaultdict(list)
    for ends, kind in zip((connection.sources, connection.targets), ENDS[connection.kind], strict=True):
        for end in ends:
            component = whole.component(end.component)
            ports = component.ports if component else ()
            port = next((p for p in ports if (p.name, p.kind) == (end.port, kind)), None)
            if component and port and port.namespace is None:
                is_started = component.name in (started or ())
                name = told_topic(component, port, whole) if is_started else port.name
                by_name[component.resolved(name)].append(end)
    if len(by_name) < 2:
        return
    if started is None:
        names = {end.port for alike in by_name.values() for end in alike}
        if not any(f"/{name}" in names for name in names):
            return
    (one, here), (other, there), *_ = by_name.items()
    text = (
        f"connection '{connection.name}': '{here[0]}' is {one} in the graph, but '{there[0]}' is {other}: they meet "
        "only if a launch file remaps one; else correct a name"
    )
    yield Finding(text, connection.position, "connection", WARNING)


def wrong_types(connection: Connection, whole: RosSystem, library: Library) -> Iterator[Finding]:
    """Yield ends whose type differs from that of the first typed end."""
    first: tuple[PortPath, str] | None = None
    for ends, kind in zip((connection.sources, connection.targets), ENDS[connection.kind], strict=True):
        for end in ends:
            found = _type(end, kind, whole, library)
            if found and first is None:
                first = end, found
            elif found and first and found.removesuffix("Action") != first[1].removesuffix("Action"):
                text = f"connection '{connection.name}': '{end}' is {found}, but '{first[0]}' is {first[1]}"
                place = end.position if end.position.line else connection.position
                yield Finding(text, place, "type-mismatch")


def _type(end: PortPath, kind: PortKind, whole: RosSystem, library: Library) -> str:
    """Return the type of an end, "" if it is not known; where the node has the port of another kind only, that one's.

    A port that its node does not declare is told where the port is.
    """
    component = whole.component(end.component)
    ports = component.ports if component else ()
    reference = next((port.reference for port in ports if port.name == end.port and port.kind is kind), None)
    node = library.node(reference) if reference else None
    if component is None or reference is None or node is None or isinstance(node, Unknown):
        return ""
    declared = sorted(declarations(reference, node, component), key=lambda port: (port.kind is not kind, not port.type))
    return declared[0].type if declared else ""
