"""Runs side by side have masters of their own."""

import socket
from xmlrpc.server import SimpleXMLRPCServer

from metacontrol_experiments.io.processes import reserved_port


def test_port_of_a_run_is_given_to_nobody_else_but_its_master_can_listen_there():
    with reserved_port() as port, SimpleXMLRPCServer(("", port), logRequests=False), socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind(("", 0))
        assert other.getsockname()[1] != port
    with reserved_port() as one, reserved_port() as other:
        assert one != other
