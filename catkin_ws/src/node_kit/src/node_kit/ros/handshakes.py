"""Has rospy greet each client in a thread of its own, and not for ever.

rospy reads the header of a new TCPROS connection in the thread that accepts all of them, without a deadline. Somebody
who connects and says nothing, or takes the port for that of another node, as callers of an ended node may whose port
was given anew, keeps all others out: topics are not connected any more, and services do not answer.

Where no descriptor or thread is left for a client, the thread that accepts waits until there is one (`shortages.py`).

A subscriber that connects twice has closed its first connection before it makes the second (`connections.py`). rospy
would let the first replace the second where it is handled last; so connections that are closed already are left out.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import Any

from rospy.impl import tcpros_base

from node_kit.ros.shortages import PatientServer, PatientThread

PATIENCE = 5.0
"""Wall s for a client to say what it wants."""

_Handler = Callable[[socket.socket, Any, Any], Any]


def greet_apart() -> None:
    """Change this node's TCPROS server, which `rospy.init_node` has started; it goes on as it was without one."""
    server = tcpros_base._tcpros_server  # rospy has no other way to it
    if server is None or server.tcp_ros_server is None:
        return
    greet = server.tcp_ros_server.inbound_handler

    def greet_in_thread(client: socket.socket, address: object) -> None:
        client.settimeout(PATIENCE)
        PatientThread(target=greet, args=(client, address), name="greeting", daemon=True).start()

    server.topic_connection_handler = _without_deadline(server.topic_connection_handler)
    server.service_connection_handler = _without_deadline(server.service_connection_handler)
    server.tcp_ros_server.inbound_handler = greet_in_thread
    server.tcp_ros_server.server_sock = PatientServer(server.tcp_ros_server.server_sock)


def _without_deadline(handler: _Handler) -> _Handler:
    """Return a handler of connections whose header is read; from then on they may be silent. Closed ones are none."""

    def handle(client: socket.socket, address: object, header: object) -> Any:
        if _is_closed(client):
            client.close()
            return None
        client.setblocking(True)
        return handler(client, address, header)

    return handle


def _is_closed(client: socket.socket) -> bool:
    """Tell whether the other side has closed a connection on which all it has sent was read; it does not block then."""
    client.setblocking(False)
    try:
        return not client.recv(1, socket.MSG_PEEK)
    except BlockingIOError:
        return False
    except OSError:
        return True
