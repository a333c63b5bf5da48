"""Calls to the master and to the nodes' own APIs, each with a deadline."""

from __future__ import annotations

import socket
from collections.abc import Iterable
from typing import Any

import rosgraph
from node_kit.io.xml_rpc import CallError, Client, SilentError

CALL_TIMEOUT = 1.0  # s, wall
CALLER = "/rosgraph_launcher"


def master(caller: str = CALLER) -> Client:
    """Return a client of the master, for a `with` block.

    Args:
        caller: the name of the node that calls.
    """
    return Client(rosgraph.get_master_uri(), caller, CALL_TIMEOUT)


class NodeApi:
    """The XML-RPC API that every ROS node offers."""

    @classmethod
    def address(cls, name: str) -> str | None:
        """Return a node's address, as the master knows it; None where the node is not registered."""
        try:
            with master() as connection:
                return str(connection.call("lookupNode", name)) or None
        except CallError:
            return None

    @classmethod
    def answer(cls, name: str) -> tuple[str, int] | None:
        """Return a node's address and the process id that it says; None: it is not registered or does not answer."""
        uri = cls.address(name)
        pid = cls.pid(uri) if uri else None
        return None if uri is None or pid is None else (uri, pid)

    @classmethod
    def pid(cls, uri: str) -> int | None:
        """Return the process id that the node at an address says; None: it does not answer."""
        try:
            return cls.ask_pid(uri)
        except CallError:
            return None

    @classmethod
    def ask_pid(cls, uri: str) -> int:
        """Return the process id that the node at an address says.

        Raises:
            GoneError: nobody listens there.
            SilentError: it does not answer within CALL_TIMEOUT.
            CallError: its answer makes no sense.
        """
        with Client(uri, CALLER, CALL_TIMEOUT, peer="node") as node:
            return node.pid()

    @classmethod
    def is_answering(cls, name: str) -> bool:
        """Tell whether a node is registered at the master and answers."""
        return cls.answer(name) is not None

    @classmethod
    def request_shutdown(cls, name: str, reason: str) -> bool:
        """Ask a node to end; return whether it could be asked."""
        uri = cls.address(name)
        if uri is None:
            return False
        try:
            with Client(uri, CALLER, CALL_TIMEOUT, peer="node") as node:
                node.call("shutdown", reason)
        except SilentError as error:  # it may go down before it has answered
            return not isinstance(error.__cause__, socket.gaierror)
        except CallError:
            return False
        return True


def advertised(nodes: Iterable[str]) -> set[str]:
    """Return the topics that nodes publish, and the services that they offer.

    Raises:
        CallError: the master does not answer.
    """
    wanted = set(nodes)
    topics, _, services = system_state()
    return {name for name, owners in (*topics, *services) if wanted & set(owners)}


def forget_node(name: str) -> None:
    """Unregister a node that ended without doing so itself; a node that answers is left alone.

    Raises:
        CallError: the master does not answer.
    """
    uri = NodeApi.address(name)
    if uri is None or NodeApi.is_answering(name):
        return
    published, subscribed, services = system_state()
    calls = [("unregisterPublisher", topic, uri) for topic, owners in published if name in owners]
    calls += [("unregisterSubscriber", topic, uri) for topic, owners in subscribed if name in owners]
    offered = [service for service, owners in services if name in owners]
    with master(caller=name) as connection:
        addresses = connection.call_all([("lookupService", service) for service in offered])
        calls += [
            ("unregisterService", service, address) for service, (known, address) in zip(offered, addresses) if known
        ]
        connection.call_all(calls)


def system_state() -> Any:
    """Return the publishers, subscribers and services that the master knows, each as (name, nodes).

    Raises:
        CallError: the master does not answer.
    """
    with master() as connection:
        return connection.call("getSystemState")
