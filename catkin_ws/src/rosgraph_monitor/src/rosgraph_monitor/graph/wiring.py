"""Compares interfaces, types and connections of the model with those that the master lists. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_model.language.graph_names import resolve
from ros_model.language.metamodel import ConnectionKind, PortKind

from rosgraph_monitor.graph.findings import (
    AdditionalPort,
    MissingConnection,
    MissingPort,
    PortFinding,
    WrongType,
)
from rosgraph_monitor.graph.names import COMMON_TOPICS, is_ignored_port, is_reconfigured_part, relative, resolved

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from ros_model.graph.snapshot import GraphSnapshot, NodeState
    from ros_model.language.metamodel import Component, Connection, Port, PortPath, RosSystem
    from ros_model.language.packages import PackageSet

_SERVER_SENDS = ("status", "feedback", "result")
_CLIENT_SENDS = ("goal", "cancel")
_CONNECTS = {
    ConnectionKind.TOPIC: (PortKind.PUBLISHER, PortKind.SUBSCRIBER),
    ConnectionKind.ACTION: (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT),
}
_UNKNOWN_TYPES = ("", "*")

PortTypes = dict[tuple[str, str, str, PortKind], dict[str, str]]
"""Types of ports by their names, by package, artifact, node and kind, as `.ros` models declare them."""


def port_types(models: Iterable[PackageSet]) -> PortTypes:
    """Collect the types that `.ros` models declare."""
    found: PortTypes = {}
    for model in models:
        for package in model.packages:
            for artifact in package.artifacts:
                for node in artifact.nodes:
                    for port in node.ports:
                        if port.type:
                            key = (package.name, artifact.name, node.name, port.kind)
                            found.setdefault(key, {})[port.name] = port.type
    return found


@dataclass(frozen=True)
class Live:
    """A component that runs, with its model and its node in the graph."""

    component: Component
    node: NodeState


def compare_ports(
    snapshot: GraphSnapshot,
    system: RosSystem,
    live: Mapping[str, Live],
    *,
    ignored: Iterable[str],
    types: PortTypes,
    namespace: str = "/",
) -> Iterator[PortFinding]:
    """Compare the interfaces of the components that run, given by their names, with the model.

    A component that has no port in the model is not judged: its model says nothing about interfaces. If nobody listens
    to a node, it may lack subscriptions, as lazy publishers do. The master does not know the clients of services. Nodes
    may make a client of an action for each goal: it need not be there, and it may be one of any action that is served.

    Yields:
        Missing ports, wrong types, additional ports, missing connections. Names are relative to the namespace.
    """
    patterns = tuple(ignored)
    called: dict[tuple[str, str], set[str]] = {}
    for connection in system.connections:
        for end in (*connection.sources, *connection.targets):
            called.setdefault((end.component, end.port), set()).add(connection.name)
    wanted = {
        component.name: _wanted(called, component, live[component.name].node.name)
        if component.name in live
        else _wanted(called, component, resolved(component.graph_name, namespace))
        for component in system.components
    }
    served = {action.name for action in snapshot.actions.values() if action.servers}
    for ports in wanted.values():
        served.update(*(names for (kind, _), (_, names) in ports.items() if kind is PortKind.ACTION_SERVER))
    for name, entry in live.items():
        yield from _component_ports(snapshot, entry, wanted[name], served, patterns, types, namespace)
    for connection in system.connections:
        yield from _connection(snapshot, connection, live, wanted, namespace)


@dataclass(frozen=True)
class Link:
    """A connection of the model as it should be in the graph.

    Attributes:
        kind: what it carries.
        name: resolved name of the topic, service or action: the one that the graph has, else that of the connection.
        sources: resolved names of the nodes that publish or serve.
        targets: resolved names of the nodes that subscribe or ask.
    """

    kind: ConnectionKind
    name: str
    sources: tuple[str, ...]
    targets: tuple[str, ...]


def desired_links(snapshot: GraphSnapshot, system: RosSystem, namespace: str = "/") -> list[Link]:
    """Return the connections of a model, with the names that their ends have in the graph or would have."""
    called: dict[tuple[str, str], set[str]] = {}
    for connection in system.connections:
        for end in (*connection.sources, *connection.targets):
            called.setdefault((end.component, end.port), set()).add(connection.name)
    nodes = {component.name: resolved(component.graph_name, namespace) for component in system.components}
    wanted = {c.name: _wanted(called, c, nodes[c.name]) for c in system.components}
    present = snapshot.topics.keys() | snapshot.services.keys() | snapshot.actions.keys()
    links = []
    for connection in system.connections:
        sources = [end for end in connection.sources if end.component in nodes]
        targets = [end for end in connection.targets if end.component in nodes]
        names: set[str] = set()
        for end in (*sources, *targets):
            names |= {n for (_, port), (_, found) in wanted[end.component].items() if port == end.port for n in found}
        ends = [tuple(dict.fromkeys(nodes[end.component] for end in side)) for side in (sources, targets)]
        known = sorted(names & present)  # a port may have several names: that which most of the ends have
        name = max(
            known, key=lambda name: _fitting(snapshot, name, *ends), default=resolved(connection.name, namespace)
        )
        links.append(Link(connection.kind, name, *ends))
    return links


def _fitting(snapshot: GraphSnapshot, name: str, sources: Collection[str], targets: Collection[str]) -> int:
    """Return how many of the nodes are ends of the topic or action of a name."""
    if name in snapshot.actions:
        action = snapshot.actions[name]
        return len(set(sources) & set(action.servers)) + len(set(targets) & set(action.clients))
    topic = snapshot.topics.get(name)
    return len(set(sources) & set(topic.publishers)) + len(set(targets) & set(topic.subscribers)) if topic else 0


_Wanted = dict[tuple[PortKind, str], tuple["Port", frozenset[str]]]
"""Of one component: by kind and name of the port, the port and the resolved names that it may have in the graph."""


def _wanted(called: Mapping[tuple[str, str], Iterable[str]], component: Component, node: str) -> _Wanted:
    """Return what a component should have, given the connections' names by component and port, and its node's name.

    A port has the name of its connection, its own name, or the name in the node's code. The launch file decides which.
    """
    wanted = {}
    for port in component.ports:
        names = {port.name, port.name.lstrip("/") if port.namespace is not None else port.name}
        if port.reference and port.reference.name:
            names.add(port.reference.name)
        for name in called.get((component.name, port.name), ()):
            names |= {name, f"/{name.lstrip('/')}"}
        wanted[port.kind, port.name] = port, frozenset(resolve(name, node) for name in names)
    return wanted


def _component_ports(
    snapshot: GraphSnapshot,
    entry: Live,
    wanted: _Wanted,
    served: Collection[str],
    patterns: tuple[str, ...],
    types: PortTypes,
    namespace: str,
) -> Iterator[PortFinding]:
    name = entry.component.graph_name
    if not wanted:
        return
    has = {kind: _has(entry.node, kind) for kind in PortKind}
    idle = _nobody_listens(snapshot, entry.node)
    for (kind, port_name), (port, names) in wanted.items():
        if kind is PortKind.SERVICE_CLIENT or (kind is PortKind.SUBSCRIBER and idle):
            continue
        present = names & has[kind]
        may_lack = kind is PortKind.ACTION_CLIENT or any(_is_of_client(kind, topic, served) for topic in names)
        if not present and not may_lack and not all(is_reconfigured_part(topic, entry.node.name) for topic in names):
            yield MissingPort(name, kind.value, port_name)
        expected = _declared_type(port, types, entry.node.name)
        for topic in present if expected else ():
            actual = _type(snapshot, topic, kind)
            if expected and actual not in _UNKNOWN_TYPES and _stem(actual, kind) != _stem(expected, kind):
                yield WrongType(name, _shown(topic, namespace), expected, actual)
    for kind, listed in _listed(entry.node).items():
        known = {topic for (_, _), (port, topics) in wanted.items() for topic in _covered(port.kind, topics, kind)}
        for topic in listed:
            if topic in known or _is_of_client(kind, topic, served):
                continue
            if not is_ignored_port(topic, entry.node.name, patterns):
                yield AdditionalPort(name, kind.value, _shown(topic, namespace))


def _connection(
    snapshot: GraphSnapshot,
    connection: Connection,
    live: Mapping[str, Live],
    wanted: Mapping[str, _Wanted],
    namespace: str,
) -> Iterator[PortFinding]:
    kinds = _CONNECTS.get(connection.kind)
    if kinds is None:  # who calls a service, the master does not know
        return
    for source in connection.sources:
        out = _names_of(source, kinds[0], live, wanted)
        for target in connection.targets:
            into = _names_of(target, kinds[1], live, wanted)
            if out is None or into is None or _is_lazy(snapshot, target, kinds[1], live):
                continue
            if kinds[1] is PortKind.ACTION_CLIENT and not into:
                continue
            if not out & into:
                given = ", ".join(sorted(_shown(topic, namespace) for topic in out)) or "nothing"
                taken = ", ".join(sorted(_shown(topic, namespace) for topic in into)) or "nothing"
                yield MissingConnection(
                    connection.name,
                    str(source),
                    str(target),
                    f"{source} gives {given}, {target} takes {taken}",
                    (live[source.component].component.graph_name, live[target.component].component.graph_name),
                )


def _names_of(
    end: PortPath, kind: PortKind, live: Mapping[str, Live], wanted: Mapping[str, _Wanted]
) -> frozenset[str] | None:
    """Return the names that an end may have in the graph; None if it can't be judged."""
    if end.component not in live or (kind, end.port) not in wanted[end.component]:
        return None
    return wanted[end.component][kind, end.port][1] & _has(live[end.component].node, kind)


