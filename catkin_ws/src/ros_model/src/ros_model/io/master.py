"""Asks a ROS master for a snapshot of the graph, in four calls.

The calls are getSystemState, getTopicTypes, getParam of the whole tree, and one `system.multicall` of lookupNode for
the nodes' addresses. Nothing here is asked of the nodes themselves: a node that the master lists may well be dead.
"""

from __future__ import annotations

import http.client
import socket
import time
import xmlrpc.client
from typing import TYPE_CHECKING, Any
from xml.parsers.expat import ExpatError

from ros_model.graph.snapshot import build_snapshot, node_names, topic_types

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ros_model.graph.snapshot import GraphSnapshot

_RPC_SUCCESS = 1
_KEPT_ANSWERS = 8
"""Twice what a snapshot needs."""


class SnapshotError(Exception):
    """The master could not be asked, or answered something that is no answer; the message names it and why."""


class MasterGoneError(SnapshotError):
    """Nobody listens at the master's address: the master has ended."""


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
        try:
            names = node_names(state)
            answers = state, types, parameters, self._addresses(names)
            if self._last is None or not _identical(answers, self._last[0]):
                self._last = answers, build_snapshot(state, topic_types(types), parameters, answers[3])
        except ValueError as error:
            raise SnapshotError(f"ROS master {self.uri}: {error}") from error
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
