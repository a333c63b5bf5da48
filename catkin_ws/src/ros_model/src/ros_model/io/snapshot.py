"""A snapshot of a running ROS graph, taken in four calls to the master and held as plain frozen data.

The calls are getSystemState, getTopicTypes, getParam of the whole tree, and one `system.multicall` of lookupNode for
the nodes' addresses. Nothing here is asked of the nodes themselves: a node that the master lists may well be dead.
"""

from __future__ import annotations

import dataclasses
import http.client
import socket
import time
import xmlrpc.client
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from xml.parsers.expat import ExpatError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

_TO_SERVER = ("goal", "cancel")
_TO_CLIENT = ("status", "feedback", "result")
_GOAL_TYPE = "ActionGoal"
_RPC_SUCCESS = 1
_KEPT_ANSWERS = 8
"""Twice what a snapshot needs."""

ParameterTree = dict[str, Any]
"""Parameters as the master keeps them: nested dicts by name part."""


class SnapshotError(Exception):
    """The master could not be asked, or answered something that is no answer; the message names it and why."""


class MasterGoneError(SnapshotError):
    """Nobody listens at the master's address: the master has ended."""


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
    Who does less only watches, or helps out: it has ends of topics, and none of the action.
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


class MasterClient:
    """Asks the master over one kept connection, with a deadline per call. Not for use by several threads at once."""

    def __init__(self, uri: str, caller_id: str = "/rosgraph_snapshot", timeout: float = 1.5) -> None:
        """Prepare the client; nothing is connected yet.

        Args:
            uri: address of the master, e.g. `http://localhost:11311`.
            caller_id: name under which the master is asked.
            timeout: wall seconds in which a whole answer must have arrived.

        Raises:
            SnapshotError: the address is no http address.
        """
        self.uri = uri
        self._caller_id = caller_id
        self._last: tuple[tuple[Any, ...], GraphSnapshot] | None = None
        try:
            self._proxy = xmlrpc.client.ServerProxy(uri, transport=TimedTransport(timeout))
        except (OSError, ValueError) as error:
            raise SnapshotError(f"ROS master address {uri!r}: {error}: set ROS_MASTER_URI") from error

    def close(self) -> None:
        """Close the kept connection; the next call opens a new one."""
        self._proxy("close")()

    def master_pid(self) -> int:
        """Return the process id of the master, which tells it from another one at its address.

        Raises:
            MasterGoneError: nobody listens at the master's address.
            SnapshotError: the master did not answer in time, or answered with garbage or an error.
        """
        pid = self._call("getPid")
        if not isinstance(pid, int):
            raise SnapshotError(f"ROS master {self.uri}: answer to getPid is garbage: {pid!r}")
        return pid

    def snapshot(self) -> GraphSnapshot:
        """Take a snapshot in four calls. While nothing has changed, it is the same object as before.

        Raises:
            MasterGoneError: nobody listens at the master's address.
            SnapshotError: the master did not answer in time, or answered with garbage or an error.
        """
        state = self._call("getSystemState")
        types = self._call("getTopicTypes")
        parameters = self._call("getParam", "/")
        answers = state, types, parameters, self._addresses(_node_names(state, self.uri))
        if self._last is None or not _identical(answers, self._last[0]):
            graph = build_snapshot(state, _topic_types(types, self.uri), parameters, answers[3])
            self._last = answers, graph
        return self._last[1]

    def _addresses(self, names: Sequence[str]) -> dict[str, str]:
        """Look up all nodes in one request; nodes that have gone meanwhile are left out."""
        if not names:
            return {}
        calls = [{"methodName": "lookupNode", "params": [self._caller_id, name]} for name in names]
        answers = self._request(lambda: self._proxy.system.multicall(calls), "system.multicall")
        if not isinstance(answers, list) or len(answers) != len(names):
            raise SnapshotError(f"ROS master {self.uri}: no useful answer to system.multicall")
        found = {}
        for name, answer in zip(names, answers, strict=True):
            if isinstance(answer, list) and len(answer) == 1:
                match answer[0]:
                    case [int(code), _, str(uri)] if code == _RPC_SUCCESS:
                        found[name] = uri
        return found

    def _call(self, method: str, *arguments: str) -> Any:
        answer = self._request(lambda: getattr(self._proxy, method)(self._caller_id, *arguments), method)
        match answer:
            case [int(code), str(text), value]:
                if code != _RPC_SUCCESS:
                    raise SnapshotError(f"ROS master {self.uri} refuses {method}: {text}")
                return value
        raise SnapshotError(f"ROS master {self.uri}: no useful answer to {method}")

    def _request(self, request: Any, method: str) -> Any:
        try:
            try:
                return request()
            except (ConnectionResetError, BrokenPipeError):
                # It closed the connection, or is ending in the middle of the call: the next attempt tells.
                self.close()
                return request()
        except ConnectionRefusedError as error:
            self.close()
            raise MasterGoneError(f"ROS master {self.uri} is gone ({error.strerror})") from error
        except (OSError, http.client.HTTPException) as error:
            self.close()
            raise SnapshotError(f"ROS master {self.uri} does not answer {method}: {error or 'timed out'}") from error
        except (xmlrpc.client.Error, ExpatError, ValueError, TypeError, LookupError) as error:
            self.close()
            raise SnapshotError(f"ROS master {self.uri}: answer to {method} is garbage: {error}") from error


