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
