"""A snapshot of a running ROS graph as plain frozen data, made from the master's answers."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

_TO_SERVER = ("goal", "cancel")
_TO_CLIENT = ("status", "feedback", "result")
_GOAL_TYPE = "ActionGoal"

ParameterTree = dict[str, Any]
"""Parameters as the master keeps them: nested dicts by name part."""


@dataclass(frozen=True)
class TopicState:
    """A topic: its type ("" or "*" where nobody said) and the nodes at both ends, sorted."""

    name: str
    type: str
    publishers: tuple[str, ...] = ()
    subscribers: tuple[str, ...] = ()


@dataclass(frozen=True)
class ServiceState:
    """A service and the nodes that offer it."""

    name: str
    servers: tuple[str, ...] = ()


@dataclass(frozen=True)
class ActionState:
    """An action, folded from its five topics. The type is that of the action, e.g. `move_base_msgs/MoveBaseAction`.

    A server listens to goals and cancellations, and publishes status, feedback and result; a client does the reverse.
    A node that does less than that is no end of the action, only of its topics.
    """

    name: str
    type: str
    servers: tuple[str, ...] = ()
    clients: tuple[str, ...] = ()


@dataclass(frozen=True)
class NodeState:
    """A node that the master lists, with the address of its own XML-RPC API. Names are resolved and sorted.

    What it publishes and subscribes to as the server or client of an action is not among its topics.
    """

    name: str
    uri: str
    publications: tuple[str, ...] = ()
    subscriptions: tuple[str, ...] = ()
    services: tuple[str, ...] = ()
    action_servers: tuple[str, ...] = ()
    action_clients: tuple[str, ...] = ()


@dataclass(frozen=True)
class GraphSnapshot:
    """What the master lists: all topics, and the actions that some of them make up."""

    nodes: Mapping[str, NodeState] = field(default_factory=dict)
    topics: Mapping[str, TopicState] = field(default_factory=dict)
    services: Mapping[str, ServiceState] = field(default_factory=dict)
    actions: Mapping[str, ActionState] = field(default_factory=dict)
    parameters: ParameterTree = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as dicts, lists and scalars, fit for JSON but for binary parameters and dates."""
        return dataclasses.asdict(self)

    def parameter(self, name: str) -> Any:
        """Return the value (a dict for a whole namespace) of a parameter by its resolved name.

        Raises:
            KeyError: it is not set.
        """
        value: Any = self.parameters
        for part in name.strip("/").split("/"):
            if not isinstance(value, dict) or part not in value:
                raise KeyError(name)
            value = value[part]
        return value


def build_snapshot(
    state: Sequence[Any], types: Iterable[tuple[str, str]], parameters: object, addresses: Mapping[str, str]
) -> GraphSnapshot:
    """Make a snapshot of the master's answers.

    Args:
        state: answer to getSystemState: publishers, subscribers, services, each a list of [name, [node, ...]].
        types: answer to getTopicTypes: [topic, type] pairs.
        parameters: answer to getParam of `/`; anything but a tree counts as no parameters.
        addresses: address of each node by name; a node without one has gone and is left out.
    """
    publishers, subscribers, services = (
        {name: tuple(sorted(set(nodes) & addresses.keys())) for name, nodes in part} for part in state
    )
    type_of: dict[str, str] = dict(types)
    topics = {
        name: TopicState(name, type_of.get(name, ""), publishers.get(name, ()), subscribers.get(name, ()))
        for name in sorted(publishers.keys() | subscribers.keys())
    }
    actions = _actions(topics)
    offered = {name: ServiceState(name, servers) for name, servers in sorted(services.items())}
    return GraphSnapshot(
        nodes=_nodes(topics, offered, actions, addresses),
        topics=topics,
        services=offered,
        actions=actions,
        parameters=parameters if isinstance(parameters, dict) else {},
    )


