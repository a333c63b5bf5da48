"""Calls to the master and to the nodes' own APIs, each with a deadline."""

from __future__ import annotations

import socket
from collections.abc import Iterable, Mapping
from typing import Any

import rosgraph
from node_kit.io.xml_rpc import CallError, Client, DeniedError, SilentError

CALL_TIMEOUT = 1.0  # s, wall
CALLER = "/rosgraph_manipulator"


def _master(caller: str = CALLER) -> Client:
    return Client(rosgraph.get_master_uri(), caller, CALL_TIMEOUT)


class NodeApi:
    """The XML-RPC API that every ROS node offers."""

    @classmethod
    def address(cls, name: str) -> str | None:
        """Return a node's address, as the master knows it; None where the node is not registered."""
        try:
            with _master() as master:
                return str(master.call("lookupNode", name)) or None
        except CallError:
            return None

    @classmethod
    def answer(cls, name: str) -> tuple[str, int] | None:
        """Return a node's address and the process id that it says; None: it is not registered or does not answer."""
        uri = cls.address(name)
        if uri is None:
            return None
        try:
            with Client(uri, CALLER, CALL_TIMEOUT, peer="node") as node:
                return uri, int(node.call("getPid"))
        except (CallError, TypeError, ValueError):
            return None

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


def get_parameters(names: Iterable[str]) -> dict[str, Any]:
    """Return the values of parameters, by full name; those that are not set are left out.

    Raises:
        CallError: the master does not answer.
    """
    names = list(names)
    with _master() as master:
        answers = master.call_all([("getParam", name) for name in names])
    return {name: value for name, (is_set, value) in zip(names, answers, strict=True) if is_set}


def set_parameters(values: Mapping[str, Any], delete: Iterable[str] = ()) -> None:
    """Delete parameters, then set others, by full name.

    Raises:
        CallError: the master does not answer, or refuses a value.
    """
    names = list(values)
    with _master() as master:
        master.call_all([("deleteParam", name) for name in delete])
        answers = master.call_all([("setParam", name, values[name]) for name in names])
    for name, (done, _) in zip(names, answers, strict=True):
        if not done:
            raise DeniedError(f"the master refuses parameter {name} = {values[name]!r}")


def publishers(topic: str) -> set[str]:
    """Return the nodes that publish a topic.

    Raises:
        CallError: the master does not answer.
    """
    return set(dict(_system_state()[0]).get(topic, ()))


def advertised(nodes: Iterable[str]) -> set[str]:
    """Return the topics that nodes publish, and the services that they offer.

    Raises:
        CallError: the master does not answer.
    """
    wanted = set(nodes)
    topics, _, services = _system_state()
    return {name for name, owners in (*topics, *services) if wanted & set(owners)}


def services_of(node: str) -> list[str]:
    """Return the services that a node offers.

    Raises:
        CallError: the master does not answer.
    """
    return [name for name, owners in _system_state()[2] if node in owners]


def forget_node(name: str) -> None:
    """Unregister a node that ended without doing so itself; a node that answers is left alone.

    Raises:
        CallError: the master does not answer.
    """
    uri = NodeApi.address(name)
    if uri is None or NodeApi.is_answering(name):
        return
    published, subscribed, services = _system_state()
    calls = [("unregisterPublisher", topic, uri) for topic, owners in published if name in owners]
    calls += [("unregisterSubscriber", topic, uri) for topic, owners in subscribed if name in owners]
    offered = [service for service, owners in services if name in owners]
    with _master(caller=name) as master:
        addresses = master.call_all([("lookupService", service) for service in offered])
        calls += [
            ("unregisterService", service, address)
            for service, (known, address) in zip(offered, addresses, strict=True)
            if known
        ]
        master.call_all(calls)


def _system_state() -> Any:
    with _master() as master:
        return master.call("getSystemState")
