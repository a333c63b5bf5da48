"""Asks a ROS master for a snapshot of the graph, in four calls.

The calls are getSystemState, getTopicTypes, getParam of the whole tree, and one `system.multicall` of lookupNode for
the nodes' addresses. Nothing here is asked of the nodes themselves: a node that the master lists may well be dead.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from node_kit.io.xml_rpc import TIMEOUT, Client, GarbageError

from ros_model.graph.snapshot import build_snapshot, node_names, topic_types

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ros_model.graph.snapshot import GraphSnapshot

_KEPT_ANSWERS = 8
"""Twice what a snapshot needs."""


class MasterClient:
    """Asks the master over one kept connection, with a deadline per call. Not for use by several threads at once."""

    def __init__(self, uri: str, caller_id: str = "/rosgraph_snapshot", timeout: float = TIMEOUT) -> None:
        """Prepare the client; nothing is connected yet.

        Args:
            uri: address of the master, e.g. `http://localhost:11311`.
            caller_id: name under which the master is asked.
            timeout: wall seconds in which a whole answer must have arrived.

        Raises:
            CallError: the address is no http address.
        """
        self.uri = uri
        self._last: tuple[tuple[Any, ...], GraphSnapshot] | None = None
        self._client = Client(uri, caller_id, timeout, kept_answers=_KEPT_ANSWERS)

    def close(self) -> None:
        """Close the kept connection; the next call opens a new one."""
        self._client.close()

    def snapshot(self) -> GraphSnapshot:
        """Take a snapshot in four calls. While nothing has changed, it is the same object as before.

        Raises:
            GoneError: nobody listens at the master's address.
            CallError: the master did not answer in time, or answered with garbage or an error.
        """
        state = self._client.call("getSystemState")
        types = self._client.call("getTopicTypes")
        parameters = self._client.call("getParam", "/")
        try:
            names = node_names(state)
            answers = state, types, parameters, self._addresses(names)
            if self._last is None or not _identical(answers, self._last[0]):
                self._last = answers, build_snapshot(state, topic_types(types), parameters, answers[3])
        except ValueError as error:
            raise GarbageError(f"ROS master {self.uri}: {error}") from error
        return self._last[1]

    def _addresses(self, names: Sequence[str]) -> dict[str, str]:
        """Look up all nodes in one request; nodes that have gone meanwhile are left out."""
        answers = self._client.call_all([("lookupNode", name) for name in names])
        return {name: uri for name, (known, uri) in zip(names, answers, strict=True) if known and isinstance(uri, str)}


def take_snapshot(uri: str, timeout: float = TIMEOUT) -> GraphSnapshot:
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
