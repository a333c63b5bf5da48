"""Calls to the master and to the nodes' own APIs, each with a deadline."""

from __future__ import annotations

import http.client
import socket
import xmlrpc.client
from collections.abc import Iterable, Mapping
from typing import Any

import rosgraph

CALL_TIMEOUT = 1.0  # s, wall
CALLER = "/rosgraph_manipulator"

_TRANSPORT_ERRORS = (OSError, xmlrpc.client.Error, http.client.HTTPException)


class MasterError(Exception):
    """The master does not answer, or refuses; the message says what."""


class _Transport(xmlrpc.client.Transport):
    """An XML-RPC transport whose calls end in time."""

    def make_connection(self, host: str) -> http.client.HTTPConnection:  # type: ignore[override]
        """Return a connection with a timeout."""
        connection = super().make_connection(host)
        connection.timeout = CALL_TIMEOUT
        return connection


def _proxy(uri: str) -> Any:
    return xmlrpc.client.ServerProxy(uri, transport=_Transport(), allow_none=False)


def _master() -> Any:
    return _proxy(rosgraph.get_master_uri())


class NodeApi:
    """The XML-RPC API that every ROS node offers."""

    @classmethod
    def address(cls, name: str) -> str | None:
        """Return a node's address, as the master knows it; None where the node is not registered."""
        try:
            code, _, uri = _master().lookupNode(CALLER, name)
        except (*_TRANSPORT_ERRORS, ValueError):
            return None
        return str(uri) if code == 1 and uri else None

    @classmethod
    def pid(cls, name: str) -> int | None:
        """Return a node's process id, or None where it is not registered or does not answer."""
        uri = cls.address(name)
        if uri is None:
            return None
        try:
            code, _, pid = _proxy(uri).getPid(CALLER)
        except (*_TRANSPORT_ERRORS, ValueError):
            return None
        return int(pid) if code == 1 else None

    @classmethod
    def is_answering(cls, name: str) -> bool:
        """Tell whether a node is registered at the master and answers."""
        return cls.pid(name) is not None

    @classmethod
    def request_shutdown(cls, name: str, reason: str) -> bool:
        """Ask a node to end; return whether it could be asked."""
        uri = cls.address(name)
        if uri is None:
            return False
        try:
            _proxy(uri).shutdown(CALLER, reason)
        except (xmlrpc.client.Error, socket.gaierror, ConnectionRefusedError):
            return False
        except (OSError, http.client.HTTPException):
            return True  # it may go down before it has answered
        return True


def get_parameters(names: Iterable[str]) -> dict[str, Any]:
    """Return the values of parameters, by full name; those that are not set are left out.

    Raises:
        MasterError: the master does not answer.
    """
    names = list(names)
    answers = _multicall([("getParam", name) for name in names])
    return {name: value for name, (code, value) in zip(names, answers, strict=True) if code == 1}


def set_parameters(values: Mapping[str, Any], delete: Iterable[str] = ()) -> None:
    """Delete parameters, then set others, by full name.

    Raises:
        MasterError: the master does not answer, or refuses a value.
    """
    _multicall([("deleteParam", name) for name in delete])
    names = list(values)
    for name, (code, _) in zip(names, _multicall([("setParam", name, values[name]) for name in names]), strict=True):
        if code != 1:
            raise MasterError(f"the master refuses parameter {name} = {values[name]!r}")


def publishers(topic: str) -> set[str]:
    """Return the nodes that publish a topic.

    Raises:
        MasterError: the master does not answer.
    """
    return set(dict(_system_state()[0]).get(topic, ()))


def advertised(nodes: Iterable[str]) -> set[str]:
    """Return the topics that nodes publish, and the services that they offer.

    Raises:
        MasterError: the master does not answer.
    """
    wanted = set(nodes)
    topics, _, services = _system_state()
    return {name for name, owners in (*topics, *services) if wanted & set(owners)}


def services_of(node: str) -> list[str]:
    """Return the services that a node offers.

    Raises:
        MasterError: the master does not answer.
    """
    return [name for name, owners in _system_state()[2] if node in owners]


def forget_node(name: str) -> None:
    """Unregister a node that ended without doing so itself; a node that answers is left alone.

    Raises:
        MasterError: the master does not answer.
    """
    uri = NodeApi.address(name)
    if uri is None or NodeApi.is_answering(name):
        return
    published, subscribed, services = _system_state()
    calls = [("unregisterPublisher", topic, uri) for topic, owners in published if name in owners]
    calls += [("unregisterSubscriber", topic, uri) for topic, owners in subscribed if name in owners]
    for service, owners in services:
        if name in owners:
            code, address = _multicall([("lookupService", service)])[0]
            calls += [("unregisterService", service, address)] if code == 1 else []
    _multicall(calls, caller=name)


def _system_state() -> Any:
    try:
        code, text, state = _master().getSystemState(CALLER)
    except (*_TRANSPORT_ERRORS, ValueError) as error:
        raise MasterError(f"the master does not answer: {error}") from error
    if code != 1:
        raise MasterError(f"the master refuses getSystemState: {text}")
    return state


def _multicall(calls: list[tuple[Any, ...]], caller: str = CALLER) -> list[tuple[int, Any]]:
    """Return (code, value) of each call, in one request."""
    if not calls:
        return []
    requests = [{"methodName": name, "params": [caller, *arguments]} for name, *arguments in calls]
    try:
        answers = _master().system.multicall(requests)
    except (*_TRANSPORT_ERRORS, TypeError, OverflowError) as error:
        raise MasterError(f"the master does not answer: {error}") from error
    return [(int(answer[0][0]), answer[0][2]) if isinstance(answer, list) else (-1, None) for answer in answers]
