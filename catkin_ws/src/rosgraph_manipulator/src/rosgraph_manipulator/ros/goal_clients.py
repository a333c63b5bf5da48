"""Looks up who waits for the goals of an action; `goals.clients` judges it."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import rospy
from node_kit.io.xml_rpc import CallError, DeniedError, GoneError
from node_kit.io.xml_rpc import Client as Api
from rosgraph_launcher.io.master import master

from rosgraph_manipulator.goals.clients import Client, client_of
from rosgraph_manipulator.io.master import CALLER, publishers, subscribers

_TIMEOUT = 0.5  # s, wall, for a node to answer: one that has died refuses at once


class GoalClients:
    """The clients of one action, by the master and by their own APIs."""

    def __init__(self, action: str, server: str = "") -> None:
        """Take the names of the action, and of the one behind it whose server pursues its goals, if there is one."""
        self._result = rospy.resolve_name(f"{action}/result")
        self._status = rospy.resolve_name(f"{server or action}/status")

    def of(self, goal: Any) -> Client | None:
        """Return who waits for a goal that has just come as a message; None: nobody who is known."""
        sender = goal._connection_header.get("callerid", "")
        if not sender or sender == rospy.get_name():  # a goal that this node repeats
            return None
        try:
            return client_of(sender, _address(sender), subscribers(self._result), publishers(self._status))
        except CallError:
            return None

    def why_gone(self, client: Client | None, leaving: Collection[str] = ()) -> str:
        """Return why nobody waits any more; empty where the client does, as far as is known, or there is none.

        Args:
            client: who waited.
            leaving: the nodes that are about to end together with the server.
        """
        if client is None:
            return ""
        try:
            address = _address(client.node)
            refuses = bool(address) and _refuses(address)
            return client.why_gone(address, subscribers(self._result), refuses, leaving)
        except CallError:  # the master is slow
            return ""


def _address(node: str) -> str:
    """Return the address of a node's API; empty: the node is not registered.

    Raises:
        CallError: the master does not answer.
    """
    try:
        with master(CALLER) as connection:
            return str(connection.call("lookupNode", node))
    except DeniedError:
        return ""


def _refuses(address: str) -> bool:
    """Return whether nobody takes connections at the address of a node's API."""
    try:
        with Api(address, CALLER, _TIMEOUT, peer="node") as node:
            node.call("getPid")
    except GoneError:
        return True
    except CallError:  # it hangs, or its host is slow
        return False
    return False