def take_snapshot(uri: str, timeout: float = 1.5) -> GraphSnapshot:
    """Take one snapshot of the graph of the master at that address (see `MasterClient` for the errors)."""
    client = MasterClient(uri, timeout=timeout)
    try:
        return client.snapshot()
    finally:
        client.close()


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


def _identical(one: Any, other: Any) -> bool:
    """Compare answers of the master; 1 and True, which are equal, are not identical."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_identical(value, other[key]) for key, value in one.items())
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(_identical, one, other))
    return bool(one == other)


def _node_names(state: object, uri: str) -> list[str]:
    """Check the form of a system state, and return all nodes that it mentions."""
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
        raise SnapshotError(f"ROS master {uri}: answer to getSystemState is garbage: {error}") from error
    return sorted(names)


def _topic_types(types: Any, uri: str) -> list[tuple[str, str]]:
    """Check the form of an answer to getTopicTypes."""
    match types:
        case [*pairs] if all(isinstance(pair, list) and [type(end) for end in pair] == [str, str] for pair in pairs):
            return [(name, type_name) for name, type_name in pairs]
    raise SnapshotError(f"ROS master {uri}: answer to getTopicTypes is garbage")


class TimedTransport(xmlrpc.client.Transport):
    """A transport whose calls end after a time, be the answer slow to begin or slow to come.

    An answer that came before, byte by byte, is not unpacked again but is the same object, which nobody may change:
    of a graph that is looked at twice a second, little changes. So answers are not asked for compressed, which takes
    both sides longer than it saves on a robot, and makes the same answer look different.
    """

    accept_gzip_encoding = False

    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout
        self._deadline = 0.0
        self._unpacked: dict[bytes, Any] = {}

    def request(self, *arguments: Any, **options: Any) -> Any:
        """Call, within the time."""
        self._deadline = time.monotonic() + self._timeout
        return super().request(*arguments, **options)

    def parse_response(self, response: Any) -> Any:
        """Unpack an answer."""
        body = response.read()
        if body in self._unpacked:
            answer = self._unpacked.pop(body)
        else:
            parser, unmarshaller = self.getparser()
            parser.feed(body)
            parser.close()
            answer = unmarshaller.close()
        self._unpacked[body] = answer  # at the end: the first is the one that was not seen for longest
        if len(self._unpacked) > _KEPT_ANSWERS:
            del self._unpacked[next(iter(self._unpacked))]
        return answer

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        """Return the kept connection, with the deadline of this call."""
        if not self._connection or host != self._connection[0]:
            name, self._extra_headers, _ = self.get_host_info(host)
            self._connection = host, _Connection(name)
        self._connection[1].deadline = self._deadline  # type: ignore[union-attr]
        return self._connection[1]  # type: ignore[return-value]


class _Connection(http.client.HTTPConnection):
    """A connection that has a deadline."""

    deadline = 0.0

    def connect(self) -> None:
        """Connect within what is left of the time."""
        self.timeout = max(self.deadline - time.monotonic(), 0.001)
        super().connect()
        plain = self.sock
        self.sock = _DeadlineSocket(plain.family, plain.type, plain.proto, fileno=plain.detach())

    def send(self, data: Any) -> None:
        """Send, after connecting where that is still to be done; the answer has the same deadline."""
        if self.sock is None:
            self.connect()
        if isinstance(self.sock, _DeadlineSocket):
            self.sock.deadline = self.deadline
        super().send(data)


class _DeadlineSocket(socket.socket):
    """A socket on which all that is sent and received must be done by a deadline, however small the pieces."""

    deadline = 0.0

    def recv_into(self, *arguments: Any, **options: Any) -> int:
        """Receive within what is left of the time."""
        self._hurry()
        return super().recv_into(*arguments, **options)

    def sendall(self, *arguments: Any, **options: Any) -> None:
        """Send within what is left of the time."""
        self._hurry()
        super().sendall(*arguments, **options)

    def _hurry(self) -> None:
        left = self.deadline - time.monotonic()
        if left <= 0.0:
            raise TimeoutError("timed out")
        self.settimeout(left)