def node_names(state: object) -> list[str]:
    """Return all nodes that an answer to getSystemState mentions, after a check of its form.

    Raises:
        ValueError: it has another form.
    """
    names: set[str] = set()
    try:
        parts = list(state)  # type: ignore[call-overload]
        if len(parts) != 3:
            raise ValueError(f"{len(parts)} parts where there should be publishers, subscribers and services")
        for part in parts:
            for name, nodes in part:
                if not isinstance(name, str) or not all(isinstance(node, str) for node in nodes):
                    raise TypeError("names must be strings")
                names.update(nodes)
    except (TypeError, ValueError) as error:
        raise ValueError(f"answer to getSystemState is garbage: {error}") from error
    return sorted(names)


def topic_types(types: Any) -> list[tuple[str, str]]:
    """Return the topics of an answer to getTopicTypes, each with its type, after a check of its form.

    Raises:
        ValueError: it has another form.
    """
    match types:
        case [*pairs] if all(isinstance(pair, list) and [type(end) for end in pair] == [str, str] for pair in pairs):
            return [(name, type_name) for name, type_name in pairs]
    raise ValueError("answer to getTopicTypes is garbage")


def _actions(topics: Mapping[str, TopicState]) -> dict[str, ActionState]:
    """Find the topics that together are an action: all five, a goal of an action's goal type, a server or client."""
    actions = {}
    for name, goal in topics.items():
        base = name.removesuffix("/goal")
        if base == name or not goal.type.endswith(_GOAL_TYPE):
            continue
        to_server, to_client = ([topics.get(f"{base}/{end}") for end in ends] for ends in (_TO_SERVER, _TO_CLIENT))
        servers = _nodes_at_all(subscribed=to_server, published=to_client)
        clients = _nodes_at_all(subscribed=to_client, published=to_server)
        if servers or clients:
            actions[base] = ActionState(base, goal.type.removesuffix("Goal"), servers, clients)
    return actions


def _nodes_at_all(subscribed: Iterable[TopicState | None], published: Iterable[TopicState | None]) -> tuple[str, ...]:
    """Return the nodes that are an end of all these topics; of a topic that does not exist, none is."""
    ends = [t.subscribers if t else () for t in subscribed] + [t.publishers if t else () for t in published]
    return tuple(sorted(set(ends[0]).intersection(*ends[1:])))


def _nodes(
    topics: Mapping[str, TopicState],
    services: Mapping[str, ServiceState],
    actions: Mapping[str, ActionState],
    addresses: Mapping[str, str],
) -> dict[str, NodeState]:
    ends: dict[str, dict[str, list[str]]] = {name: defaultdict(list) for name in sorted(addresses)}
    heard, sent = _folded(actions.values())
    for topic in topics.values():
        for node in topic.publishers:
            if (topic.name, node) not in sent:
                ends[node]["publications"].append(topic.name)
        for node in topic.subscribers:
            if (topic.name, node) not in heard:
                ends[node]["subscriptions"].append(topic.name)
    for service in services.values():
        for node in service.servers:
            ends[node]["services"].append(service.name)
    for action in actions.values():
        for node in action.servers:
            ends[node]["action_servers"].append(action.name)
        for node in action.clients:
            ends[node]["action_clients"].append(action.name)
    return {
        name: NodeState(name, addresses[name], **{kind: tuple(names) for kind, names in kinds.items()})
        for name, kinds in ends.items()
    }


def _folded(actions: Iterable[ActionState]) -> tuple[set[tuple[str, str]], set[tuple[str, str]]]:
    """Return the ends of topics, as topic and node, that actions account for: subscribers, publishers."""
    heard: set[tuple[str, str]] = set()
    sent: set[tuple[str, str]] = set()
    for action in actions:
        for nodes, hears, sends in (
            (action.servers, _TO_SERVER, _TO_CLIENT),
            (action.clients, _TO_CLIENT, _TO_SERVER),
        ):
            heard.update((f"{action.name}/{end}", node) for end in hears for node in nodes)
            sent.update((f"{action.name}/{end}", node) for end in sends for node in nodes)
    return heard, sent
