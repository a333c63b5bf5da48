"""Ports for servers that can't choose one themselves."""

from metacontrol_experiments.io.processes import reserved_port

QUIET_HOST = "127.0.0.2"
"""A loopback address that no node or master has. Clients in other tests try the port of a server that is gone again and
again, and the system may give that port to the next test's server: at this address they do not find it."""


def free_port():
    """Return a TCP port that nobody listens on now; the system may give it to somebody else a moment later."""
    with reserved_port() as port:
        return port
