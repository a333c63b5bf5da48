"""Comparison of what runs with what should run: a snapshot and the desired system in, findings out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from metacontrol_bags.ownership import is_of_another, robots_inside

from rosgraph_monitor.graph.defaults import Defaults, default_of
from rosgraph_monitor.graph.findings import (
    NO_NODE,
    NOT_SET,
    AdditionalNode,
    Finding,
    MissingNode,
    PortFinding,
    WrongParameter,
    WrongType,
)
from rosgraph_monitor.graph.names import (
    IGNORED_NODES,
    IGNORED_PORTS,
    instances,
    is_ignored_node,
    relative,
    resolved,
    system_parameter_name,
)
from rosgraph_monitor.graph.values import same_value
from rosgraph_monitor.graph.wiring import Live, PortTypes, compare_ports

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from ros_model.graph.snapshot import GraphSnapshot, NodeState
    from ros_model.language.metamodel import Component, RosSystem

NOT_REGISTERED = "absent", "not registered with the master"
CONVENTIONS = ("qa_", "min_rate/", "max_age/", "stuck_after/")
"""Names of system parameters that say something of the system, and that nobody need set on the parameter server."""


@dataclass(frozen=True)
class Scope:
    """What is compared.

    Attributes:
        ignored_nodes: shell patterns of names of nodes that may run beside the model.
        ignored_ports: shell patterns of topics, services and actions that nodes may have beside the model.
        types: of ports, by `.ros` models.
        defaults: of parameters in the code of nodes, by `.ros` models.
        topic_types: of topics, by name relative to the namespace.
        namespace: where the system lives; nodes outside it are none of its business, nor are those of a robot inside
            it that has a meta-controller of its own.
    """

    ignored_nodes: tuple[str, ...] = IGNORED_NODES
    ignored_ports: tuple[str, ...] = IGNORED_PORTS
    types: PortTypes = field(default_factory=dict)
    defaults: Defaults = field(default_factory=dict)
    topic_types: Mapping[str, str] = field(default_factory=dict)
    namespace: str = "/"


def compare(
    snapshot: GraphSnapshot,
    desired: RosSystem,
    *,
    dead: Mapping[str, tuple[str, str]],
    excused: Collection[str] = (),
    idle: Collection[str] = (),
    scope: Scope = Scope(),
) -> tuple[Finding, ...]:
    """Compare a snapshot with the desired system.

    Args:
        snapshot: what the master lists.
        desired: what should run: the base composed with the active variants.
        dead: resolved names of nodes that are known not to run, with their state in one word and the reason in words.
        excused: names (relative, as in the findings) of desired nodes that raise no alarm now.
        idle: names of nodes that may run or not.
        scope: what is compared.

    Returns:
        Missing nodes, wrong parameters, findings on ports, additional nodes; names are relative to the namespace.
    """
    running = running_nodes(snapshot, desired, dead, scope.namespace)
    gone = instances((resolved(c.graph_name, scope.namespace) for c in desired.components), dead)
    missing: list[Finding] = []
    live: dict[str, Live] = {}
    for component in desired.components:
        if component.graph_name in excused:
            continue
        if component.graph_name in running:
            live[component.name] = Live(component, running[component.graph_name])
        else:
            state = dead.get(gone.get(resolved(component.graph_name, scope.namespace), ""), NOT_REGISTERED)
            missing.append(MissingNode(component.graph_name, *state))
    others = robots_inside(scope.namespace, snapshot.nodes)
    expected = {node.name for node in running.values()}
    own = (n for n in sorted(snapshot.nodes.keys() - dead.keys() - expected) if not is_of_another(n, others))
    additional = [
        AdditionalNode(name)
        for name in (relative(node, scope.namespace) for node in own)
        if name is not None and name not in (*excused, *idle) and not is_ignored_node(name, scope.ignored_nodes)
    ]
    return (
        *missing,
        *(
            wrong
            for entry in live.values()
            for wrong in _wrong_parameters(snapshot, entry.component, entry.node.name, scope.defaults)
        ),
        *(() if excused else _wrong_system_parameters(snapshot, desired, scope.namespace)),
        *compare_ports(
            snapshot, desired, live, ignored=scope.ignored_ports, types=scope.types, namespace=scope.namespace
        ),
        *wrong_topic_types(snapshot, scope.topic_types, scope.namespace),
        *additional,
    )


def running_nodes(
    snapshot: GraphSnapshot, desired: RosSystem, dead: Collection[str], namespace: str = "/"
) -> dict[str, NodeState]:
    """Return the nodes of the desired system that run, by their names in the findings."""
    names = {resolved(component.graph_name, namespace): component.graph_name for component in desired.components}
    running = instances(names, snapshot.nodes.keys() - dead)
    return {names[name]: snapshot.nodes[node] for name, node in running.items()}


def wrong_topic_types(snapshot: GraphSnapshot, types: Mapping[str, str], namespace: str = "/") -> list[PortFinding]:
    """Compare the types of topics with those that settings give, for topics that exist."""
    found: list[PortFinding] = []
    for topic, expected in types.items():
        state = snapshot.topics.get(resolved(topic, namespace))
        if state and state.type not in ("", "*", expected):
            owner = (relative(node, namespace) or node for node in (*state.publishers, *state.subscribers))
            found.append(WrongType(next(owner, NO_NODE), topic, expected, state.type))
    return found


def _wrong_parameters(
    snapshot: GraphSnapshot, component: Component, node: str, defaults: Defaults
) -> list[WrongParameter]:
    """Compare a node's parameters with the model. A node takes its code's default for what nobody has set."""
    wrong = []
    for parameter in component.parameters:
        if parameter.value is None:
            continue
        parts = (node, parameter.namespace or "", parameter.key)
        actual = _actual(snapshot, "/".join(part.strip("/") for part in parts if part.strip("/")))
        default = default_of(parameter, component, defaults) if actual is NOT_SET else None
        if default is not None and not same_value(parameter.value, default):
            actual = f"{default} (not set: the code's default)"
        elif default is not None or same_value(parameter.value, actual):
            continue
        wrong.append(WrongParameter(component.graph_name, parameter.key, parameter.value, actual))
    return wrong


def _wrong_system_parameters(snapshot: GraphSnapshot, desired: RosSystem, namespace: str) -> list[WrongParameter]:
    wrong = []
    for parameter in desired.parameters:
        if parameter.value is None or parameter.name.startswith(CONVENTIONS):
            continue
        name = system_parameter_name(parameter)
        actual = _actual(snapshot, resolved(name, namespace))
        if not same_value(parameter.value, actual):
            wrong.append(WrongParameter(NO_NODE, name, parameter.value, actual))
    return wrong


def _actual(snapshot: GraphSnapshot, name: str) -> object:
    try:
        return snapshot.parameter(name)
    except KeyError:
        return NOT_SET
