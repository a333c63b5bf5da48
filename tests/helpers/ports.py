"""Ports for servers that can't choose one themselves."""

import socket
from contextlib import contextmanager

QUIET_HOST = "127.0.0.2"
"""A loopback address that no node or master has. Clients in other tests try the port of a server that is gone again and
again, and the system may give that port to the next test's server: at this address they do not find it."""


@contextmanager
def reserved_port():
    """Give a TCP port that the system gives to nobody else; a server with SO_REUSEADDR, as a master is, can take it."""
    with socket.socket() as holder:
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        holder.bind(("", 0))
        yield holder.getsockname()[1]
