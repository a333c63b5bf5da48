"""Has rospy outlast a moment in which no thread or no descriptor is left, for its process or on its host.

With rospy alone, such a moment leaves a node deaf for ever, while it works and gives signs of life:

- The thread that accepts connections ends where it gets no descriptor: nobody is connected any more.
- The thread that connects topics ends where it can't start another: publishers that come later are never heard.
- The server of the node's API drops a call for which it gets no thread, such as the master's word of a new publisher,
  which comes only once.
- A subscriber gives up a connection for which it gets no descriptor, and takes one for made whose thread could not be
  started. Nobody connects again.

Here rospy waits until there is a thread or a descriptor, and asks a publisher again that it has not reached.
"""

from __future__ import annotations

import socket
import threading
import time
from types import SimpleNamespace
from typing import Any, Callable

import rospy
from rosgraph.xmlrpc import ThreadingXMLRPCServer
from rospy.impl import registration, tcpros_pubsub

PAUSE = 0.1
"""Wall s until a thread or a descriptor is wanted again."""
ASKS_AGAIN = 1.0
"""Wall s until a publisher is asked again that was not reached."""

_connect = tcpros_pubsub.robust_connect_subscriber


class PatientThread(threading.Thread):
    """A thread whose start waits until there is one."""

    def start(self) -> None:
        """Start, in time; where the node ends meanwhile, fail as other threads do."""
        while True:
            try:
                super().start()
            except (RuntimeError, MemoryError):
                if self.ident is not None or rospy.is_shutdown():  # it runs, or nobody needs it any more
                    raise
                time.sleep(PAUSE)
            else:
                return


class PatientServer:
    """A listening socket that goes on where it can't accept a connection, until it is closed."""

    def __init__(self, server: socket.socket) -> None:
        """Take the socket over."""
        self._server = server
        self.close = server.close

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection, and where it comes from.

        Raises:
            OSError: the server is closed.
        """
        while True:
            try:
                return self._server.accept()
            except OSError:
                if self._server.fileno() < 0:
                    raise
            time.sleep(PAUSE)


def outlast_shortages() -> None:
    """Change rospy in this process, before `rospy.init_node` or after it; without effect a second time."""
    patient = SimpleNamespace(**{**vars(threading), "Thread": PatientThread})
    registration.threading = tcpros_pubsub.threading = patient
    tcpros_pubsub.robust_connect_subscriber = _connect_or_ask_again
    ThreadingXMLRPCServer.process_request = _serve_in_time


def _serve_in_time(server: Any, request: Any, address: Any) -> None:
    """Serve a call in a thread of its own, as socketserver does."""
    PatientThread(target=server.process_request_thread, args=(request, address), daemon=True).start()


def _connect_or_ask_again(
    connection: Any, address: str, port: int, publisher: str, receive: Callable[..., object], topic: str
) -> None:
    """Connect to a publisher and listen to it; if it has never answered, ask it again later, as long as it is there."""
    _connect(connection, address, port, publisher, receive, topic)
    if connection.header is not None or rospy.is_shutdown():
        return
    time.sleep(ASKS_AGAIN)
    subscriber = registration.get_topic_manager().get_subscriber_impl(topic)
    if subscriber is not None:
        subscriber.remove_connection(connection)  # rospy still counts some that it has given up
    for manager in list(registration.get_registration_listeners().listeners):
        manager.publisher_update(topic, [publisher])
