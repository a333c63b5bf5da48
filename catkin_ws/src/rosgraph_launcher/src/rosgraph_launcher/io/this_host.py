"""The names and addresses by which this host is known."""

from __future__ import annotations

import os
import socket

import rosgraph


def addresses(given: str = "") -> list[str]:
    """Return names and addresses of this host; the first one is the name that it goes by.

    Args:
        given: that name; empty: ROS_HOSTNAME, ROS_IP or the host's own name.
    """
    own = socket.gethostname()
    by_ros = [os.environ.get("ROS_HOSTNAME", ""), os.environ.get("ROS_IP", "")]
    found = [given, *by_ros, own, *rosgraph.network.get_local_addresses()]
    return [name for name in dict.fromkeys(found) if name and not name.startswith(("127.", "::1"))]


def resolved(address: str) -> set[str]:
    """Return the addresses that the name service has for a name or an address; it may take its time."""
    try:
        return {str(entry[4][0]) for entry in socket.getaddrinfo(address, None)}
    except (OSError, UnicodeError):
        return set()