def _is_lazy(snapshot: GraphSnapshot, end: PortPath, kind: PortKind, live: Mapping[str, Live]) -> bool:
    return kind is PortKind.SUBSCRIBER and _nobody_listens(snapshot, live[end.component].node)


def _nobody_listens(snapshot: GraphSnapshot, node: NodeState) -> bool:
    """Return whether a node has topics of its own to which nobody listens."""
    own = [topic for topic in node.publications if topic not in COMMON_TOPICS]
    return bool(own) and not any(snapshot.topics[topic].subscribers for topic in own)


def _has(node: NodeState, kind: PortKind) -> frozenset[str]:
    """Return all names of that kind, with the topics of actions unfolded: a model may name those, too."""
    match kind:
        case PortKind.PUBLISHER:
            return frozenset(
                (
                    *node.publications,
                    *_unfolded(node.action_servers, _SERVER_SENDS),
                    *_unfolded(node.action_clients, _CLIENT_SENDS),
                )
            )
        case PortKind.SUBSCRIBER:
            return frozenset(
                (
                    *node.subscriptions,
                    *_unfolded(node.action_servers, _CLIENT_SENDS),
                    *_unfolded(node.action_clients, _SERVER_SENDS),
                )
            )
    return frozenset(_listed(node).get(kind, ()))


