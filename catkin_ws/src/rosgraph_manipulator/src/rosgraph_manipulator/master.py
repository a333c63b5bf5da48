"""Calls to the master and to the nodes' own APIs, each with a deadline."""

from __future__ import annotations

import http.client
import socket
import xmlrpc.client
from typing import Any

import rosgraph

CALL_TIMEOUT = 1.0  # s, wall


class _Transport(xmlrpc.client.Transport):
    """An XML-RPC transport whose calls end in time."""

    def make_connection(self, host: str) -> http.client.HTTPConnection:  # type: ignore[override]
        """Return a connection with a timeout."""
        connection = super().make_connection(host)
        connection.timeout = CALL_TIMEOUT
        return connection


class NodeApi:
    """The XML-RPC API that every ROS node offers."""

    CALLER = "/rosgraph_manipulator"

    @classmethod
    def is_answering(cls, name: str) -> bool:
        """Tell whether a node is registered at the master and answers."""
        try:
            uri = rosgraph.Master(cls.CALLER).lookupNode(name)
            answer: Any = xmlrpc.client.ServerProxy(uri, transport=_Transport()).getPid(cls.CALLER)
            code = answer[0]
        except (rosgraph.MasterException, OSError, xmlrpc.client.Error, http.client.HTTPException, LookupError):
            return False
        return bool(code == 1)

    @classmethod
    def request_shutdown(cls, name: str, reason: str) -> bool:
        """Ask a node to end; return whether it could be asked."""
        try:
            uri = rosgraph.Master(cls.CALLER).lookupNode(name)
            xmlrpc.client.ServerProxy(uri, transport=_Transport()).shutdown(cls.CALLER, reason)
        except (rosgraph.MasterException, xmlrpc.client.Error, socket.gaierror, ConnectionRefusedError):
            return False
        except (OSError, http.client.HTTPException):
            return True  # it may go down before it has answered
        return True
