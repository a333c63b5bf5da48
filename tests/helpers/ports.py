"""Ports for servers that can't choose one themselves."""

import socket
from contextlib import contextmanager


@contextmanager
def reserved_port():
    """Give a TCP port that the system gives to nobody else; a server with SO_REUSEADDR, as a master is, can take it."""
    with socket.socket() as holder:
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        holder.bind(("", 0))
        yield holder.getsockname()[1]