def _is_of_client(kind: PortKind, name: str, served: Collection[str]) -> bool:
    """Return whether a port is a client of an action that is served, or one of the client's topics."""
    if kind is PortKind.ACTION_CLIENT:
        return name in served
    ends = {PortKind.PUBLISHER: _CLIENT_SENDS, PortKind.SUBSCRIBER: _SERVER_SENDS}.get(kind, ())
    action, _, end = name.rpartition("/")
    return end in ends and action in served


def _listed(node: NodeState) -> dict[PortKind, tuple[str, ...]]:
    return {
        PortKind.PUBLISHER: node.publications,
        PortKind.SUBSCRIBER: node.subscriptions,
        PortKind.SERVICE_SERVER: node.services,
        PortKind.ACTION_SERVER: node.action_servers,
        PortKind.ACTION_CLIENT: node.action_clients,
    }


def _covered(kind: PortKind, names: Iterable[str], listed: PortKind) -> Iterable[str]:
    """Return the names of another kind that a port covers: a topic of an action stands for the action."""
    if kind is listed:
        return names
    if listed in (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT):
        return [name.rpartition("/")[0] for name in names if name.endswith((*_SERVER_SENDS, *_CLIENT_SENDS))]
    if kind in (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT):
        return list(_unfolded(names, (*_SERVER_SENDS, *_CLIENT_SENDS)))
    return ()


def _unfolded(actions: Iterable[str], suffixes: Iterable[str]) -> Iterator[str]:
    return (f"{action}/{suffix}" for action in actions for suffix in suffixes)


def _declared_type(port: Port, types: PortTypes, node: str) -> str:
    """Return the type that a `.ros` model declares for a port, by the name in the node's code; "" if none does.

    Models from source write the name as the code has it, models of running systems as the node's namespace sees it.
    """
    if not port.reference:
        return ""
    code = port.reference
    declared = types.get((code.package, code.artifact, code.node, port.kind), {})
    alike = (kind for name, kind in declared.items() if resolve(name, node) == resolve(code.name, node))
    return declared.get(code.name) or next(alike, "")


def _stem(type_name: str, kind: PortKind) -> str:
    """Return the type without the suffix of an action, which models may leave out."""
    return type_name.removesuffix("Action") if kind in (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT) else type_name


def _type(snapshot: GraphSnapshot, name: str, kind: PortKind) -> str:
    """Return the type of a topic or action, which may share its name; "" for a service: the master does not know it."""
    if kind in (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT):
        return snapshot.actions[name].type if name in snapshot.actions else ""
    is_topic = kind in (PortKind.PUBLISHER, PortKind.SUBSCRIBER)
    return snapshot.topics[name].type if is_topic and name in snapshot.topics else ""


def _shown(name: str, namespace: str) -> str:
    return relative(name, namespace) or name
